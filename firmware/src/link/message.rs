//! Messages between host and device.
//!
//! The order of fields and variants is the wire format: whoever changes it must raise
//! [`PROTOCOL_VERSION`](super::packet::PROTOCOL_VERSION).

use serde::{Deserialize, Serialize};
use taxel_core::blob::Floats;

use crate::circuit::Constants;
use crate::readout::{Diagnosis, ScanSettings};

mod refusal;

pub use refusal::{ConfigurationField, KeepFault, ModelFault, Refusal};

/// A request of the host. The device answers each with one [`Report`] that repeats the request's number. Every
/// request may be repeated without harm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Ask for the device's identity. Answered by [`Report::Identity`].
    Identify,
    /// Ask for the counters since the start. Answered by [`Report::Statistics`].
    Statistics,
    /// Ask for the configuration in force. Answered by [`Report::Configuration`].
    Configuration,
    /// Put a configuration in force, until [`Request::Resume`] or a restart unless it is kept ([`Request::Keep`]).
    /// Answered by [`Report::Configuration`], or by [`Refusal::Configuration`], which leaves the previous one in force.
    Configure(Configuration),
    /// Average the next frames as the baseline, the sensor at rest. Answered by [`Report::Baseline`] when they
    /// have been scanned.
    CaptureBaseline {
        /// Number of frames, at least 1.
        frames: u16,
    },
    /// Decode these readings as if they had been scanned, with the faults that a scan would have.
    /// Answered by [`Report::Estimate`].
    ///
    /// While nothing is scanned, frames are of one series: tracked, with all rows read at `start_us`, or filtered in time. The
    /// filter counts frames of one time once.
    Decode {
        /// Number of the frame, repeated in the answer.
        frame: u32,
        /// Time in µs at which the frame began, by the host's clock, repeated in the answer.
        start_us: u64,
        /// Readings in Ω for the model in force, row after row; NaN is missing.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// Carry out one step of uploading a model. Answered by [`Report::Upload`].
    Upload(#[serde(borrow)] UploadStep<'a>),
    /// Restart the device, as after power-on. Answered by [`Report::Restarting`].
    Restart,
    /// Take these readings as the baseline. Answered by [`Report::Baseline`].
    SetBaseline {
        /// Readings in Ω for the model in force, row after row; NaN is unknown.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// Ask for the circuit's constants in force. Answered by [`Report::Constants`], or refused if there are none.
    Constants,
    /// Put constants in force until the next restart. Answered by [`Report::Constants`], or by
    /// [`Refusal::Constants`], which leaves the previous ones in force.
    SetConstants(#[serde(borrow)] Constants<'a>),
    /// Ask which settings are kept. Answered by [`Report::Kept`].
    Kept,
    /// Keep the setting in force over restarts. Answered by [`Report::Kept`]. Takes up to seconds on a board.
    Keep(Setting),
    /// Keep a setting no longer; it stays in force until the next restart. Answered by [`Report::Kept`].
    Forget(Setting),
    /// Put the configuration in force that is kept, else the default. Answered by [`Report::Configuration`].
    Resume,
    /// Put the model that was in force before this one in force again, over restarts as well. Answered by
    /// [`Report::Upload`] with [`UploadState::Confirmed`].
    Undo {
        /// CRC-32 of the model in force, which is left: a repeated request does not undo twice.
        crc_32: u32,
    },
    /// Let the chip reset while its supply is too low, for good, and restart. Answered by [`Report::Restarting`], or by
    /// [`Refusal::Flash`] if the supply is too low now, or the board cannot.
    SetBrownOut,
    /// Let the readout test itself. Answered by [`Report::Diagnosis`], or by [`Refusal::Unknown`] if it cannot.
    Diagnose,
}

/// Steps of uploading a model, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UploadStep<'a> {
    /// Erase the spare slot for a blob. Takes up to seconds on a board.
    Begin {
        /// The blob's first [`HEAD_BYTES`](taxel_core::blob::Model::HEAD_BYTES), which tell its length and its shape:
        /// a model for which there is no room costs no erase. More bytes are ignored.
        #[serde(borrow)]
        head: &'a [u8],
    },
    /// Write the next bytes of the blob.
    Chunk {
        /// Offset of these bytes in the blob; bytes that were received before are skipped.
        offset: u32,
        /// The bytes; their number is a multiple of four, except in the last chunk.
        #[serde(borrow)]
        bytes: &'a [u8],
    },
    /// Check the blob from end to end, and put it in force on trial if it is sound: until it is confirmed, a restart
    /// brings the previous model back.
    Try {
        /// Time in ms, at most half an hour, after which the previous model comes back unless the trial is confirmed.
        /// If the step is sent again, this time counts from then on.
        trial_ms: u32,
    },
    /// Abort the upload, and forget the bytes received. A model on trial is left for the previous one.
    Abort,
    /// Confirm the model on trial: it stays in force over restarts.
    Confirm,
}

/// A setting that a device can keep over restarts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Setting {
    /// The configuration.
    Configuration,
    /// The circuit's constants.
    Constants,
    /// The baseline.
    Baseline,
}

impl Setting {
    /// All settings.
    pub const ALL: [Self; 3] = [Self::Configuration, Self::Constants, Self::Baseline];
}

/// A report of the device, as an answer or unasked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Report<'a> {
    /// Identity of the device, and of the model in force.
    Identity(#[serde(borrow)] Identity<'a>),
    /// Counters since the start.
    Statistics(Statistics),
    /// The configuration in force.
    Configuration(Configuration),
    /// The baseline: the sensor at rest.
    Baseline {
        /// Mean readings in Ω, row after row; NaN where one was missing.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// Readings of one scan, before faulty ones are removed.
    Readings {
        /// Number of the frame, from 1 at the start; after its largest value it wraps around to 0.
        frame: u32,
        /// Time in µs since the device's start at which the scan began.
        start_us: u64,
        /// Readings in Ω, row after row.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// The estimate of one frame.
    Estimate(#[serde(borrow)] EstimateReport<'a>),
    /// Faults in the readings of one frame; sent for every frame that has some.
    Health(#[serde(borrow)] HealthReport<'a>),
    /// Progress of uploading a model.
    Upload(UploadState),
    /// The device restarts now.
    Restarting,
    /// The request was not carried out, and changed nothing.
    Refused(Refusal),
    /// The circuit's constants in force.
    Constants(#[serde(borrow)] Constants<'a>),
    /// The settings that are kept over restarts.
    Kept(Kept),
    /// What the readout found when it tested itself.
    Diagnosis(Diagnosis),
    /// A touch, its load or its slip began or ended; sent before the estimate of the scan that shows it.
    Event(EventReport),
}

/// Identity of the device, and of the model in force.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// Name of the board.
    pub board: &'a str,
    /// Version of the firmware.
    pub firmware: &'a str,
    /// Largest number of row-wires.
    pub rows: u8,
    /// Largest number of column-wires: readings a row.
    pub columns: u8,
    /// Largest number of outputs a row.
    pub outputs: u8,
    /// The model in force; `None` if there is none.
    pub model: Option<ModelIdentity>,
    /// Name of the scene or data set of the model in force, cut after 40 bytes; empty without a model.
    pub model_name: &'a str,
    /// Largest blob that a slot holds, in bytes.
    pub slot_bytes: u32,
    /// Largest chunk of an upload in bytes, a multiple of four.
    pub chunk_bytes: u16,
    /// Use of flash and RAM.
    pub memory: Memory,
    /// Number that no other device of this board has; zeros if the board has none.
    pub unique_id: [u8; 12],
    /// CRC-32 of the wires of all readings, in their order: of a row and a column each, as bytes that count from 0.
    pub wires_crc_32: u32,
}

/// Identity of the model in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ModelIdentity {
    /// CRC-32 at the end of the model's blob.
    pub crc_32: u32,
    /// Slot of the model, 0 or 1.
    pub slot: u8,
    /// Number of times that a model came into force for good on this device; 0 if this one was flashed with the firmware.
    pub generation: u32,
    /// Number of rows.
    pub rows: u8,
    /// Number of readings a row.
    pub inputs: u16,
    /// Number of outputs a row.
    pub outputs: u16,
    /// Whether the weights are decoded from a copy in RAM; else from the slot.
    pub in_ram: bool,
    /// CRC-64/XZ of the scene or data file that trained the model.
    pub scene_digest: u64,
    /// CRC-32 of the names of its readings, and then of their units.
    pub inputs_crc_32: u32,
    /// CRC-32 of the names of its outputs, and then of their units.
    pub outputs_crc_32: u32,
    /// Whether the model is on trial: not confirmed, and gone with the next restart.
    pub on_trial: bool,
}

/// Use of a device's memory, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Memory {
    /// Flash for the vector table.
    pub vector_table: u32,
    /// Flash for code.
    pub text: u32,
    /// Flash for constants.
    pub rodata: u32,
    /// RAM for variables with an initial value, and as much flash for these values.
    pub data: u32,
    /// RAM for variables that start as zero.
    pub bss: u32,
    /// RAM for variables that are not initialised.
    pub uninit: u32,
    /// RAM reserved for the stack.
    pub stack_reserved: u32,
    /// RAM that the stack has used at most since the start.
    pub stack_high_water: u32,
}

impl Memory {
    /// Bytes of flash that the firmware takes, without models.
    pub fn flash_bytes(&self) -> u32 {
        let parts = [self.vector_table, self.text, self.rodata, self.data];
        parts.into_iter().fold(0, u32::saturating_add)
    }

    /// Bytes of RAM that the firmware takes, with the stack at its deepest so far.
    pub fn ram_bytes(&self) -> u32 {
        let parts = [self.data, self.bss, self.uninit, self.stack_high_water];
        parts.into_iter().fold(0, u32::saturating_add)
    }
}

/// Settings that can be changed while the device runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// Time from one scan to the next in µs; with 0, nothing is scanned.
    pub frame_period_us: u32,
    /// Settings of each scan.
    pub scan: ScanSettings,
    /// Whether every scan's readings are sent.
    pub send_readings: bool,
    /// Whether every scan's estimate is sent.
    pub send_estimates: bool,
    /// What of the model's confidence is computed for every scan, and sent with its estimate.
    pub confidence: ConfidenceSent,
    /// A reading below this in Ω is taken for a short circuit.
    pub shorted_below_ohm: f32,
    /// A reading above this in Ω is taken for a broken wire.
    pub open_above_ohm: f32,
    /// Smallest relative change against the baseline that sets [`EstimateReport::CONTACT`].
    pub contact_threshold: f32,
    /// Time constant in µs of the filter in time ([`taxel_core::filter`]) that outputs pass; with 0, none.
    pub filter_time_constant_us: u32,
    /// Time in µs by which the filter and the tracker extrapolate outputs, from the middle of a scan.
    pub filter_lead_us: u32,
    /// Number of scans of which one is reported, with its estimate and its faults: those whose number it divides. All are
    /// decoded and filtered. Readings are sent of every scan.
    pub report_every: u16,
    /// Whether a model with a tracker ([`taxel_core::track`]) follows the contact; frames that it explains are not filtered.
    pub track: bool,
    /// Load at which its [event](taxel_core::events) begins, in the model's unit: of the force, or else of the largest output.
    /// With 0, none begins.
    pub load_threshold: f32,
    /// Speed in mm/s of a tracked contact's place at which a slip begins; with 0, none begins.
    pub slip_mm_per_s: f32,
}

/// What is sent of a model's confidence, by its [reading model](taxel_core::reading_model), with the estimate of a scan. An answer to
/// [`Request::Decode`] has all of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ConfidenceSent {
    /// Nothing, and nothing is computed.
    #[default]
    Nothing,
    /// The frame's novelty.
    Novelty,
    /// The frame's novelty, and a deviation for each output.
    Deviations,
}

/// Settings that are kept over restarts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// The configuration at the start; `None` if it is the image's.
    pub configuration: Option<Configuration>,
    /// Whether constants of the circuit are kept; else the image's are in force at the start.
    pub constants: bool,
    /// The baseline at the start; `None` if there is none.
    pub baseline: Option<KeptBaseline>,
    /// Number of times that settings may still be written before the next restart.
    pub writes_left: u16,
}

/// A baseline that is kept over restarts. It comes into force if the device scans these wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptBaseline {
    /// Number of lines of readings.
    pub rows: u8,
    /// Number of readings in a line.
    pub columns: u8,
    /// Number of frames that it is the mean of.
    pub frames: u16,
}

/// The estimate of one frame: outputs, status of rows, and flags.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EstimateReport<'a> {
    /// Number of the frame.
    pub frame: u32,
    /// Time in µs since the device's start at which the scan began; in an answer to [`Request::Decode`], the request's.
    pub start_us: u64,
    /// Sum of the flags below.
    pub flags: u8,
    /// One byte a row: 0 decoded, 1 a reading missing, 2 overflow, 3 no touch.
    pub row_status: &'a [u8],
    /// `rows × outputs` numbers in the units of the model's outputs, NaN where a row is not decoded; none without a
    /// model. Tracked or filtered, if the configuration says so.
    #[serde(borrow)]
    pub outputs: Floats<'a>,
    /// Novelty of the frame in nats: above 0, it is unlike the frames of training. NaN if a reading is missing, and the
    /// largest number of f32 if the frame is too far off to tell. `None` if the model does not tell it, or it was not
    /// asked for.
    pub novelty: Option<f32>,
    /// Standard deviation of every output of this frame before it is filtered, in its unit; NaN if a reading is missing.
    /// None at all if the model does not tell them, or they were not asked for.
    #[serde(borrow)]
    pub deviation: Floats<'a>,
}

impl EstimateReport<'_> {
    /// Flag: no model is in force, so no row is decoded.
    pub const NO_MODEL: u8 = 1;
    /// Flag: at least one reading is missing, shorted or open.
    pub const FAULTY_READING: u8 = 1 << 1;
    /// Flag: at least one output overflowed.
    pub const OVERFLOW: u8 = 1 << 2;
    /// Flag: at least one frame before this one could not be scanned in time.
    pub const OVERRUN: u8 = 1 << 3;
    /// Flag: the model takes readings relative to the baseline, and none is complete: no row is decoded.
    pub const NO_BASELINE: u8 = 1 << 5;
    /// Flag: a baseline was captured, and a reading differs from it by more than the threshold.
    pub const CONTACT: u8 = 1 << 4;
    /// Flag: at least one reading of a decoded row lies far beyond the range that the model was trained on, and was
    /// clamped ([`taxel_core::Decoder::decode_into`]).
    pub const CLAMPED: u8 = 1 << 6;
    /// Flag: the frame's novelty was computed and is above 0.
    pub const NOVEL: u8 = 1 << 7;
}

/// Events of a touch that a scan shows. Bits are 1 for touch, 2 for load, 4 for slip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventReport {
    /// Number of the frame.
    pub frame: u32,
    /// Time in µs since the device's start at which the scan began.
    pub start_us: u64,
    /// Time in µs from there until the events were known, and shown on the board's pins.
    pub after_us: u32,
    /// What began or ended.
    pub changed: u8,
    /// What goes on.
    pub going_on: u8,
}

/// Faulty readings of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HealthReport<'a> {
    /// Number of the frame.
    pub frame: u32,
    /// Time in µs since the device's start at which the scan began.
    pub start_us: u64,
    /// Number of readings that were not taken.
    pub missing: u16,
    /// Number of readings below the lower limit.
    pub shorted: u16,
    /// Number of readings above the upper limit.
    pub open: u16,
    /// Faulty readings: four bytes a line, little-endian, in which bit k is the reading k of the line, from 0.
    pub faulty_columns: &'a [u8],
}

/// Counters since the start. Each stops at its largest value, except the number of frames scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Statistics {
    /// Number of frames scanned, which numbers them. After its largest value it wraps around to 0.
    pub frames_scanned: u32,
    /// Number of frames decoded, scanned or on request.
    pub frames_decoded: u32,
    /// Number of frames that could not be scanned in time.
    pub frames_missed: u32,
    /// Number of samples that the converter did not give.
    pub failed_samples: u32,
    /// Number of requests answered.
    pub requests: u32,
    /// Number of frames of bytes that were damaged, cut, too long or not of this protocol.
    pub bad_packets: u32,
    /// Number of reports that the host did not take in time.
    pub lost_reports: u32,
    /// Number of turns of the loop that did not feed the watchdog.
    pub bad_loops: u32,
    /// Longest scan in µs.
    pub longest_scan_us: u32,
    /// Longest decoding of one frame in µs, its filter included.
    pub longest_decode_us: u32,
    /// Longest decoding of one frame in cycles of the processor; 0 on a board that does not count them.
    pub longest_decode_cycles: u32,
    /// Shortest decoding of one frame in cycles of the processor; 0 on a board that does not count them.
    pub shortest_decode_cycles: u32,
    /// Number of decoded frames with [`EstimateReport::CLAMPED`].
    pub frames_clamped: u32,
    /// Number of times that a slot was erased.
    pub slot_erases: u32,
    /// Number of frames with [`EstimateReport::NOVEL`].
    pub frames_novel: u32,
    /// Longest time in µs of computing a frame's confidence.
    pub longest_confidence_us: u32,
    /// Longest time of the same in cycles of the processor; 0 on a board that does not count them.
    pub longest_confidence_cycles: u32,
    /// Longest time in µs from the start of a scan until the board's line took the last byte of its estimate. What the
    /// line holds back, such as a ring of bytes, is still to be sent then.
    pub longest_latency_us: u32,
}

impl Statistics {
    /// Counts a scanned frame; returns its number. Behind the largest comes 0.
    pub fn number_frame(&mut self) -> u32 {
        self.frames_scanned = self.frames_scanned.wrapping_add(1);
        self.frames_scanned
    }
}

/// Progress of uploading a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UploadState {
    /// No upload is going on.
    Idle,
    /// The spare slot receives bytes.
    Receiving {
        /// Number of bytes received from the start without a gap: the offset of the next chunk.
        received: u32,
    },
    /// The blob is sound and in force, until the next restart.
    OnTrial {
        /// CRC-32 of the blob.
        crc_32: u32,
    },
    /// The blob is in force, over restarts as well.
    Confirmed {
        /// CRC-32 of the blob.
        crc_32: u32,
    },
    /// The blob was on trial and was not confirmed in time: the previous model is in force again. Reported unasked.
    TrialOver {
        /// CRC-32 of the blob.
        crc_32: u32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_on_behind_the_largest_number() {
        let mut s = Statistics { frames_scanned: u32::MAX - 1, ..Statistics::default() };
        assert_eq!([(); 3].map(|()| s.number_frame()), [u32::MAX, 0, 1]);
    }
}

//! Messages between host and device.
//!
//! The order of fields and variants is the wire format: whoever changes it must raise
//! [`PROTOCOL_VERSION`](super::packet::PROTOCOL_VERSION).

use serde::{Deserialize, Serialize};
use taxel_core::blob::Floats;

use crate::circuit::Constants;
use crate::readout::Diagnosis;

mod device;
mod refusal;
mod settings;

pub use device::{Identity, Memory, ModelIdentity, Statistics};
pub use refusal::{ConfigurationField, KeepFault, ModelFault, Refusal};
pub use settings::{ConfidenceSent, Configuration, Kept, KeptBaseline, Setting};

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
    /// Result of the readout's self-test.
    Diagnosis(Diagnosis),
    /// A touch, its load or its slip began or ended; sent before the estimate of the scan that shows it.
    Event(EventReport),
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
    /// largest number of f32 if the frame is too far off to compute it. `None` if the model does not estimate it, or it was
    /// not requested.
    pub novelty: Option<f32>,
    /// Standard deviation of every output of this frame before it is filtered, in its unit; NaN if a reading is missing.
    /// Empty if the model does not estimate them, or they were not requested.
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
    /// Events that began or ended.
    pub changed: u8,
    /// Events that are going on.
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

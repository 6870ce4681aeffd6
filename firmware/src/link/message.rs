//! What device and host say to each other.
//!
//! The order of fields and variants is the wire format: to change it is to raise
//! [`PROTOCOL_VERSION`](super::packet::PROTOCOL_VERSION).

use model_core::blob::Floats;
use serde::{Deserialize, Serialize};

use crate::readout::ScanSettings;

/// What the host asks for. Every request is answered by one [`Report`] that repeats its number;
/// [`Request::Identify`] and all others may be repeated without harm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Who are you? Answered by [`Report::Identity`].
    Identify,
    /// Answered by [`Report::Statistics`].
    Statistics,
    /// Answered by [`Report::Configuration`].
    Configuration,
    /// Put a configuration in force until the next restart. Answered by [`Report::Configuration`], or
    /// [`Refusal::Configuration`] with the old one still in force.
    Configure(Configuration),
    /// Average the next so many frames as the sensor at rest. Answered by [`Report::Baseline`] when
    /// they have been scanned.
    CaptureBaseline {
        /// From 1.
        frames: u16,
    },
    /// Decode these readings as if they had been scanned, with the faults that a scan would have.
    /// Answered by [`Report::Estimate`].
    Decode {
        /// Number of the frame, repeated in the answer.
        frame: u32,
        /// `rows × columns` readings in Ω, row after row; NaN is missing.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// A step in the exchange of the model. Answered by [`Report::Upload`].
    Upload(#[serde(borrow)] UploadStep<'a>),
    /// Start anew, as after power-on. Answered by [`Report::Restarting`].
    Restart,
}

/// Steps in the exchange of the model, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UploadStep<'a> {
    /// Erase the spare slot for a blob of so many bytes. Takes up to seconds on a board.
    Begin {
        /// Of the whole blob.
        length: u32,
    },
    /// The next bytes of the blob.
    Chunk {
        /// Where they belong; what was received already is passed over.
        offset: u32,
        /// A multiple of four, but for the last chunk.
        #[serde(borrow)]
        bytes: &'a [u8],
    },
    /// Check the blob from end to end, and put it in force if it is sound.
    Commit,
    /// Forget what was received.
    Abort,
}

/// What the device says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Report<'a> {
    /// Who the device is, and which model is in force.
    Identity(#[serde(borrow)] Identity<'a>),
    /// What has happened since the start.
    Statistics(Statistics),
    /// The configuration in force.
    Configuration(Configuration),
    /// The sensor at rest.
    Baseline {
        /// Mean readings in Ω, row after row; NaN where one was missing.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// One scan, before faulty readings are taken out.
    Readings {
        /// Number of the frame, from 1 at the start.
        frame: u32,
        /// In Ω, row after row.
        #[serde(borrow)]
        readings_ohm: Floats<'a>,
    },
    /// One estimate.
    Estimate(#[serde(borrow)] EstimateReport<'a>),
    /// Faults in the readings of one frame; sent for every frame that has some.
    Health(#[serde(borrow)] HealthReport<'a>),
    /// How far the exchange of the model is.
    Upload(UploadState),
    /// The device will start anew now.
    Restarting,
    /// The request was not carried out; all is as it was.
    Refused(Refusal),
}

/// Who the device is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// Name of the board.
    pub board: &'a str,
    /// Version of the firmware.
    pub firmware: &'a str,
    /// Row-wires.
    pub rows: u8,
    /// Column-wires: readings a row.
    pub columns: u8,
    /// Outputs a row.
    pub outputs: u8,
    /// Name of the exponential that activations are computed with
    /// ([`ExpKernel::NAME`](model_core::exp::ExpKernel::NAME)).
    pub kernel: &'a str,
    /// The model in force.
    pub model: Option<ModelIdentity>,
    /// Bytes of blob that a slot holds.
    pub slot_bytes: u32,
    /// Most bytes of one chunk of an upload, a multiple of four.
    pub chunk_bytes: u16,
    /// Where flash and RAM go.
    pub memory: Memory,
}

/// Which model is in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelIdentity {
    /// CRC-32 that closes its blob.
    pub crc_32: u32,
    /// Slot it lies in, 0 or 1.
    pub slot: u8,
    /// Models committed to this device before it, and it: 0 if it was not uploaded.
    pub generation: u32,
}

/// Where a device's memory goes, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Memory {
    /// Flash: vector table.
    pub vector_table: u32,
    /// Flash: code.
    pub text: u32,
    /// Flash: constants.
    pub rodata: u32,
    /// RAM, and as much flash to start it from: variables that start with a value.
    pub data: u32,
    /// RAM: variables that start as zero.
    pub bss: u32,
    /// RAM: never initialised.
    pub uninit: u32,
    /// RAM: kept for the stack.
    pub stack_reserved: u32,
    /// RAM: deepest that the stack has been since the start.
    pub stack_high_water: u32,
}

impl Memory {
    /// Flash that the firmware takes, without models.
    #[must_use]
    pub fn flash_bytes(&self) -> u32 {
        let parts = [self.vector_table, self.text, self.rodata, self.data];
        parts.into_iter().fold(0, u32::saturating_add)
    }

    /// RAM that it takes, with the stack at its deepest so far.
    #[must_use]
    pub fn ram_bytes(&self) -> u32 {
        let parts = [self.data, self.bss, self.uninit, self.stack_high_water];
        parts.into_iter().fold(0, u32::saturating_add)
    }
}

/// What can be chosen while the device runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// Time from one scan to the next in µs; 0 scans never.
    pub frame_period_us: u32,
    /// How each scan is made.
    pub scan: ScanSettings,
    /// Whether every scan's readings are sent.
    pub send_readings: bool,
    /// Whether every scan's estimate is sent.
    pub send_estimates: bool,
    /// A reading below this in Ω is taken for a short circuit.
    pub shorted_below_ohm: f32,
    /// A reading above this in Ω is taken for a broken wire.
    pub open_above_ohm: f32,
    /// Relative change against the baseline from which [`EstimateReport::CONTACT`] is told.
    pub contact_threshold: f32,
    /// Relative change against the baseline within which readings are at rest; a row of such readings,
    /// whose sum is likewise, is not decoded but answered as the baseline ([`model_core::gate`]). 0
    /// decodes every row, as does a device without a baseline.
    pub rest_tolerance: f32,
}

/// Outputs of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EstimateReport<'a> {
    /// Number of the frame.
    pub frame: u32,
    /// Sum of the flags below.
    pub flags: u8,
    /// One byte a row: 0 decoded, 1 a reading missing, 2 overflow, 3 at rest.
    pub row_status: &'a [u8],
    /// `rows × outputs` numbers in the units of the model's outputs, NaN where a row is not decoded.
    #[serde(borrow)]
    pub outputs: Floats<'a>,
}

impl EstimateReport<'_> {
    /// Status of a row at rest: its outputs are those of the baseline.
    pub const ROW_AT_REST: u8 = 3;
    /// No model is in force: no row is decoded.
    pub const NO_MODEL: u8 = 1;
    /// Some reading is missing, shorted or open.
    pub const FAULTY_READING: u8 = 1 << 1;
    /// Some output overflowed.
    pub const OVERFLOW: u8 = 1 << 2;
    /// At least one frame before this one could not be scanned in time.
    pub const OVERRUN: u8 = 1 << 3;
    /// A baseline was captured, and some reading differs from it by more than the threshold.
    pub const CONTACT: u8 = 1 << 4;
}

/// Faults of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HealthReport<'a> {
    /// Number of the frame.
    pub frame: u32,
    /// Readings not taken.
    pub missing: u16,
    /// Readings below the limit.
    pub shorted: u16,
    /// Readings above the limit.
    pub open: u16,
    /// Four bytes a row, little-endian: bit k is column k.
    pub faulty_columns: &'a [u8],
}

/// Counters since the start; each stops at its largest value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Statistics {
    /// Frames scanned.
    pub frames_scanned: u32,
    /// Frames decoded, on request or scanned.
    pub frames_decoded: u32,
    /// Rows of these that were at rest, and so took no inference.
    pub rows_at_rest: u32,
    /// Frames that could not be scanned in time.
    pub frames_missed: u32,
    /// Samples that the converter did not give.
    pub failed_samples: u32,
    /// Requests answered.
    pub requests: u32,
    /// Frames of bytes that were damaged, cut, too long or not of this protocol.
    pub bad_packets: u32,
    /// Reports that the host did not take in time.
    pub lost_reports: u32,
    /// Loops that did not feed the watchdog.
    pub bad_loops: u32,
    /// Longest scan in µs.
    pub longest_scan_us: u32,
    /// Longest decoding of one frame in µs.
    pub longest_decode_us: u32,
}

/// How far the exchange of the model is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UploadState {
    /// None is going on.
    Idle,
    /// The spare slot takes bytes.
    Receiving {
        /// Bytes received from the start without a gap: where to go on.
        received: u32,
    },
    /// The blob is sound and in force.
    Committed {
        /// Its CRC-32.
        crc_32: u32,
    },
}

/// Why a request was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The device speaks another version of the protocol: its own.
    Version(u8),
    /// The request is not one of this protocol.
    Unknown,
    /// A frame must have `rows × columns` readings.
    FrameLength {
        /// Readings that it must have.
        expected: u16,
    },
    /// A field of a configuration is out of range.
    Configuration(ConfigurationField),
    /// A baseline of no frames, or while nothing is scanned; or another was asked for meanwhile.
    Baseline,
    /// The blob does not fit into a slot.
    TooLarge {
        /// Bytes that fit.
        slot_bytes: u32,
    },
    /// A chunk or a commit without a beginning.
    NoUpload,
    /// A chunk that leaves a gap, is not a multiple of four, or goes beyond the announced length; or a
    /// commit before all was received.
    OutOfPlace {
        /// Bytes received from the start without a gap: where to go on.
        received: u32,
    },
    /// The blob is unsound or of another shape. The upload is over.
    BadModel(ModelFault),
    /// The flash could not be erased or written. The upload is over.
    Flash,
}

/// Fields of [`Configuration`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ConfigurationField {
    /// 0, or from 100 µs to 1000 s.
    FramePeriod,
    /// At most 10 ms.
    Settling,
    /// From 1 to 256.
    Oversampling,
    /// Positive, finite, and below the other.
    Limits,
    /// Positive and finite.
    ContactThreshold,
    /// From 0, and below 1.
    RestTolerance,
}

/// What is wrong with an uploaded blob; the host's `inspect` tells more of the file itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelFault {
    /// It does not open as a blob, or is of another version.
    NotABlob,
    /// Its length is not the announced one.
    Length,
    /// Its CRC-32 does not match.
    Corrupt,
    /// Sound by its CRC, but a field or a number is not acceptable.
    Invalid,
    /// It is for a sensor of another shape.
    Shape,
}

//! Why a device does not carry out a request.

use serde::{Deserialize, Serialize};

use crate::circuit::ConstantsFault;

/// Why a request was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The device speaks another version of the protocol, which is given here.
    Version(u8),
    /// The request is not one of this protocol, or its chunk is longer than the identity allows.
    Unknown,
    /// The frame does not have as many readings as are scanned for the model in force.
    FrameLength {
        /// Number of readings that it must have.
        expected: u16,
    },
    /// A field of a configuration is out of range.
    Configuration(ConfigurationField),
    /// The baseline cannot be captured: it has no frames, nothing is scanned, or another was requested meanwhile.
    Baseline,
    /// The blob does not fit into a slot.
    TooLarge {
        /// Largest blob that fits, in bytes.
        slot_bytes: u32,
    },
    /// A chunk or a trial was requested without a begin, or a confirmation without a trial.
    NoUpload,
    /// A chunk leaves a gap, is not a multiple of four, or goes beyond the announced length; or a trial was requested
    /// before all bytes were received.
    OutOfPlace {
        /// Number of bytes received from the start without a gap: the offset of the next chunk.
        received: u32,
    },
    /// The blob is unsound or of another shape. The upload is over.
    BadModel(ModelFault),
    /// The flash could not be erased or written. If it was for an upload, the upload is over.
    Flash,
    /// The circuit has no constants, or cannot take these.
    Constants(ConstantsFault),
    /// The setting, or another model, cannot be kept.
    Keep(KeepFault),
    /// The flash was erased too often ([`erase_interval_s`](crate::store::Slot::erase_interval_s)).
    TooSoon {
        /// Time in µs until it may be erased again.
        wait_us: u64,
    },
    /// There is no model in force, or the spare slot holds no previous one.
    NothingToUndo,
    /// A model is on trial: it must be confirmed or aborted first.
    OnTrial,
    /// The model was not confirmed in time: the previous one is in force again.
    TrialOver,
}

/// Why a setting cannot be kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeepFault {
    /// There is none: no baseline was captured, or the circuit has no constants.
    Nothing,
    /// It is too large for the device's memory.
    TooLarge,
    /// Settings and undos were written too often since the start; a restart allows more.
    TooOften,
}

/// A field of [`Configuration`](super::Configuration) that can be out of range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ConfigurationField {
    /// The frame period: 0, or from 100 µs to 1000 s.
    FramePeriod,
    /// The settling time: at most 5 ms.
    Settling,
    /// The oversampling: from 1 to 256.
    Oversampling,
    /// The limits of readings: the lower one below the upper one. An infinite one is none.
    Limits,
    /// The threshold for contact: positive and finite.
    ContactThreshold,
    /// The filter's time constant: at most 1 s.
    FilterTimeConstant,
    /// The filter's lead: at most 1 s.
    FilterLead,
    /// The number of scans of which one is reported: at least 1.
    ReportEvery,
    /// The threshold for load: not negative, and finite.
    LoadThreshold,
    /// The speed of a slip: not negative, and finite.
    Slip,
}

/// Fault of an uploaded blob; `taxel inspect` shows more about the file itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelFault {
    /// The bytes do not start as a blob does, or the blob is of another version.
    NotABlob,
    /// The blob's length is not the announced one.
    Length,
    /// The blob's CRC-32 does not match.
    Corrupt,
    /// The CRC-32 matches, but a field or a number is not acceptable.
    Invalid,
    /// The device has no room for a model of this shape.
    Shape,
    /// The board lacks wires that the names of the inputs say, or their order is unknown.
    Wires,
}

//! Errors of a device or an emulator, as values that a program can match.

use std::time::Duration;

use taxel_core::blob::Model;
use taxel_core::filter::Settings;
use taxel_firmware::capacity::Capacity;
use taxel_firmware::circuit::ConstantsFault;
use taxel_firmware::link::message::{
    Configuration, ConfigurationField, KeepFault, ModelFault, Refusal,
};
use taxel_firmware::link::packet::PROTOCOL_VERSION;
use taxel_firmware::readout::ScanSettings;

use crate::image;

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What a device sends instead of an answer, and what to do about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Heard {
    /// Nothing at all.
    #[default]
    Nothing,
    /// Bytes that are no packets.
    Noise,
    /// Reports, but no answer.
    Reports,
    /// Packets of another version of the link.
    OtherVersion(u8),
    /// Packets of this version, with messages that this program does not know.
    UnknownMessage,
}

impl std::fmt::Display for Heard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Nothing => f.write_str(
                "it sends nothing: check that it runs this project's firmware, and the speed of its line",
            ),
            Self::Noise => f.write_str(
                "it sends bytes that are not packets: check the speed of its line (--baud), and that it runs this \
                 project's firmware",
            ),
            Self::Reports => f.write_str(
                "it sends reports, but no answer in time: check that no other program uses it, and the speed of its line",
            ),
            Self::OtherVersion(version) => write!(
                f,
                "it speaks version {version} of the link, and this program version {PROTOCOL_VERSION}: flash the \
                 firmware that belongs to this program"
            ),
            Self::UnknownMessage => f.write_str(
                "it sends messages that this program does not know: flash the firmware that belongs to this program",
            ),
        }
    }
}

/// Failure to reach a device, to make it do something, or to start an emulator.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Failure of the line.
    #[error("the line to the device failed: {0}")]
    Line(#[from] std::io::Error),
    /// Line that the other end closed.
    #[error("the device closed the line")]
    Closed,
    /// Work that somebody ended.
    #[error("interrupted; the device returns to its stored configuration")]
    Interrupted,
    /// Device that does not answer.
    #[error("the device does not answer ({attempts} attempts, {} ms each); {heard}", timeout.as_millis())]
    NoAnswer {
        /// Number of times that it was asked.
        attempts: u32,
        /// Longest time that an answer was waited for.
        timeout: Duration,
        /// What came instead.
        heard: Heard,
    },
    /// Scan that never ended.
    #[error(
        "the device stopped a scan that did not end; part of its readout that stalls: {stalled}; `cargo xtask accept` tests \
         it (docs/board.md)"
    )]
    GivenUp {
        /// The part, as the device found it in a test of itself.
        stalled: &'static str,
    },
    /// Answer that does not belong to the request.
    #[error("the device answers {request} with {answer}")]
    Unexpected { request: String, answer: String },
    /// Request that the device refused.
    #[error("the device refused: {}", why(*.0))]
    Refused(Refusal),
    /// Model that the device says it activated, while another one is active.
    #[error("the device accepted model {committed:08x}, but {in_force} is active")]
    NotInForce {
        /// CRC-32 of the model that it says it activated.
        committed: u32,
        /// Active model, as it reports it.
        in_force: String,
    },
    /// Device that does not decode with a model on trial.
    #[error("the device is back at its previous model: {0}")]
    NotDecoding(String),
    /// Refusal or failure of the crates that compute.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
}

impl Error {
    /// Error for what a device or an emulator does wrong, and the `reason`.
    pub(crate) fn failed(reason: impl Into<String>) -> Self {
        taxel_data::Error::failed(reason).into()
    }

    /// Error for something that cannot be used for the setting `field`, and the `reason`.
    pub(crate) fn unfit_for(field: &'static str, reason: impl Into<String>) -> Self {
        taxel_data::Error::unfit_for(field, reason).into()
    }

    /// Whether the device goes on, and must be told to leave the model that it got.
    pub(crate) fn is_settled_by_abort(&self) -> bool {
        matches!(self, Self::Interrupted | Self::NotDecoding(_) | Self::NotInForce { .. })
    }
}

/// Longest time constant and lead of a filter in ms.
const MOST_FILTER_MS: u32 = Settings::MOST_US / 1000;

/// A field of the configuration in words, its option, and what it may be.
fn configuration_range(field: ConfigurationField) -> String {
    use ConfigurationField as Field;
    match field {
        Field::FramePeriod => {
            let (least, most) = Configuration::FRAME_PERIOD_US.into_inner();
            format!("the time between scans (--period-us: 0, or {least} to {most})")
        }
        Field::Settling => format!(
            "the wait after a change of rows (--settling-us: 0 to {})",
            ScanSettings::MOST_SETTLING_US
        ),
        Field::Oversampling => format!(
            "the number of samples (--oversampling: 1 to {})",
            ScanSettings::MOST_OVERSAMPLING
        ),
        Field::Limits => {
            "a limit of readings (--shorted-below-ohm must be below --open-above-ohm)".into()
        }
        Field::ContactThreshold => {
            "the change that counts as contact (--contact-threshold: above 0)".into()
        }
        Field::FilterTimeConstant => {
            format!("the filter's time constant (--filter-ms: 0 to {MOST_FILTER_MS})")
        }
        Field::FilterLead => format!("the filter's lead (--lead-ms: 0 to {MOST_FILTER_MS})"),
        Field::ReportEvery => "the number of scans per report (--report-every: 1 or above)".into(),
        Field::LoadThreshold => "the load of an event (--load-threshold: 0 or above)".into(),
        Field::Slip => "the speed of a slip (--slip-mm-per-s: 0 or above)".into(),
    }
}

/// Reason of a refusal, in words.
fn why(refusal: Refusal) -> String {
    match refusal {
        Refusal::Version(version) => format!("it speaks version {version} of the protocol"),
        Refusal::Unknown => "it does not know the request".into(),
        Refusal::FrameLength { expected } => format!("a frame of it has {expected} readings"),
        Refusal::Configuration(field) => format!("{} is out of range", configuration_range(field)),
        Refusal::Baseline => "it scans nothing, or another baseline was requested".into(),
        Refusal::TooLarge { slot_bytes } => format!("a model may have {slot_bytes} bytes at most"),
        Refusal::NoUpload => "no upload has begun, or no model is on trial".into(),
        Refusal::OutOfPlace { received } => format!("it has {received} bytes of the upload so far"),
        Refusal::BadModel(ModelFault::Shape) => "it has no room for a model of this shape".into(),
        Refusal::BadModel(ModelFault::Wires) => {
            "its board lacks wires that the model's inputs name; `inspect` names the first".into()
        }
        Refusal::BadModel(fault) => {
            format!("the model is faulty ({fault:?}), or of another version than the device's program: if `inspect` finds nothing, flash the \
                 program again (docs/board.md)")
        }
        Refusal::Flash => "its flash could not be written".into(),
        Refusal::Constants(ConstantsFault::Fixed) => "its circuit's constants are fixed".into(),
        Refusal::Constants(ConstantsFault::Length) => {
            "its circuit has another number of rows or columns".into()
        }
        Refusal::Constants(fault) => format!("{fault:?} of the constants is out of range"),
        Refusal::Keep(KeepFault::Nothing) => {
            "it has nothing of that kind to keep; capture a baseline first".into()
        }
        Refusal::Keep(KeepFault::TooLarge) => "it has no room to keep that".into(),
        Refusal::Keep(KeepFault::TooOften) => {
            "settings or undos were written too often since its start, which wears its flash; restart it to continue".into()
        }
        Refusal::TooSoon { wait_us } => format!(
            "its flash was erased too often; upload again in {} s",
            wait_us.div_ceil(1_000_000)
        ),
        Refusal::NothingToUndo => {
            "it has no previous model; upload the model".into()
        }
        Refusal::OnTrial => "its model is on trial; `confirm` or `undo` it first".into(),
        Refusal::TrialOver => {
            "the model was not confirmed in time, and the previous one is active again; upload it once more".into()
        }
    }
}

/// Checks that a device of this `capacity` has room for `model`, and its board the wires of all inputs.
pub(crate) fn check_room(capacity: Capacity, model: &Model<'_>) -> Result<()> {
    image::needed(model, capacity).map_or(Ok(()), |needed| Err(no_room(capacity, &needed)))
}

/// Error for a model that a device of this `capacity` cannot decode, and `why` or what to do.
pub(crate) fn no_room(capacity: Capacity, why: &str) -> Error {
    let Capacity { rows, columns, outputs } = capacity;
    let has =
        format!("the device has room for {rows} rows of {columns} readings and {outputs} outputs");
    Error::unfit_for("", format!("{has}, and cannot decode the model: {why}"))
}

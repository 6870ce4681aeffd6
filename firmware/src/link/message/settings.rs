//! Settings of a device, and those that it keeps.

use serde::{Deserialize, Serialize};

use crate::readout::ScanSettings;

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
    /// Parts of the model's confidence that are computed for every scan, and sent with its estimate.
    pub confidence: ConfidenceSent,
    /// A reading below this in Ω counts as a short circuit.
    pub shorted_below_ohm: f32,
    /// A reading above this in Ω counts as a broken wire.
    pub open_above_ohm: f32,
    /// Smallest relative change against the baseline that sets [`EstimateReport::CONTACT`](super::EstimateReport::CONTACT).
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
    /// Load at which its [event](taxel_core::events) begins, in the model's unit: of the force, of a tracked contact's depth, or
    /// else of the largest output. With 0, none begins.
    pub load_threshold: f32,
    /// Speed in mm/s of a tracked contact's place at which a slip begins; with 0, none begins.
    pub slip_mm_per_s: f32,
}

/// Parts of a model's confidence that are sent, by its [reading model](taxel_core::reading_model), with the estimate of a scan. An answer to
/// [`Request::Decode`](super::Request::Decode) has all of it.
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

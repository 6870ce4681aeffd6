//! How a frame is scanned.

use model_core::Frame;
use serde::{Deserialize, Serialize};

mod baseline;

pub use baseline::Baseline;

/// How each scan is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScanSettings {
    /// Wait after a row is driven, in µs.
    pub settling_us: u32,
    /// Samples that are averaged to one reading.
    pub oversampling: u16,
}

/// What became of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ScanReport {
    /// Samples that could not be taken; their readings are missing.
    pub failed_samples: u16,
}

/// Gives frames, one at a time.
pub trait FrameSource<const ROWS: usize, const COLS: usize> {
    /// Scans one frame. Readings that cannot be taken are NaN.
    fn scan(&mut self, settings: ScanSettings, frame: &mut Frame<ROWS, COLS>) -> ScanReport;
}

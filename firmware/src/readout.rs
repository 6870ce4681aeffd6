//! Reading a frame: rows are driven one after the other, and every column is sampled.
//!
//! A board picks a [`RowDrive`] and a [`ColumnSampler`], such as [`ShiftRegister595`] and [`Mcp3208s`] over embedded-hal
//! 1.0; [`Scanner`] makes a [`FrameSource`] of them. Hardware that scans by itself is a [`Sequencer`], for
//! [`PassScanner`]. A scan never fails as a whole: a reading that could not be taken is NaN, and counted.
//!
//! `docs/board.md` has the circuit, its parts and the timing.

use serde::{Deserialize, Serialize};
use taxel_core::{ColumnWire, ColumnWires, RowWire};

use crate::circuit::{Constants, ConstantsFault};

mod baseline;
mod rows;
mod columns;
mod diagnosis;
mod scanner;
mod passes;
#[cfg(test)]
mod tests;

pub use baseline::Baseline;
pub use columns::{Mcp3208s, SampleError};
pub use diagnosis::{Diagnosis, PINS};
pub use passes::{PassScanner, Sequencer, SequencerFault, add_samples};
pub use rows::{DriveError, ShiftRegister595};
pub use scanner::Scanner;

/// Selects the row-wire that is active; all others idle.
pub trait RowDrive {
    /// Error of a pin or bus.
    type Error;

    /// Makes `row` the only active row.
    ///
    /// # Errors
    /// The row is not wired, or a pin or bus failed; which row is active is then unknown.
    fn drive(&mut self, row: RowWire) -> Result<(), Self::Error>;

    /// Lets all rows idle.
    ///
    /// # Errors
    /// A pin or bus failed; which row is active is then unknown.
    fn release(&mut self) -> Result<(), Self::Error>;
}

/// Samples the voltage of one column.
pub trait ColumnSampler {
    /// Error of a pin, bus or converter.
    type Error;

    /// The converter's largest count.
    const FULL_SCALE_COUNTS: u16;

    /// Takes one sample of `column`, in counts.
    ///
    /// # Errors
    /// The column is not wired, or a pin, bus or converter failed.
    fn sample(&mut self, column: ColumnWire) -> Result<u16, Self::Error>;
}

/// Settings of a scan. They may come from the host: a value out of range is replaced by the nearest one within.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScanSettings {
    /// Waiting time in µs after every change of the rows, up to [`MOST_SETTLING_US`](Self::MOST_SETTLING_US).
    pub settling_us: u32,
    /// Number of samples averaged for a reading, from 1 to [`MOST_OVERSAMPLING`](Self::MOST_OVERSAMPLING).
    pub oversampling: u16,
}

impl ScanSettings {
    /// Longest waiting time for a row in µs, so that no scan can hang.
    pub const MOST_SETTLING_US: u32 = 5_000;
    /// Largest number of samples averaged for a reading.
    pub const MOST_OVERSAMPLING: u16 = 256;

    /// Replaces values out of range by the nearest ones within.
    #[must_use]
    pub fn clamped(self) -> Self {
        Self {
            settling_us: self.settling_us.min(Self::MOST_SETTLING_US),
            oversampling: self.oversampling.clamp(1, Self::MOST_OVERSAMPLING),
        }
    }
}

/// Longest time in µs for which a scan may go on by itself; then it has failed. No setting makes one as long, and a
/// watchdog waits longer.
pub const LONGEST_SCAN_US: u64 = 2_000_000;

/// Number of scans between two in which columns are sampled idle.
pub const SCANS_A_ROUND: u8 = 16;

/// When the rows of a scan are read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RowTimes {
    /// Time in µs from the scan's start to the middle of the first row's readings.
    pub first_us: f32,
    /// Time in µs from one row to the next.
    pub step_us: f32,
}

/// Report on a scan.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScanReport {
    /// When rows were read; zeros if the source does not know.
    pub row_times: RowTimes,
    /// Number of samples that could not be taken, those of idle rows included. A failed release of the rows
    /// counts as one.
    pub failed_samples: u16,
}

impl ScanReport {
    /// Makes every reading of `frame` a failed one.
    pub(crate) fn of_failed(frame: &mut [f32]) -> Self {
        frame.fill(f32::NAN);
        let failed_samples = u16::try_from(frame.len()).unwrap_or(u16::MAX);
        Self { failed_samples, ..Self::default() }
    }
}

/// Wires that a scan reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Selection<'a> {
    /// Row-wires, in the order in which they are read and stand in a frame.
    pub rows: &'a [RowWire],
    /// Column-wires that are read, in ascending order.
    pub columns: ColumnWires,
}

/// A source that waits while it scans.
pub trait WaitingSource {
    /// Scans `wires` into `frame`, and waits for the end: one reading in Ω for each row and column, row after row.
    /// Readings that could not be taken become NaN.
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport;
}

/// A source whose hardware scans by itself: the application takes and decodes a frame while the next one is scanned.
pub trait RunningSource {
    /// Starts a scan of `wires`.
    fn start(&mut self, settings: ScanSettings, wires: Selection<'_>);

    /// Whether the scan that was started has ended. Then the next one may be started before the frame is taken.
    fn poll(&mut self) -> bool;

    /// Fills `frame` as [`WaitingSource::scan`] does with the scan that ended last. It is taken once, and before the source
    /// is looked at again.
    fn take(&mut self, frame: &mut [f32]) -> ScanReport;

    /// Gives up the scan that was started, if there is one: rows idle, and nothing of it gets into another frame.
    fn stop(&mut self);
}

/// How a source scans.
pub enum Scanning<'s> {
    /// It waits for the end of each scan.
    Waits(&'s mut dyn WaitingSource),
    /// It scans by itself.
    Runs(&'s mut dyn RunningSource),
}

/// Source of frames: a scanned sensor, or a substitute for one.
pub trait FrameSource {
    /// How it scans: always in the same way.
    fn scanning(&mut self) -> Scanning<'_>;

    /// Tests itself, which takes milliseconds, and gives up a scan under way. `None` if it cannot.
    fn diagnose(&mut self) -> Option<Diagnosis> {
        None
    }

    /// The circuit's constants, if there are any that can be asked for.
    fn constants(&self) -> Option<Constants<'_>> {
        None
    }

    /// Replaces the circuit's constants.
    ///
    /// # Errors
    /// [`ConstantsFault`], which leaves the constants as they were.
    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        let _ = constants;
        Err(ConstantsFault::Fixed)
    }
}

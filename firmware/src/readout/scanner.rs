//! The scan itself: the same sequence for every drive, sampler and circuit.

use embedded_hal::delay::DelayNs;
use model_core::{ColumnWire, Frame, RowWire};

use super::{ColumnSampler, FrameSource, RowDrive, ScanReport, ScanSettings};
use crate::circuit::Circuit;

/// Scanner of a sensor, made of a row drive, a column sampler, a delay and a circuit.
///
/// It releases all rows and, if the circuit needs it, samples every column idle. Then it drives row by row, waits
/// until the row has settled, samples every column and converts the counts. It releases the rows, and corrects the
/// whole frame. The rows are released at the end even if something failed. RAM: its parts, and three numbers a
/// column on the stack.
#[derive(Debug)]
pub struct Scanner<D, S, T, C> {
    /// Selects rows.
    pub drive: D,
    /// Samples columns.
    pub sampler: S,
    /// Waits for a row to settle.
    pub delay: T,
    /// Converts counts to Ω; may be a reference.
    pub circuit: C,
}

impl<D: RowDrive, S: ColumnSampler, T: DelayNs, C> Scanner<D, S, T, C> {
    /// Waits until the row has settled, then samples every column; NaN where that failed.
    fn sample_columns<const COLS: usize>(
        &mut self,
        settings: ScanSettings,
        report: &mut ScanReport,
    ) -> [f32; COLS] {
        self.delay.delay_us(settings.settling_us);
        let mut counts = [f32::NAN; COLS];
        for (column, mean) in counts.iter_mut().enumerate() {
            match self.mean_of_samples(ColumnWire(column), settings.oversampling) {
                Ok(counts) => *mean = counts,
                Err(_) => count_failures(report, 1),
            }
        }
        counts
    }

    fn mean_of_samples(&mut self, column: ColumnWire, samples: u16) -> Result<f32, S::Error> {
        let mut sum = 0_u32; // 256 samples of 16 bits fit
        for _ in 0..samples {
            sum += u32::from(self.sampler.sample(column)?);
        }
        Ok(sum as f32 / f32::from(samples))
    }

    fn release(&mut self, report: &mut ScanReport) -> bool {
        let released = self.drive.release().is_ok();
        count_failures(report, usize::from(!released));
        released
    }
}

fn count_failures(report: &mut ScanReport, failures: usize) {
    let failures = u16::try_from(failures).unwrap_or(u16::MAX);
    report.failed_samples = report.failed_samples.saturating_add(failures);
}

impl<D, S, T, C, const ROWS: usize, const COLS: usize> FrameSource<ROWS, COLS>
    for Scanner<D, S, T, C>
where
    D: RowDrive,
    S: ColumnSampler,
    T: DelayNs,
    C: Circuit<ROWS, COLS>,
{
    fn scan(&mut self, settings: ScanSettings, frame: &mut Frame<ROWS, COLS>) -> ScanReport {
        let settings = settings.clamped();
        let mut report = ScanReport::default();
        let mut idle = [f32::NAN; COLS];
        // Without a valid idle sample the circuit gives NaN.
        if self.release(&mut report) && C::IDLE_SAMPLES {
            idle = self.sample_columns(settings, &mut report);
        }
        for (row, readings) in frame.row_column_resistance_ohm.iter_mut().enumerate() {
            let row = RowWire(row);
            if self.drive.drive(row).is_ok() {
                let sampled = self.sample_columns(settings, &mut report);
                *readings = self.circuit.row_ohm(row, &sampled, &idle, S::FULL_SCALE_COUNTS);
            } else {
                *readings = [f32::NAN; COLS];
                count_failures(&mut report, COLS);
            }
        }
        self.release(&mut report);
        self.circuit.correct(frame);
        report
    }
}

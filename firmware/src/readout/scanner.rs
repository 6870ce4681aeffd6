//! The scan itself: the same sequence for every drive, sampler and circuit.

use embedded_hal::delay::DelayNs;
use model_core::{ColumnWire, RowWire};

use super::{ColumnSampler, FrameSource, RowDrive, ScanReport, ScanSettings, Selection};
use crate::circuit::{Circuit, Constants, ConstantsFault};

/// Scanner of a sensor with at most `COLUMNS` columns, made of a row drive, a column sampler, a delay and a circuit.
///
/// It releases all rows and, if the circuit needs it, samples every column idle. Then it drives row by row, waits
/// until the row has settled, samples every column and converts the counts. It releases the rows, and corrects the
/// whole frame. The rows are released at the end even if something failed. RAM: its parts, and one number a
/// column.
#[derive(Debug)]
pub struct Scanner<D, S, T, C, const COLUMNS: usize> {
    drive: D,
    sampler: S,
    delay: T,
    circuit: C,
    /// Idle counts of each column in the scan that is going on.
    idle: [f32; COLUMNS],
}

impl<D: RowDrive, S: ColumnSampler, T: DelayNs, C: Circuit, const COLUMNS: usize>
    Scanner<D, S, T, C, COLUMNS>
{
    /// Makes a scanner of its parts: `drive` selects rows, `sampler` samples columns, `delay` waits for a row to
    /// settle, and `circuit` converts counts to Ω. The circuit may be a reference.
    pub const fn new(drive: D, sampler: S, delay: T, circuit: C) -> Self {
        Self { drive, sampler, delay, circuit, idle: [f32::NAN; COLUMNS] }
    }

    fn release(&mut self, report: &mut ScanReport) -> bool {
        let released = self.drive.release().is_ok();
        count_failures(report, usize::from(!released));
        released
    }

    /// Samples all columns while all rows idle; without a valid idle sample the circuit gives NaN.
    fn sample_idle(&mut self, settings: ScanSettings, columns: usize, report: &mut ScanReport) {
        self.idle.fill(f32::NAN);
        if self.release(report)
            && C::IDLE_SAMPLES
            && let Some(idle) = self.idle.get_mut(..columns)
        {
            settle(&mut self.delay, settings);
            sample_columns(&mut self.sampler, settings.oversampling, idle, report);
        }
    }

    /// Drives `row` and turns its samples into `readings` in Ω; NaN where that failed.
    fn scan_row(
        &mut self,
        row: RowWire,
        settings: ScanSettings,
        readings: &mut [f32],
        report: &mut ScanReport,
    ) {
        let (Ok(()), Some(idle)) = (self.drive.drive(row), self.idle.get(..readings.len())) else {
            readings.fill(f32::NAN);
            return count_failures(report, readings.len());
        };
        settle(&mut self.delay, settings);
        sample_columns(&mut self.sampler, settings.oversampling, readings, report);
        self.circuit.row_ohm(row, idle, S::FULL_SCALE_COUNTS, readings);
    }
}

/// Waits until voltages have followed a change of the rows.
fn settle(delay: &mut impl DelayNs, settings: ScanSettings) {
    delay.delay_us(settings.settling_us);
}

/// Samples every column, whose mean counts go to `counts`; NaN where that failed.
fn sample_columns<S: ColumnSampler>(
    sampler: &mut S,
    samples: u16,
    counts: &mut [f32],
    report: &mut ScanReport,
) {
    for (column, mean) in counts.iter_mut().enumerate() {
        let counts = mean_of_samples(sampler, ColumnWire(column), samples);
        count_failures(report, usize::from(counts.is_err()));
        *mean = counts.unwrap_or(f32::NAN);
    }
}

fn mean_of_samples<S: ColumnSampler>(
    sampler: &mut S,
    column: ColumnWire,
    samples: u16,
) -> Result<f32, S::Error> {
    let mut sum = 0_u32; // 256 samples of 16 bits fit
    for _ in 0..samples {
        sum += u32::from(sampler.sample(column)?);
    }
    Ok(sum as f32 / f32::from(samples))
}

fn count_failures(report: &mut ScanReport, failures: usize) {
    let failures = u16::try_from(failures).unwrap_or(u16::MAX);
    report.failed_samples = report.failed_samples.saturating_add(failures);
}

impl<D: RowDrive, S: ColumnSampler, T: DelayNs, C: Circuit, const COLUMNS: usize> FrameSource
    for Scanner<D, S, T, C, COLUMNS>
{
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        let settings = settings.clamped();
        let mut report = ScanReport::default();
        self.sample_idle(settings, wires.columns, &mut report);
        for (row, readings) in wires.rows.iter().zip(frame.chunks_mut(wires.columns.max(1))) {
            self.scan_row(*row, settings, readings, &mut report);
        }
        self.release(&mut report);
        self.circuit.correct(wires.columns, frame);
        report
    }

    fn constants(&self) -> Option<Constants<'_>> {
        self.circuit.constants()
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.circuit.set_constants(constants)
    }
}

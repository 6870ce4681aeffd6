//! The scan itself: the same sequence for every drive and sampler.

use embedded_hal::delay::DelayNs;
use taxel_core::{ColumnWire, ColumnWires, RowWire};

use super::{
    ColumnSampler, FrameSource, RowDrive, SCANS_A_ROUND, ScanReport, ScanSettings, Scanning,
    Selection, WaitingSource,
};
use crate::circuit::{Constants, ConstantsFault, ScannedRow, ZeroPotential};

/// Scanner of a sensor with at most `ROWS` rows and `COLUMNS` columns, made of a row drive, a column sampler, a delay
/// and the circuit's constants.
///
/// It drives row by row, waits until the row has settled, samples the columns and converts the counts. It releases the
/// rows, and corrects the whole frame. The rows are released at the end even if something failed.
///
/// A scan measures more once in [`SCANS_A_ROUND`], and when other columns, settings or constants are asked for or a
/// sample has failed. It samples every column with all rows released. And if not all columns are
/// scanned, it samples all of them for one row, in turn, since all of them load the row; in the first scan for every row.
/// RAM: its parts, and a number a row and a column.
#[derive(Debug)]
pub struct Scanner<D, S, T, const ROWS: usize, const COLUMNS: usize> {
    drive: D,
    sampler: S,
    delay: T,
    circuit: ZeroPotential<ROWS, COLUMNS>,
    /// Idle counts of each column.
    idle: [f32; COLUMNS],
    /// Load of each row by columns that are not scanned; NaN if it is not known.
    load: [f32; ROWS],
    /// What these are of.
    columns: ColumnWires,
    settings: ScanSettings,
    /// Number of scans before the next round; 0 begins one.
    scans_left: u8,
    /// Index of the row whose load is measured in the next round.
    next_row: usize,
}

impl<D: RowDrive, S: ColumnSampler, T: DelayNs, const ROWS: usize, const COLUMNS: usize>
    Scanner<D, S, T, ROWS, COLUMNS>
{
    /// Makes a scanner of its parts: `drive` selects rows, `sampler` samples columns, `delay` waits for a row to
    /// settle, and `circuit` converts counts to Ω.
    pub const fn new(
        drive: D,
        sampler: S,
        delay: T,
        circuit: ZeroPotential<ROWS, COLUMNS>,
    ) -> Self {
        Self {
            drive,
            sampler,
            delay,
            circuit,
            idle: [f32::NAN; COLUMNS],
            load: [f32::NAN; ROWS],
            columns: ColumnWires(0),
            settings: ScanSettings { settling_us: 0, oversampling: 0 },
            scans_left: 0,
            next_row: 0,
        }
    }

    /// Forgets what was measured besides frames.
    pub(super) fn restart(&mut self) {
        self.load.fill(f32::NAN);
        self.scans_left = 0;
    }

    fn release(&mut self, report: &mut ScanReport) -> bool {
        let released = self.drive.release().is_ok();
        count_failures(report, usize::from(!released));
        released
    }

    /// Samples all columns while all rows idle; without a valid idle sample the circuit gives NaN.
    fn sample_idle(&mut self, report: &mut ScanReport) {
        self.idle.fill(f32::NAN);
        if self.release(report) {
            settle(&mut self.delay, self.settings);
            let samples = self.settings.oversampling;
            sample_columns(&mut self.sampler, samples, self.columns, &mut self.idle, report);
            sample_others(&mut self.sampler, samples, self.columns, &mut self.idle);
        }
    }

    /// Drives `row` and turns its samples into `readings` in Ω; NaN where that failed. Measures the row's load if it is
    /// its turn, or the load is not known.
    fn scan_row(
        &mut self,
        row: RowWire,
        is_its_turn: bool,
        readings: &mut [f32],
        report: &mut ScanReport,
    ) {
        let (columns, all) = (self.columns, ColumnWires::first(COLUMNS));
        if columns.0 & !all.0 != 0 || self.drive.drive(row).is_err() {
            readings.fill(f32::NAN);
            return count_failures(report, readings.len());
        }
        settle(&mut self.delay, self.settings);
        let mut counts = [f32::NAN; COLUMNS];
        let samples = self.settings.oversampling;
        let scale = self.circuit.scale(S::FULL_SCALE_COUNTS);
        sample_columns(&mut self.sampler, samples, columns, &mut counts, report);
        let mut load = 1.0;
        if let Some(known) = self.load.get_mut(row.0).filter(|_| columns != all) {
            if is_its_turn || known.is_nan() {
                sample_others(&mut self.sampler, samples, columns, &mut counts);
                *known = self.circuit.load(columns, &self.idle, &scale, &counts);
            }
            load = *known;
        }
        let row = ScannedRow { row, columns, load };
        self.circuit.row_ohm(row, &self.idle, &scale, &mut counts);
        for (reading, ohm) in readings.iter_mut().zip(columns.pick(&counts)) {
            *reading = *ohm;
        }
    }
}

/// Waits until voltages have followed a change of the rows.
fn settle(delay: &mut impl DelayNs, settings: ScanSettings) {
    delay.delay_us(settings.settling_us);
}

/// Samples these columns. Their mean counts go to their places in `counts`, of all columns; NaN where that failed.
fn sample_columns<S: ColumnSampler>(
    sampler: &mut S,
    samples: u16,
    columns: ColumnWires,
    counts: &mut [f32],
    report: &mut ScanReport,
) {
    for (column, mean) in columns.pick(counts.iter_mut().enumerate()) {
        let counts = mean_of_samples(sampler, ColumnWire(column), samples);
        count_failures(report, usize::from(counts.is_err()));
        *mean = counts.unwrap_or(f32::NAN);
    }
}

/// Samples all other columns. Nobody asked for them, so that failures are not counted.
fn sample_others<S: ColumnSampler>(
    sampler: &mut S,
    samples: u16,
    columns: ColumnWires,
    counts: &mut [f32],
) {
    let others = ColumnWires(!columns.0);
    sample_columns(sampler, samples, others, counts, &mut ScanReport::default());
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

/// Counts samples that could not be taken.
pub(super) fn count_failures(report: &mut ScanReport, failures: usize) {
    let failures = u16::try_from(failures).unwrap_or(u16::MAX);
    report.failed_samples = report.failed_samples.saturating_add(failures);
}

impl<D: RowDrive, S: ColumnSampler, T: DelayNs, const ROWS: usize, const COLUMNS: usize> FrameSource
    for Scanner<D, S, T, ROWS, COLUMNS>
{
    fn scanning(&mut self) -> Scanning<'_> {
        Scanning::Waits(self)
    }

    fn constants(&self) -> Option<Constants<'_>> {
        Some(self.circuit.constants())
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.restart();
        self.circuit.set_constants(constants)
    }
}

impl<D: RowDrive, S: ColumnSampler, T: DelayNs, const ROWS: usize, const COLUMNS: usize>
    WaitingSource for Scanner<D, S, T, ROWS, COLUMNS>
{
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        let settings = settings.clamped();
        if (self.columns, self.settings) != (wires.columns, settings) {
            (self.columns, self.settings) = (wires.columns, settings);
            self.restart();
        }
        let mut report = ScanReport::default();
        let begins_round = self.scans_left == 0;
        if begins_round {
            self.scans_left = SCANS_A_ROUND;
            self.next_row = if self.next_row < wires.rows.len() { self.next_row } else { 0 };
            self.sample_idle(&mut report);
        }
        let rows = wires.rows.iter().enumerate();
        for ((place, row), readings) in rows.zip(frame.chunks_mut(wires.columns.count().max(1))) {
            let is_its_turn = begins_round && place == self.next_row;
            self.scan_row(*row, is_its_turn, readings, &mut report);
        }
        self.release(&mut report);
        self.circuit.correct(wires.columns, frame);
        self.next_row += usize::from(begins_round);
        self.scans_left = if report.failed_samples == 0 { self.scans_left - 1 } else { 0 };
        report
    }
}

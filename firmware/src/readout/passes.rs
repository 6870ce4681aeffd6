//! A scan that hardware makes by itself: the processor is needed at its start and at its end.

use taxel_core::{ColumnWires, RowWire};

use super::scanner::count_failures;
use super::{
    Diagnosis, FrameSource, RowTimes, RunningSource, SCANS_A_ROUND, ScanReport, ScanSettings,
    Scanning, Selection,
};
use crate::circuit::{Constants, ConstantsFault, ScannedRow, ZeroPotential};

/// Hardware that drives rows one after the other and samples all `COLUMNS` columns by itself: a *pass*.
pub trait Sequencer<const COLUMNS: usize> {
    /// The converter's largest count.
    const FULL_SCALE_COUNTS: u16;

    /// Most samples of each reading in a pass.
    const MOST_SAMPLES: u16;

    /// Starts a pass: drives `rows` one after the other, or lets all idle for `None`. Waits `settling_us` each time, and takes
    /// so many `samples` of every column. A row that is not wired idles.
    fn start(&mut self, rows: &[Option<RowWire>], settling_us: u32, samples: u16);

    /// Ends the pass once all rows idle again: adds its samples to `sums`, a line for each of its rows. `None` while it goes
    /// on.
    fn poll(&mut self, sums: &mut [[u32; COLUMNS]]) -> Option<Result<(), SequencerFault>>;

    /// Gives up the pass, if one goes on: all rows idle.
    fn stop(&mut self);

    /// When so many lines of a scan are read, all passes together.
    fn line_times(&self, lines: usize, settings: ScanSettings) -> RowTimes;

    /// Tests itself, and gives up the pass, if one goes on. `None` if it cannot.
    fn diagnose(&mut self) -> Option<Diagnosis> {
        None
    }
}

/// A pass of which samples were lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SequencerFault;

/// Scanner of a sensor by a [`Sequencer`] and the circuit's constants. `LINES` is one more than `ROWS`, the largest number
/// of rows.
///
/// All columns are sampled, and those asked for are picked. The first scan, every one in [`SCANS_A_ROUND`] from there on, and
/// the one behind a failure, other settings or constants begins with a line in which all rows idle. More samples than fit into a
/// pass are taken in several.
#[derive(Debug)]
pub struct PassScanner<'m, Q, const ROWS: usize, const LINES: usize, const COLUMNS: usize> {
    sequencer: Q,
    circuit: ZeroPotential<ROWS, COLUMNS>,
    /// Idle counts of each column.
    idle: [f32; COLUMNS],
    /// The scan that was started last, and the one that has ended.
    started: Plan<LINES>,
    ended: Plan<LINES>,
    /// Samples of each line and column, added up.
    sums: &'m mut [[u32; COLUMNS]; LINES],
    /// Whether the sums are those of a scan that has ended.
    has_ended: bool,
    /// Number of samples of a reading behind the pass under way.
    samples_left: u16,
    /// Number of scans before the next round; 0 begins one.
    scans_left: u8,
}

/// What a scan drives and is asked for.
#[derive(Debug, Clone)]
struct Plan<const LINES: usize> {
    /// A row each, or none.
    lines: heapless::Vec<Option<RowWire>, LINES>,
    columns: ColumnWires,
    settings: ScanSettings,
    has_failed: bool,
}

impl<const LINES: usize> Plan<LINES> {
    const NOTHING: Self = Self {
        lines: heapless::Vec::new(),
        columns: ColumnWires(0),
        settings: ScanSettings { settling_us: 0, oversampling: 0 },
        has_failed: true,
    };
}

impl<'m, Q: Sequencer<COLUMNS>, const ROWS: usize, const LINES: usize, const COLUMNS: usize>
    PassScanner<'m, Q, ROWS, LINES, COLUMNS>
{
    /// Makes a scanner of its parts, with memory for sums.
    pub const fn new(
        sequencer: Q,
        circuit: ZeroPotential<ROWS, COLUMNS>,
        sums: &'m mut [[u32; COLUMNS]; LINES],
    ) -> Self {
        Self {
            sequencer,
            circuit,
            idle: [f32::NAN; COLUMNS],
            started: Plan::NOTHING,
            ended: Plan::NOTHING,
            sums,
            has_ended: true,
            samples_left: 0,
            scans_left: 0,
        }
    }

    /// Starts the next pass of the scan.
    fn start_pass(&mut self) {
        let samples = self.samples_left.min(Q::MOST_SAMPLES);
        self.samples_left -= samples;
        let Plan { lines, settings, .. } = &self.started;
        self.sequencer.start(lines, settings.settling_us, samples);
    }

    /// Turns the sums into readings in Ω. Returns how many were taken.
    fn convert(&mut self, frame: &mut [f32]) -> usize {
        let Plan { columns, settings, .. } = self.ended;
        let (samples, all) = (f32::from(settings.oversampling), ColumnWires::first(COLUMNS));
        let lines = self.ended.lines.iter().zip(self.sums.iter());
        let mut readings = frame.chunks_mut(columns.count().max(1));
        let (scale, mut taken) = (self.circuit.scale(Q::FULL_SCALE_COUNTS), 0);
        for (line, sums) in lines {
            let mut counts = [0.0; COLUMNS];
            for (counts, sum) in counts.iter_mut().zip(sums) {
                *counts = *sum as f32 / samples;
            }
            let Some(row) = *line else {
                self.idle = counts;
                continue;
            };
            let row = ScannedRow { row, columns: all, load: 1.0 };
            self.circuit.row_ohm(row, &self.idle, &scale, &mut counts);
            let picked = columns.pick(&counts);
            for (reading, ohm) in readings.next().unwrap_or_default().iter_mut().zip(picked) {
                *reading = *ohm;
                taken += 1;
            }
        }
        self.circuit.correct(columns, frame);
        taken
    }
}

impl<Q: Sequencer<COLUMNS>, const ROWS: usize, const LINES: usize, const COLUMNS: usize> FrameSource
    for PassScanner<'_, Q, ROWS, LINES, COLUMNS>
{
    fn scanning(&mut self) -> Scanning<'_> {
        Scanning::Runs(self)
    }

    fn diagnose(&mut self) -> Option<Diagnosis> {
        self.stop();
        self.sequencer.diagnose()
    }

    fn constants(&self) -> Option<Constants<'_>> {
        Some(self.circuit.constants())
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.scans_left = 0;
        self.circuit.set_constants(constants)
    }
}

impl<Q: Sequencer<COLUMNS>, const ROWS: usize, const LINES: usize, const COLUMNS: usize>
    RunningSource for PassScanner<'_, Q, ROWS, LINES, COLUMNS>
{
    fn start(&mut self, settings: ScanSettings, wires: Selection<'_>) {
        let settings = settings.clamped();
        let plan = &mut self.started;
        if plan.settings != settings {
            self.scans_left = 0;
        }
        (plan.columns, plan.settings, plan.has_failed) = (wires.columns, settings, false);
        let begins_round = self.scans_left == 0;
        let idle = begins_round.then_some(None);
        let lines = idle.into_iter().chain(wires.rows.iter().map(|row| Some(*row)));
        plan.lines.clear();
        for line in lines.take(LINES) {
            let _ = plan.lines.push(line);
        }
        self.scans_left = if begins_round { SCANS_A_ROUND } else { self.scans_left } - 1;
        self.samples_left = settings.oversampling;
        self.start_pass();
    }

    fn poll(&mut self) -> bool {
        if self.has_ended {
            self.sums.as_flattened_mut().fill(0);
            self.has_ended = false;
        }
        let sums = self.sums.get_mut(..self.started.lines.len()).unwrap_or_default();
        let Some(outcome) = self.sequencer.poll(sums) else { return false };
        if outcome.is_ok() && self.samples_left > 0 {
            self.start_pass();
            return false;
        }
        self.started.has_failed = outcome.is_err();
        (self.ended, self.has_ended) = (self.started.clone(), true);
        if outcome.is_err() {
            self.scans_left = 0;
        }
        true
    }

    fn take(&mut self, frame: &mut [f32]) -> ScanReport {
        if self.ended.has_failed {
            return ScanReport::of_failed(frame);
        }
        frame.fill(f32::NAN); // rows and columns that are not wired
        let taken = self.convert(frame);
        let Plan { lines, settings, .. } = &self.ended;
        let mut row_times = self.sequencer.line_times(lines.len(), *settings);
        if lines.first() == Some(&None) {
            row_times.first_us += row_times.step_us;
        }
        let mut report = ScanReport { row_times, ..ScanReport::default() };
        count_failures(&mut report, frame.len().saturating_sub(taken));
        report
    }

    fn stop(&mut self) {
        self.sequencer.stop();
        (self.scans_left, self.has_ended) = (0, true);
    }
}

/// Number of columns that are sampled at one trigger: by three converters, three each.
const AT_ONCE: usize = 9;

/// Adds up samples of a pass in the order in which three converters deliver them: for each line and each half of the columns
/// the `samples` of nine columns, which are the first ones of all converters, then their second and third ones. Converter
/// and turn choose a multiplexer, 3·converter + turn. It has two neighbouring columns, one of each half.
pub fn add_samples(delivered: &[u16], samples: u16, sums: &mut [[u32; 2 * AT_ONCE]]) {
    let mut halves = delivered.chunks_exact(AT_ONCE * usize::from(samples.max(1)));
    for sums in sums {
        for is_second in [false, true] {
            // By name and in this order, so that a sum is a register even where code is as small as can be.
            let [mut a, mut b, mut c, mut d, mut e, mut f, mut g, mut h, mut i] = [0; AT_ONCE];
            for counts in halves.next().unwrap_or_default().as_chunks::<AT_ONCE>().0 {
                let [na, nb, nc, nd, ne, nf, ng, nh, ni] = counts;
                (a, b, c) = (a + u32::from(*na), b + u32::from(*nb), c + u32::from(*nc));
                (d, e, f) = (d + u32::from(*nd), e + u32::from(*ne), f + u32::from(*nf));
                (g, h, i) = (g + u32::from(*ng), h + u32::from(*nh), i + u32::from(*ni));
            }
            let by_multiplexer = [a, d, g, b, e, h, c, f, i];
            for (pair, nine) in sums.as_chunks_mut::<2>().0.iter_mut().zip(by_multiplexer) {
                let [first, second] = pair;
                *if is_second { second } else { first } += nine;
            }
        }
    }
}

#[cfg(test)]
mod tests;

//! Lines of a log at which nothing touches the sensor, and the baseline that they make.

use crate::columns;
use crate::data_file::DataFile;
use crate::table::Table;

/// Lines at rest whose mean is the baseline: as many as the untouched frames that a device averages.
pub const BASELINE_LINES: usize = 100;
/// Share of its largest values within which an output counts as zero.
const ZERO: f64 = 0.01;
/// Share of its largest values up to which an output's zero may be off, as that of a scale is that was not tared.
const MOST_OFFSET: f64 = 0.05;
/// One of so many values may be an outlier, and three in any case: the largest one that counts is the next.
const WRONG_ONE_IN: usize = 200;
/// Fewest lines that are taken for the sensor at rest.
const FEWEST: usize = 10;

/// Units of outputs that are zero while nothing touches the sensor.
const LOADS: [&str; 16] = [
    "N", "mN", "kN", "N·m", "N·mm", "mN·m", "g", "kg", "mg", "Pa", "hPa", "kPa", "MPa", "bar",
    "mbar", "psi",
];
/// How names of such outputs begin if they state no unit.
const LOAD_NAMES: [&str; 7] = ["force", "load", "weight", "pressure", "fx", "fy", "fz"];

/// Whether the output called `name` is zero while nothing touches the sensor: a force, weight or pressure, or how far an
/// electrode is displaced.
pub fn is_zero_at_rest(name: &str) -> bool {
    let unit = columns::unit_of(name);
    let named = || {
        let name = name.to_lowercase();
        LOAD_NAMES.iter().any(|start| name.starts_with(start))
    };
    let displaced = columns::row_of(name).is_some() || name.starts_with("contact_depth");
    LOADS.contains(&unit) || unit == "mm" && displaced || unit.is_empty() && named()
}

/// Lines of `file` (from 0) at which nothing touches the sensor: all of the `columns`, which are zero there, have a
/// value within 1 % of their largest values about their zero, which may be off by 5 %, and so have the lines before and
/// after. Without such neighbours in at least ten lines, lines count by themselves; fewer than ten are none.
pub fn lines_at_rest(file: &DataFile, columns: &[usize]) -> Vec<usize> {
    let zero = are_zero(file, columns);
    let at_rest = |reach: usize| -> Vec<usize> {
        let around = |line: usize| line.saturating_sub(reach)..(line + reach + 1).min(zero.len());
        (0..zero.len()).filter(|line| zero[around(*line)].iter().all(|zero| *zero)).collect()
    };
    let found = [1, 0].into_iter().map(at_rest).find(|lines| lines.len() >= FEWEST);
    found.unwrap_or_default()
}

/// Lines of `file` (from 0) on which all of the `columns` are zero, whatever the lines before and after are. There are none
/// in a file without pauses: with fewer than ten such lines between two others.
pub fn lines_without_load(file: &DataFile, columns: &[usize]) -> Vec<usize> {
    let zero = are_zero(file, columns);
    let between = zero.windows(3).filter(|it| !it.contains(&false)).count();
    (0..zero.len()).filter(|line| between >= FEWEST && zero[*line]).collect()
}

/// Whether all of the `columns` are zero, for each line of `file`.
fn are_zero(file: &DataFile, columns: &[usize]) -> Vec<bool> {
    let zeros: Vec<[f64; 2]> = columns.iter().map(|column| zero_of(file, *column)).collect();
    let are_known = zeros.iter().any(|[_, bound]| *bound != 0.0);
    let is_zero = |line: usize| {
        let mut values = columns.iter().zip(&zeros);
        values.all(|(column, [zero, bound])| (file.value(line, *column) - zero).abs() <= *bound)
    };
    (0..file.lines()).map(|line| are_known && is_zero(line)).collect()
}

/// Zero of a column, and how far from it a value may be that counts as zero: the middle of the most values that lie so close
/// together, among those near 0.
fn zero_of(file: &DataFile, column: usize) -> [f64; 2] {
    let values = (0..file.lines()).map(|line| file.value(line, column));
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    values.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
    let wrong = (values.len() / WRONG_ONE_IN).max(3);
    let largest = values.len().checked_sub(1 + wrong).map_or(0.0, |at| values[at].abs());
    let bound = ZERO * largest;
    values.retain(|value| value.abs() <= MOST_OFFSET * largest);
    values.sort_unstable_by(f64::total_cmp);
    let within = |start: usize| values.partition_point(|it| *it <= values[start] + bound) - start;
    let densest = (0..values.len()).max_by_key(|start| (within(*start), values.len() - start));
    let zero = densest.map_or(0.0, |start| values[start + within(start) / 2]);
    // A true zero is not moved by noise.
    [if zero.abs() <= bound { 0.0 } else { zero }, bound]
}

/// Readings of the untouched sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    pub readings: Table,
    /// Lines of the log (from 0, ascending) that they are from; `None` for frames of a file of their own, which serve all
    /// lines.
    pub lines: Option<Vec<usize>>,
}

impl Rest {
    /// Standard deviation of the noise on each column. Of a log it is told by the differences of successive lines, so that
    /// a drift does not count.
    pub fn noise(&self) -> Vec<f64> {
        let successive = |of_log: &&Vec<usize>| of_log.windows(2).any(|it| it[1] == it[0] + 1);
        let Some(of_log) = self.lines.as_ref().filter(successive) else {
            return self.readings.deviations();
        };
        let mut sums = vec![(0.0, 0.0); self.readings.names.len()];
        let pairs = self.readings.lines().zip(self.readings.lines().skip(1));
        for ((a, b), lines) in pairs.zip(of_log.windows(2)) {
            if lines[1] == lines[0] + 1 {
                for ((sum, count), (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
                    if !(b - a).is_nan() {
                        (*sum, *count) = (*sum + (b - a) * (b - a), *count + 1.0);
                    }
                }
            }
        }
        sums.into_iter().map(|(sum, count): (f64, f64)| (sum / (2.0 * count)).sqrt()).collect()
    }

    /// Baseline of each of these `lines` of the log, or one for all of them. It is the mean of the last 100 lines at rest
    /// before the line, as a device has it that takes a new baseline in every pause. As long as there were fewer, it is the mean
    /// of the first 100. A missing reading does not count; a column without any has the baseline NaN.
    pub fn baselines(&self, lines: &[usize]) -> Table {
        let Some(of_log) = &self.lines else { return self.readings.mean_line() };
        let columns = self.readings.names.len();
        // Sums and numbers of values up to each line, so that every mean takes one difference.
        let mut sums = vec![(0.0, 0_u32); columns];
        for line in self.readings.lines() {
            let last = sums.len() - columns;
            sums.extend_from_within(last..);
            for ((sum, count), value) in sums[last + columns..].iter_mut().zip(line) {
                if !value.is_nan() {
                    (*sum, *count) = (*sum + value, *count + 1);
                }
            }
        }
        let mean = |line: &usize| {
            let before = of_log.partition_point(|rest| rest < line);
            let end = before.max(BASELINE_LINES.min(of_log.len()));
            let start = end.saturating_sub(BASELINE_LINES);
            let [from, to] = [start, end].map(|at| &sums[at * columns..(at + 1) * columns]);
            from.iter().zip(to).map(|((a, before), (b, all))| (b - a) / f64::from(all - before))
        };
        let values = lines.iter().flat_map(mean).collect();
        Table { names: self.readings.names.clone(), values }
    }
}

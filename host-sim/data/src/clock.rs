//! Time in a log: when each line was written, and whether lines resemble their neighbours.

use crate::columns;
use crate::data_file::DataFile;
use crate::error::{Error, Problem, Result};
use crate::table::Table;

/// Names of columns that hold the time, without a unit and in lower case.
const NAMES: [&str; 14] = [
    "time",
    "t",
    "ts",
    "elapsed",
    "uptime",
    "timestamp",
    "time_stamp",
    "stamp",
    "datetime",
    "date_time",
    "clock",
    "zeit",
    "zeitstempel",
    "uhrzeit",
];

/// Names that say their unit, as those of Arduino's clocks do, with its length in seconds.
const COUNTERS: [(&[&str], f64); 3] = [
    (&["seconds", "sec"], 1.0),
    (&["millis", "milliseconds", "ms"], 1e-3),
    (&["micros", "microseconds", "us", "µs"], 1e-6),
];

/// Units of time, with their length in seconds.
const UNITS: [(&str, f64); 5] =
    [("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9), ("min", 60.0)];

/// Least numbers of a clock that counts from 1970, with the length of its unit in seconds: those of September 2001. Beyond
/// five times as much lies another unit's time.
const SINCE_1970: [(f64, f64); 4] = [(1e9, 1.0), (1e12, 1e-3), (1e15, 1e-6), (1e18, 1e-9)];

/// Share of what shuffled lines would change by, below which neighbours are alike.
const ALIKE: f64 = 0.5;

/// Fewest lines that tell whether neighbours are alike.
const FEWEST_LINES: usize = 20;

/// When each line of a log was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// Column with the time; `None` if the log has none, and lines are counted.
    pub column: Option<String>,
    /// Unit of the times: `s` since the first line; "" for a column of which it is not known, and for numbers of lines.
    pub unit: &'static str,
    /// Time of each line of the file; of a log without times the line's number, header included.
    pub at: Vec<f64>,
}

impl Clock {
    /// Clock of `file`: the column called `name`, or one that is called so (`time_s`, `timestamp`) and never decreases, or
    /// the numbers of the lines.
    ///
    /// # Errors
    /// [`Error::File`] for a `name` without a column, and for times that are missing or decrease.
    pub fn of(file: &DataFile, name: Option<&str>) -> Result<Self> {
        if let Some(name) = name {
            let column = file.column(name)?;
            let times = times(file, column);
            if let Some(at) = first_wrong(&times) {
                return Err(Error::file(&file.path, wrong(name, &times, at, file.line_number(at))));
            }
            return Ok(Self::of_column(file, column, times));
        }
        for column in time_columns(file) {
            let times = times(file, column);
            if first_wrong(&times).is_none() && times.first() < times.last() {
                return Ok(Self::of_column(file, column, times));
            }
        }
        let at = (0..file.lines()).map(|line| file.line_number(line) as f64).collect();
        Ok(Self { column: None, unit: "", at })
    }

    /// Why lines are counted though a column is called as times are; `None` if there is no such column, or it tells the time.
    pub fn why_counted(&self, file: &DataFile) -> Option<String> {
        let column = time_columns(file).next().filter(|_| self.column.is_none())?;
        let (name, times) = (&file.header[column], times(file, column));
        Some(match first_wrong(&times) {
            Some(at) => {
                let what =
                    if times[at].is_nan() { "holds no time" } else { "is before the one above" };
                format!("{name} is not used as the time: line {} {what}", file.line_number(at))
            }
            None => format!("{name} is not used as the time: it never changes"),
        })
    }

    fn of_column(file: &DataFile, column: usize, mut at: Vec<f64>) -> Self {
        let name = &file.header[column];
        let first = at.first().copied().unwrap_or(0.0);
        let unit = columns::unit_of(name);
        let (bare, known) = (bare(name), UNITS.iter().find(|(known, _)| *known == unit));
        let counter = || COUNTERS.iter().find(|(names, _)| names.contains(&&*bare));
        let stated = known.map(|it| it.1).or_else(|| Some(counter()?.1));
        let since_1970 =
            || SINCE_1970.iter().find(|(least, _)| (*least..5.0 * least).contains(&first));
        let seconds = stated.or_else(|| since_1970().map(|(_, seconds)| *seconds));
        if let Some(seconds) = seconds {
            at.iter_mut().for_each(|time| *time = (*time - first) * seconds);
        }
        Self { column: Some(name.clone()), unit: if seconds.is_some() { "s" } else { "" }, at }
    }

    /// What lies between two times, in words: `in 9.6 minutes`, or from where to where.
    pub fn span(&self, from: f64, to: f64) -> String {
        match (&self.column, self.unit) {
            (_, "s") if to - from >= 90.0 => format!("in {:.1} minutes", (to - from) / 60.0),
            (_, "s") => format!("in {:.3} s", to - from),
            (Some(column), _) => format!("from {column} {from} to {to}"),
            (None, _) => format!("from line {from} to line {to}"),
        }
    }
}

/// Columns that are called as times are.
fn time_columns(file: &DataFile) -> impl Iterator<Item = usize> {
    let is_time = |name: &str| {
        let (bare, unit) = (bare(name), columns::unit_of(name));
        (NAMES.contains(&bare.as_str())
            || COUNTERS.iter().any(|(names, _)| names.contains(&&*bare)))
            && (unit.is_empty() || UNITS.iter().any(|(known, _)| *known == unit))
    };
    (0..file.header.len()).filter(move |column| is_time(&file.header[*column]))
}

/// A column's `name` without a unit, in lower case.
fn bare(name: &str) -> String {
    columns::without_unit(name).to_lowercase()
}

fn times(file: &DataFile, column: usize) -> Vec<f64> {
    (0..file.lines()).map(|line| file.value(line, column)).collect()
}

/// First line whose time is missing, or before that of the line above.
fn first_wrong(times: &[f64]) -> Option<usize> {
    let mut last = f64::NEG_INFINITY;
    times.iter().position(|time| {
        let is_wrong = time.is_nan() || *time < last;
        last = *time;
        is_wrong
    })
}

/// What is wrong with the time in this `line` of the column called `name`.
fn wrong(name: &str, times: &[f64], at: usize, line: u64) -> Problem {
    let why = match (times[at].is_nan(), at.checked_sub(1)) {
        (false, Some(before)) => {
            format!("{} is earlier than {} before it", times[at], times[before])
        }
        _ => "the time is missing".into(),
    };
    let rule = format!("column {name:?}: {why}; correct the line, or name another column (--time)");
    Problem::MissingValue { line, rule }
}

/// Whether successive lines of `outputs` resemble each other, as those of a log do and those in random order do not: the
/// mean squared difference of neighbours is below half of what it is for shuffled lines, twice the variance (von Neumann,
/// Ann. Math. Stat. 12, 1941), in the mean over the columns.
pub fn neighbours_alike(outputs: &Table) -> bool {
    if outputs.len() < FEWEST_LINES {
        return false;
    }
    let (means, deviations) = (outputs.means(), outputs.deviations());
    let ratio = |column: usize| {
        let values = outputs.lines().map(|line| line[column]).filter(|value| !value.is_nan());
        let values: Vec<f64> = values.collect();
        let squares: f64 = values.iter().map(|value| (value - means[column]).powi(2)).sum();
        let steps: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
        (deviations[column] > 0.0).then(|| steps / (2.0 * squares))
    };
    let ratios: Vec<f64> = (0..outputs.names.len()).filter_map(ratio).collect();
    !ratios.is_empty() && ratios.iter().sum::<f64>() / (ratios.len() as f64) < ALIKE
}

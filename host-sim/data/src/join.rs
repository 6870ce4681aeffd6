//! Two logs joined by time: each line of one with the line of the other whose time stamp is nearest.

use std::fmt;
use std::num::ParseFloatError;
use std::ops::{Add, Sub};
use std::str::FromStr;

use crate::data_file::{DataFile, MOST_EXACT};
use crate::error::{BadValue, Error, Problem, Result, require};

/// Time of a setting. A whole number is held exactly, however large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Time {
    Whole(i64),
    Real(f64),
}

impl Time {
    fn as_f64(self) -> f64 {
        match self {
            Self::Whole(time) => time as f64,
            Self::Real(time) => time,
        }
    }

    /// The same as a whole number; `None` if it is none, or has lost digits.
    fn as_whole(self) -> Option<i128> {
        match self {
            Self::Whole(time) => Some(time.into()),
            Self::Real(time) => whole(time),
        }
    }
}

/// The whole number that an f64 is, if there is one and no other has the same f64.
fn whole(value: f64) -> Option<i128> {
    (value.fract() == 0.0 && value.abs() < MOST_EXACT).then_some(value as i128)
}

impl From<f64> for Time {
    fn from(time: f64) -> Self {
        Self::Real(time)
    }
}

impl FromStr for Time {
    type Err = ParseFloatError;

    fn from_str(text: &str) -> std::result::Result<Self, ParseFloatError> {
        text.parse().map(Self::Whole).or_else(|_| text.parse().map(Self::Real))
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(time) => time.fmt(f),
            Self::Real(time) => time.fmt(f),
        }
    }
}

/// How two logs are joined.
#[derive(Debug, Clone, PartialEq)]
pub struct Join {
    /// Columns with the time stamps of the first and of the second log.
    pub on: [String; 2],
    /// Largest distance of two time stamps that belong together, in their unit.
    pub tolerance: Time,
    /// Time added to the time stamps of the second log before they are compared, in their unit.
    pub lag: Time,
    /// Factor from the unit of the second log's time stamps to the first one's. Without it, logs are refused whose time
    /// stamps seem to count in different units, or of which hardly any line has a partner.
    pub time_factor: Option<f64>,
}

/// Which lines of two logs belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Joined {
    /// Names of the columns: the first log's, then the second's. A name that is there already becomes `b.NAME`.
    pub header: Vec<String>,
    /// Index (from 0) of each line of the first log that found a partner, and the partner's in the second.
    pub pairs: Vec<[usize; 2]>,
    /// Number of lines of the second log that repeat the time stamp of a line before, and are never a partner.
    pub repeated: usize,
    /// Largest distance of two time stamps that were joined, in their unit.
    pub largest_distance: f64,
}

/// Lines of the shorter log are hardly any joined if they are less than one of so many.
const FEW: usize = 50;

/// Lines of a log whose span tells its unit.
const LEAST_STAMPS: usize = 10;

/// Checks that the time stamps of two logs span times of one order: a factor of about a thousand, or of its powers, is
/// that of two units.
fn check_units(stamps: &[Vec<Option<f64>>; 2], logs: [&DataFile; 2]) -> Result<()> {
    let spans = stamps.each_ref().map(|times| {
        let mut times = times.iter().flatten().copied();
        let first = times.next().unwrap_or(0.0);
        times.last().map_or(0.0, |last| last - first)
    });
    if stamps.iter().any(|times| times.len() < LEAST_STAMPS) {
        return Ok(());
    }
    let steps = [0, 1].map(|log| spans[log] / stamps[log].len() as f64);
    // A time is given in s, ms, µs or ns.
    for factor in [1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9] {
        let is_near = |[of_first, of_second]: [f64; 2], most: f64| {
            let ratio = of_first / (of_second * factor);
            ratio.max(1.0 / ratio) < most
        };
        let differs = spans.iter().all(|span| *span > 0.0);
        if differs && (is_near(spans, 1.5) || is_near(spans, 4.0) && is_near(steps, 1.5)) {
            let other = logs[1].path.display().to_string();
            return Err(Error::file(&logs[0].path, Problem::OtherUnit { other, spans, factor }));
        }
    }
    Ok(())
}

impl Join {
    /// Checks tolerance and lag.
    pub fn check(&self) -> std::result::Result<(), BadValue> {
        let is_tolerance = self.tolerance.as_f64().is_finite() && self.tolerance.as_f64() >= 0.0;
        let rule = || "give a time from 0, in the unit of the time stamps".into();
        require(is_tolerance, "tolerance", self.tolerance, rule)?;
        let rule = || "give a time in the unit of the time stamps, negative or not".into();
        require(self.lag.as_f64().is_finite(), "lag", self.lag, rule)?;
        let factor = self.time_factor.unwrap_or(1.0);
        let rule = || "give a number above 0, such as 0.001 for milliseconds beside seconds".into();
        require(factor > 0.0 && factor.is_finite(), "time_factor", factor, rule)
    }

    /// Joins each line of `first` with the line of `second` whose time stamp, plus the lag, is nearest. Of two that are
    /// equally near it takes the earlier one. Lines without a time stamp have no partner.
    ///
    /// If time stamps, or their sum with the lag, may lie beyond ±2^53, such as nanoseconds since 1970, all are compared
    /// as the whole numbers that the text of the files has.
    ///
    /// # Errors
    /// [`Error::File`] for a column of time stamps that is not there, for time stamps that decrease or of which not every
    /// digit is known, and if no line finds a partner. [`Error::Setting`] for a lag of which not every digit is known.
    pub fn join(&self, first: &DataFile, second: &DataFile) -> Result<Joined> {
        let logs = [(first, first.column(&self.on[0])?), (second, second.column(&self.on[1])?)];
        let sizes = logs.iter().flat_map(|(log, column)| log.rows().map(|row| row[*column].abs()));
        let (tolerance, lag) = (self.tolerance.as_f64(), self.lag.as_f64());
        let factor = self.time_factor.unwrap_or(1.0);
        let times = logs.map(|(log, column)| log.rows().map(move |row| row[column]));
        let [times, others] =
            times.map(|times| times.map(|time| Some(time).filter(|it| !it.is_nan())));
        let others = others.map(|time| Some(factor * time?));
        let stamps: [Vec<Option<f64>>; 2] = [times.collect(), others.collect()];
        if self.time_factor.is_none() {
            check_units(&stamps, [first, second])?;
        }
        // With a factor they are no whole numbers anyway.
        let found = if sizes.fold(0.0, f64::max) + lag.abs() < MOST_EXACT || factor != 1.0 {
            // Decimal time stamps are rounded: one that is exactly as far must not be left out for that.
            let rounding = |time: f64| 2.0 * f64::EPSILON * (time.abs() + lag.abs() + tolerance);
            Found::new(logs, stamps, lag, |time, distance| distance <= tolerance + rounding(time))?
                .map(|distance| distance)
        } else {
            let [stamps, others] = logs.map(|(log, column)| whole_numbers(log, column));
            let lag = self.lag.as_whole().ok_or_else(|| {
                let rule = "give a whole number, as for all time stamps and lags beyond 2^53";
                BadValue::new("lag", self.lag, rule)
            })?;
            // The conversion takes the largest number for what is beyond.
            let most = self.tolerance.as_whole().unwrap_or(tolerance.floor() as i128);
            Found::new(logs, [stamps?, others?], lag, |_, distance| distance <= most)?
                .map(|distance| distance as f64)
        };
        let Some(largest_distance) = found.largest_distance else {
            let other = second.path.display().to_string();
            let problem = match found.nearest_distance {
                Some(distance) => Problem::NoPartner { other, tolerance, distance },
                None => Problem::NoTimeStamp { other },
            };
            return Err(Error::file(&first.path, problem));
        };
        let (pairs, lines) = (found.pairs.len(), first.lines().min(second.lines()));
        if self.time_factor.is_none() && pairs < lines / FEW {
            let (other, lines) = (second.path.display().to_string(), first.lines());
            return Err(Error::file(&first.path, Problem::FewPartners { other, pairs, lines }));
        }
        let mut header = first.header.clone();
        for name in &second.header {
            let mut name = name.clone();
            while header.contains(&name) {
                name.insert_str(0, "b.");
            }
            header.push(name);
        }
        Ok(Joined { header, pairs: found.pairs, repeated: found.repeated, largest_distance })
    }
}

/// Lines that belong together, with distances of time stamps in numbers that hold these: f64, or whole ones.
struct Found<T> {
    pairs: Vec<[usize; 2]>,
    repeated: usize,
    /// Largest distance of those that were joined, and smallest of all.
    largest_distance: Option<T>,
    nearest_distance: Option<T>,
}

impl<T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T>> Found<T> {
    /// Joins the lines of two `logs` by their `stamps`, if a time and the distance from it are `near`.
    fn new(
        logs: [(&DataFile, usize); 2],
        stamps: [Vec<Option<T>>; 2],
        lag: T,
        near: impl Fn(T, T) -> bool,
    ) -> Result<Self> {
        for ((log, column), times) in logs.iter().zip(&stamps) {
            check_order(log, *column, times)?;
        }
        let [times, mut others] = stamps.map(|times| {
            let times = times.into_iter().enumerate();
            times.filter_map(|(line, time)| Some((line, time?))).collect::<Vec<_>>()
        });
        let stamped = others.len();
        others.dedup_by_key(|(_, time)| *time); // keeps the first of equal ones
        let repeated = stamped - others.len();
        let mut found =
            Self { pairs: vec![], repeated, largest_distance: None, nearest_distance: None };
        for (line, time) in times {
            let Some((partner, distance)) = nearest(&others, time, lag) else { continue };
            if found.nearest_distance.is_none_or(|nearest| distance < nearest) {
                found.nearest_distance = Some(distance);
            }
            if near(time, distance) {
                if found.largest_distance.is_none_or(|largest| distance > largest) {
                    found.largest_distance = Some(distance);
                }
                found.pairs.push([line, partner]);
            }
        }
        Ok(found)
    }

    /// The same with distances as f64.
    fn map(self, to_f64: impl Fn(T) -> f64) -> Found<f64> {
        let Self { pairs, repeated, largest_distance, nearest_distance } = self;
        let [largest_distance, nearest_distance] =
            [largest_distance, nearest_distance].map(|distance| distance.map(&to_f64));
        Found { pairs, repeated, largest_distance, nearest_distance }
    }
}

/// Time stamps in the `column` of `log`, as whole numbers; `None` where one is missing.
fn whole_numbers(log: &DataFile, column: usize) -> Result<Vec<Option<i128>>> {
    let number = |line: usize| {
        let value = log.value(line, column);
        // An array has no text, and its numbers may have lost digits.
        let exact = log.texts.as_ref().and_then(|_| log.texts(column).ok()?.at(line).parse().ok());
        let exact = exact.map(|number: i64| number.into()).or_else(|| whole(value));
        (!value.is_nan()).then(|| {
            exact.ok_or_else(|| {
                let text = log.texts(column).map(|texts| texts.at(line).into_owned());
                let value = text.unwrap_or_else(|_| value.to_string());
                let (line, column) = (log.line_number(line), log.header[column].clone());
                Error::file(&log.path, Problem::InexactTime { line, column, value })
            })
        })
    };
    (0..log.lines()).map(|line| number(line).transpose()).collect()
}

/// Checks that `times` in the `column` of `log` do not decrease: after a clock was set back, a time stamp tells no longer
/// which line is meant. They may repeat.
fn check_order<T: Copy + PartialOrd>(
    log: &DataFile,
    column: usize,
    times: &[Option<T>],
) -> Result<()> {
    let stamped = (0..times.len()).filter_map(|line| Some((line, times[line]?)));
    let mut pairs = stamped.clone().zip(stamped.skip(1));
    let Some(((earlier, _), (line, _))) = pairs.find(|((_, before), (_, time))| time < before)
    else {
        return Ok(());
    };
    let texts = log.texts(column)?;
    let [before, value] = [earlier, line].map(|line| texts.at(line).into_owned());
    let (line, column) = (log.line_number(line), log.header[column].clone());
    Err(Error::file(&log.path, Problem::ClockSetBack { line, column, value, before }))
}

/// Line whose time stamp plus `lag` is nearest to `time`, and their distance; the first of equally near ones. `times`
/// increase.
fn nearest<T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T>>(
    times: &[(usize, T)],
    time: T,
    lag: T,
) -> Option<(usize, T)> {
    let later = times.partition_point(|(_, other)| *other + lag < time);
    let distance = |(line, other): &(usize, T)| {
        let shifted = *other + lag;
        (*line, if shifted < time { time - shifted } else { shifted - time })
    };
    let before = later.checked_sub(1).map(|place| distance(&times[place]));
    let after = times.get(later).map(distance);
    match (before, after) {
        (Some(before), Some(after)) => Some(if after.1 < before.1 { after } else { before }),
        (before, after) => before.or(after),
    }
}

#[cfg(test)]
mod tests;

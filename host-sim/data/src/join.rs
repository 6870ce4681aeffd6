//! Two logs joined by time: each line of one with the line of the other whose time stamp is nearest.

use crate::data_file::DataFile;
use crate::error::{BadValue, Error, Problem, Result, require};

/// Largest magnitude up to which f64 holds every whole number: 2^53.
const MOST_EXACT: f64 = 9_007_199_254_740_992.0;

/// How two logs are joined.
#[derive(Debug, Clone, PartialEq)]
pub struct Join {
    /// Columns with the time stamps of the first and of the second log.
    pub on: [String; 2],
    /// Largest distance of two time stamps that belong together, in their unit.
    pub tolerance: f64,
    /// Time added to the time stamps of the second log before they are compared, in their unit.
    pub lag: f64,
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

impl Join {
    /// Checks tolerance and lag.
    pub fn check(&self) -> std::result::Result<(), BadValue> {
        let is_tolerance = self.tolerance.is_finite() && self.tolerance >= 0.0;
        let rule = || "give a time from 0, in the unit of the time stamps".into();
        require(is_tolerance, "tolerance", self.tolerance, rule)?;
        let rule = || "give a time in the unit of the time stamps, negative or not".into();
        require(self.lag.is_finite(), "lag", self.lag, rule)
    }

    /// Joins each line of `first` with the line of `second` whose time stamp, plus the lag, is nearest. Of two that are
    /// equally near it takes the earlier one. Lines without a time stamp have no partner.
    ///
    /// Time stamps beyond ±2^53, such as nanoseconds since 1970, are compared as the whole numbers that the text of the
    /// files has.
    ///
    /// # Errors
    /// [`Error::File`] for a column of time stamps that is not there, for time stamps that decrease or of which not every
    /// digit is known, and if no line finds a partner.
    pub fn join(&self, first: &DataFile, second: &DataFile) -> Result<Joined> {
        let on = [(first, first.column(&self.on[0])?), (second, second.column(&self.on[1])?)];
        let is_large = |(file, column): &(&DataFile, usize)| {
            file.rows().any(|row| row[*column].abs() >= MOST_EXACT)
        };
        let stamps = if on.iter().any(is_large) {
            let [times, others] = on.map(|(file, column)| whole_numbers(file, column));
            let stamps = [times?, others?];
            // Differences of whole numbers are exact, and small.
            let origin = stamps.iter().flatten().flatten().next().copied().unwrap_or(0);
            stamps.map(|log| log.into_iter().map(|time| Some((time? - origin) as f64)).collect())
        } else {
            on.map(|(file, column)| {
                let times = file.rows().map(|row| Some(row[column]).filter(|time| !time.is_nan()));
                times.collect::<Vec<_>>()
            })
        };
        for ((file, column), times) in on.iter().zip(&stamps) {
            check_order(file, *column, times)?;
        }
        let [times, mut others] = stamps.map(|times| {
            let times = times.into_iter().enumerate();
            times.filter_map(|(line, time)| Some((line, time?))).collect::<Vec<_>>()
        });
        let stamped = others.len();
        others.dedup_by_key(|(_, time)| *time); // keeps the first of equal ones
        let mut pairs = vec![];
        let mut largest_distance = 0.0_f64;
        let mut nearest_distance = f64::INFINITY;
        for (line, time) in &times {
            let Some((partner, distance)) = nearest(&others, *time, self.lag) else { continue };
            nearest_distance = nearest_distance.min(distance);
            // Decimal time stamps are rounded: one that is exactly as far must not be left out for that.
            let rounding = 2.0 * f64::EPSILON * (time.abs() + self.lag.abs() + self.tolerance);
            if distance > self.tolerance + rounding {
                continue;
            }
            largest_distance = largest_distance.max(distance);
            pairs.push([*line, partner]);
        }
        if pairs.is_empty() {
            let other = second.path.display().to_string();
            let problem = if nearest_distance.is_finite() {
                let (tolerance, distance) = (self.tolerance, nearest_distance);
                Problem::NoPartner { other, tolerance, distance }
            } else {
                Problem::NoTimeStamp { other }
            };
            return Err(Error::file(&first.path, problem));
        }
        let mut header = first.header.clone();
        for name in &second.header {
            let mut name = name.clone();
            while header.contains(&name) {
                name.insert_str(0, "b.");
            }
            header.push(name);
        }
        Ok(Joined { header, pairs, repeated: stamped - others.len(), largest_distance })
    }
}

/// Time stamps in the `column` of `file`, as whole numbers; `None` where one is missing.
fn whole_numbers(file: &DataFile, column: usize) -> Result<Vec<Option<i128>>> {
    let texts = file.texts(&[column]).remove(0).into_iter().enumerate();
    let numbers = texts.map(|(line, text)| {
        if text.is_empty() {
            return Ok(None);
        }
        // An array has no text: digits of its numbers are lost already.
        // Differences of i64 always fit i128.
        let number = text.parse::<i64>().ok().map(i128::from).filter(|_| file.text.is_some());
        number.map(Some).ok_or_else(|| {
            let (line, column) = (file.line_number(line), file.header[column].clone());
            Error::file(&file.path, Problem::InexactTime { line, column, value: text })
        })
    });
    numbers.collect()
}

/// Checks that `times` in the `column` of `file` do not decrease: after a clock was set back, a time stamp tells no longer
/// which line is meant. They may repeat.
fn check_order(file: &DataFile, column: usize, times: &[Option<f64>]) -> Result<()> {
    let stamped = (0..times.len()).filter_map(|line| Some((line, times[line]?)));
    let Some(((earlier, _), (line, _))) =
        stamped.clone().zip(stamped.skip(1)).find(|((_, before), (_, time))| time < before)
    else {
        return Ok(());
    };
    let texts = file.texts(&[column]).remove(0);
    let [before, value] = [earlier, line].map(|line| texts[line].clone());
    let (line, column) = (file.line_number(line), file.header[column].clone());
    Err(Error::file(&file.path, Problem::ClockSetBack { line, column, value, before }))
}

/// Line whose time stamp plus `lag` is nearest to `time`, and their distance. `times` increase.
fn nearest(times: &[(usize, f64)], time: f64, lag: f64) -> Option<(usize, f64)> {
    let later = times.partition_point(|(_, other)| other + lag < time);
    let around = later.saturating_sub(1)..(later + 1).min(times.len());
    let distances = times[around].iter().map(|(line, other)| (*line, (other + lag - time).abs()));
    distances.min_by(|(_, a), (_, b)| a.total_cmp(b)) // the first of equal ones
}

#[cfg(test)]
mod tests;

//! Two logs joined by time: each line of one with the line of the other whose time stamp is nearest.

use crate::data_file::DataFile;
use crate::digest;
use crate::error::{BadValue, Error, Problem, Result, require};

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

/// Two logs side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Joined {
    /// Lines of the first log that found a partner, with the partner's columns after their own. A column whose name the
    /// first log has too is called `b.NAME`. Line numbers are those of the first log.
    pub file: DataFile,
    /// Number of lines of the first log without a partner, which are left out.
    pub left_out: usize,
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
    /// # Errors
    /// [`Error::File`] for a column of time stamps that is not there, for time stamps that decrease, and if no line
    /// finds a partner.
    pub fn join(&self, first: &DataFile, second: &DataFile) -> Result<Joined> {
        let times = time_stamps(first, &self.on[0])?;
        let mut others = time_stamps(second, &self.on[1])?;
        let stamped = others.len();
        others.dedup_by_key(|(_, time)| *time); // keeps the first of equal ones
        let mut values = vec![];
        let mut line_numbers = vec![];
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
            values.extend_from_slice(first.row(*line));
            values.extend_from_slice(second.row(partner));
            line_numbers.push(first.line_number(*line));
        }
        if line_numbers.is_empty() {
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
        let both = [first.digest.to_le_bytes(), second.digest.to_le_bytes()];
        let how = [self.tolerance.to_le_bytes(), self.lag.to_le_bytes()];
        let left_out = first.lines() - line_numbers.len();
        let file = DataFile {
            path: format!("{} joined with {}", first.path.display(), second.path.display()).into(),
            header,
            names_columns: first.names_columns && second.names_columns,
            lacks_last_line_end: false,
            digest: digest::digest(&[both, how].concat().concat()),
            values,
            line_numbers,
        };
        Ok(Joined { file, left_out, repeated: stamped - others.len(), largest_distance })
    }
}

/// Line (from 0) and time stamp of each line of `file` that has one in the column called `name`. They may repeat, but
/// not decrease: after a clock was set back, a time stamp tells no longer which line is meant.
fn time_stamps(file: &DataFile, name: &str) -> Result<Vec<(usize, f64)>> {
    let column = file.column(name)?;
    let mut times: Vec<(usize, f64)> = vec![];
    for line in 0..file.lines() {
        let time = file.value(line, column);
        if time.is_nan() {
            continue;
        }
        if let Some(&(_, before)) = times.last()
            && time < before
        {
            let (line, column) = (file.line_number(line), name.into());
            let problem = Problem::ClockSetBack { line, column, value: time, before };
            return Err(Error::file(&file.path, problem));
        }
        times.push((line, time));
    }
    Ok(times)
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

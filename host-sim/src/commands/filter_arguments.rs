//! Options of the filter in time, and the times of frames that it needs.

use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_core::filter::Settings;
use taxel_data::{Clock, DataFile};

/// Options of the filter in time.
#[derive(Args, Serialize)]
pub struct FilterArguments {
    /// Filter outputs over time with this time constant in ms; 0 turns the filter off (docs/rate.md).
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    pub filter_ms: Option<u32>,
    /// Time in ms by which the filter or the tracker extrapolates outputs, usually their age when they are used.
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    pub lead_ms: Option<u32>,
}

impl FilterArguments {
    /// Settings of the filter; off without options.
    pub fn settings(&self) -> Settings {
        Settings {
            time_constant_us: self.filter_ms.unwrap_or(0),
            lead_us: self.lead_ms.unwrap_or(0),
        }
    }
}

/// Option for frames without times.
#[derive(Args)]
pub struct PeriodArgument {
    /// Time in ms from one frame to the next, for the filter or the tracker [default: from the file's column of times].
    #[arg(long, value_name = "MS", value_parser = period)]
    pub period_ms: Option<u32>,
}

impl PeriodArgument {
    /// Start of each of so many frames in µs, one after the other. Without the option, the period is `or_us`.
    pub fn even(&self, frames: usize, or_us: u32) -> Vec<u64> {
        let period_us = u64::from(self.period_ms.unwrap_or(or_us));
        (0..frames as u64).map(|frame| frame * period_us).collect()
    }

    /// Start of each line of `file` in µs: by the option, or else by its column with the time.
    pub fn of_file(&self, file: &DataFile) -> Result<Vec<u64>> {
        if self.period_ms.is_some() {
            return Ok(self.even(file.lines(), 0));
        }
        let unfit = |message: String| Err(Error::Unfit { path: file.path.clone(), message });
        let clock = Clock::of(file, None)?;
        if clock.unit != "s" {
            let why = clock.why_counted(file).unwrap_or_else(|| match &clock.column {
                Some(column) => format!("the unit of {column} is not known"),
                None => "no column has a usual name of times".into(),
            });
            return unfit(format!(
                "a filter and a tracker need times, and {why}: add a column time_s, or give --period-ms"
            ));
        }
        let start_us: Vec<u64> = clock.at.iter().map(|s| (s * 1e6).round() as u64).collect();
        match start_us.windows(2).position(|pair| pair[0] == pair[1]) {
            Some(line) => unfit(format!(
                "lines {} and {} have the same time, and a filter treats them as one frame: give --period-ms",
                file.line_number(line),
                file.line_number(line + 1)
            )),
            None => Ok(start_us),
        }
    }
}

/// Times of so many frames that go through `start_us` again and again, after the longest step.
pub fn cycled(start_us: &[u64], frames: usize) -> Vec<u64> {
    let step_us = start_us.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(1);
    let length_us = start_us.last().map_or(0, |last| last - start_us[0]) + step_us;
    let rounds = (0..).flat_map(|round| start_us.iter().map(move |us| us + round * length_us));
    rounds.take(frames).collect()
}

/// Parser for a time constant or a lead, in µs.
fn milliseconds(text: &str) -> std::result::Result<u32, String> {
    let most_us = f64::from(Settings::MOST_US);
    let us = text.parse::<f64>().ok().map(|ms| ms * 1e3).filter(|us| (0.0..=most_us).contains(us));
    let whole = us.filter(|us| *us == 0.0 || *us >= 1.0).map(|us| us.round() as u32);
    whole.ok_or_else(|| format!("give 0, or 0.001 to {} ms", Settings::MOST_US / 1000))
}

/// Parser for a period, in µs.
fn period(text: &str) -> std::result::Result<u32, String> {
    let us = text.parse::<f64>().ok().map(|ms| ms * 1e3).filter(|us| (1.0..=1e9).contains(us));
    us.map(|us| us.round() as u32).ok_or_else(|| "give 0.001 to 1000000 ms".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_whole_microseconds_that_a_device_takes() {
        assert_eq!(milliseconds("5"), Ok(5000));
        assert_eq!(milliseconds("0.0014"), Ok(1));
        assert_eq!(milliseconds("0"), Ok(0));
        assert_eq!(milliseconds("1000"), Ok(1_000_000));
        for bad in ["-1", "1000.1", "0.0001", "nan", "inf", "5 ms", ""] {
            assert!(milliseconds(bad).is_err(), "{bad}");
        }
        assert_eq!(period("0.5"), Ok(500));
        for bad in ["0", "-1", "1e7", "nan"] {
            assert!(period(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn frames_that_are_repeated_come_later() {
        assert_eq!(cycled(&[5, 7, 10], 7), [5, 7, 10, 13, 15, 18, 21]);
        assert_eq!(cycled(&[3], 3), [3, 4, 5]);
    }
}

//! A log over time: errors on its frames, and readings of the untouched sensor.

use serde::Serialize;
use taxel_data::clock::neighbours_alike;
use taxel_data::{Table, columns};

use crate::measurements::Log;
use crate::metrics::pooled;

mod at_rest;

pub use at_rest::{ColumnDrift, PercentOf, RestOverTime, RestStretch};

/// Most stretches of time that a part of a log is cut into.
const MOST_STRETCHES: usize = 20;
/// Fewest frames of a stretch that errors are told of.
const FRAMES_A_STRETCH: usize = 30;

/// Errors and readings at rest of a log, by time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverTime {
    /// Column with the time; `None` if lines are counted.
    pub column: Option<String>,
    /// Unit of times: `s` since the first line, or "" for the column's own numbers and for numbers of lines.
    pub unit: &'static str,
    /// Groups of outputs.
    pub groups: Vec<String>,
    /// RMSE of always predicting the mean of the frames to judge by, by group.
    pub mean_rmse: Vec<f64>,
    /// Errors of the model in the order of time.
    pub errors: Vec<Stretch>,
    /// Readings of the untouched sensor, if the log tells them.
    pub rest: Option<RestOverTime>,
}

/// Errors in a stretch of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// Time of its first and of its last frame.
    pub from: f64,
    pub to: f64,
    pub frames: usize,
    /// Whether these frames were kept from training.
    pub held_out: bool,
    /// RMSE by group; `None` for one without a value here.
    pub rmse: Vec<Option<f64>>,
}

/// Frames of a log with their estimates.
pub struct Decoded<'d> {
    pub log: &'d Log,
    /// True outputs.
    pub outputs: &'d Table,
    /// Estimates, `frames × outputs`.
    pub estimates: &'d [f64],
}

impl OverTime {
    /// Errors of the frames of the same log that were `trained` on, if any, and of those to be `judged` by; and the log's
    /// readings at `rest`. `None` if lines are in no order of time.
    pub fn new(
        trained: Option<&Decoded<'_>>,
        judged: &Decoded<'_>,
        rest: Option<RestOverTime>,
    ) -> Option<Self> {
        let clock = &judged.log.clock;
        if !is_log(judged.log, judged.outputs) {
            return None;
        }
        let names = &judged.outputs.names;
        let groups = columns::groups(names);
        // Beside those of training, few fit on a picture.
        let most = if trained.is_some() { MOST_STRETCHES / 2 } else { MOST_STRETCHES };
        let mut errors =
            trained.map_or(vec![], |it| stretches(it, &groups, (false, MOST_STRETCHES)));
        errors.extend(stretches(judged, &groups, (true, most)));
        Some(Self {
            column: clock.column.clone(),
            unit: clock.unit,
            groups: groups.iter().map(|(group, _)| (*group).to_owned()).collect(),
            mean_rmse: pooled(&groups, &judged.outputs.deviations()),
            errors,
            rest,
        })
    }
}

/// Whether the frames of a `log` with these `outputs` are in the order of time: a column tells it, or neighbours resemble each other.
pub fn is_log(log: &Log, outputs: &Table) -> bool {
    log.clock.column.is_some() || neighbours_alike(outputs)
}

/// Errors of `decoded` frames by stretches of equally many, so many at `most`.
fn stretches(
    decoded: &Decoded<'_>,
    groups: &[(&str, Vec<usize>)],
    (held_out, most): (bool, usize),
) -> Vec<Stretch> {
    let times = decoded.log.times();
    let width = decoded.outputs.names.len();
    let of = |range: std::ops::Range<usize>| {
        let rmse = |(_, members): &(&str, Vec<usize>)| {
            let errors = range.clone().flat_map(|frame| {
                let estimates = &decoded.estimates[frame * width..(frame + 1) * width];
                let truth = decoded.outputs.line(frame);
                members.iter().map(move |column| estimates[*column] - truth[*column])
            });
            let squares: Vec<f64> =
                errors.map(|e| e * e).filter(|square| !square.is_nan()).collect();
            (!squares.is_empty())
                .then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
        };
        Stretch {
            from: times[range.start],
            to: times[range.end - 1],
            frames: range.len(),
            held_out,
            rmse: groups.iter().map(rmse).collect(),
        }
    };
    cut(times.len(), FRAMES_A_STRETCH, most).map(of).collect()
}

/// Cuts so many lines into stretches of equally many: at `most` so many, of at least so many lines if there are two or
/// more.
fn cut(lines: usize, least: usize, most: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let count = (lines / least).clamp(usize::from(lines > 0), most);
    (0..count).map(move |at| at * lines / count..(at + 1) * lines / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::clock::Clock;

    fn log(column: Option<&str>, lines: usize) -> Log {
        let at = (0..lines).map(|line| 2.0 * line as f64).collect();
        let unit = if column.is_some() { "s" } else { "" };
        let clock = Clock { column: column.map(str::to_owned), unit, at };
        Log { clock, lines: (0..lines).collect() }
    }

    fn table(name: &str, values: Vec<f64>) -> Table {
        Table { names: vec![name.into()], values: values.into() }
    }

    #[test]
    fn errors_are_given_by_stretches_of_time_without_missing_values() {
        let log = log(Some("time_s"), 90);
        let values = (0..180).map(|i| f64::from(i / 2) / 9.0).collect();
        let outputs = Table { names: ["f_n", "g_n"].map(String::from).into(), values };
        let wrong = |(i, value): (usize, &f64)| value + if i < 60 { 1.0 } else { 2.0 };
        let mut estimates: Vec<f64> = outputs.values.iter().enumerate().map(wrong).collect();
        estimates[120..].fill(f64::NAN);
        let judged = Decoded { log: &log, outputs: &outputs, estimates: &estimates };
        let found = OverTime::new(None, &judged, None).unwrap();
        let told = |stretch: &Stretch| (stretch.from, stretch.to, stretch.rmse[0]);
        let expected = [(0.0, 58.0, Some(1.0)), (60.0, 118.0, Some(2.0)), (120.0, 178.0, None)];
        assert_eq!(found.errors.iter().map(told).collect::<Vec<_>>(), expected);
        assert!((found.mean_rmse[0] - outputs.deviations()[0]).abs() < 1e-12);
    }

    #[test]
    fn lines_in_random_order_without_a_time_are_no_log() {
        let outputs = table("f_n", (0..90).map(|i| f64::from(i * 37 % 89)).collect());
        for (column, is_log) in [(None, false), (Some("time_s"), true)] {
            let log = log(column, 90);
            let judged = Decoded { log: &log, outputs: &outputs, estimates: &outputs.values };
            assert_eq!(OverTime::new(None, &judged, None).is_some(), is_log);
        }
    }
}

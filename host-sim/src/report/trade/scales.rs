//! Axes of the picture: time of a frame against error, both logarithmic.

use crate::report::axes::Axis;
use crate::report::format::{grouped, significant, symbol, with_unit};
use crate::report::ticks::{self, Ticks, extent};
use taxel_evaluate::evaluate::trade::{Point, Times, Trade};

/// Factor by which what is no point of the front may lie beyond it and still be shown.
const BEYOND: f64 = 4.0;

/// Logarithmic range from `low` to `high`, with some room.
fn around(low: f64, high: f64, label: impl Fn(f64) -> String) -> Ticks {
    let room = (high / low).powf(0.06).max(1.03);
    let (low, high) = (low / room, high * room);
    Ticks { low, high, at: ticks_between(low, high, 5, label) }
}

/// Ticks of a logarithmic range: linear ones if it is short.
fn ticks_between(
    low: f64,
    high: f64,
    wanted: usize,
    label: impl Fn(f64) -> String,
) -> Vec<(f64, String)> {
    let ticks = if high / low < 5.0 {
        ticks::linear([low, high], wanted)
    } else {
        ticks::logarithmic([low, high], label)
    };
    ticks.at.into_iter().filter(|(value, _)| (low..=high).contains(value)).collect()
}

/// What the level axis tells besides the time of a frame.
pub struct AxisOfTimes {
    /// Whether the time of the scans is known, and that of a frame is more than that of its decoding.
    has_scans: bool,
    /// Whether the next scan starts only when the estimate is finished: then the axis tells the rate as well.
    in_turn: bool,
}

/// Both axes.
pub struct Axes {
    pub times: AxisOfTimes,
    pub x: Axis,
    pub y: Axis,
}

impl Axes {
    /// Axes that show the front, the chosen point, and what is not far from them.
    pub fn new(trade: &Trade) -> Self {
        let has_scans = trade.points.iter().all(|point| point.times.scan_ms.is_some());
        let in_turn = |times: &Times| (times.period_ms() / times.frame_ms - 1.0).abs() < 1e-9;
        let in_turn = trade.points.iter().all(|point| in_turn(&point.times));
        let times = AxisOfTimes { has_scans, in_turn };
        let shown = || {
            let chosen = |i: usize| trade.chosen == Some(i);
            let points = trade.points.iter().enumerate();
            points.filter(move |(i, p)| p.on_front || chosen(*i)).map(|(_, point)| point)
        };
        let [least_x, most_x] = range(shown().map(|point| point.times.frame_ms));
        let all_x = trade.points.iter().map(|point| point.times.frame_ms);
        let most_x = all_x.filter(|x| *x <= BEYOND * most_x).fold(most_x, f64::max);
        let error_of = |point: &Point| point.rmse(&trade.group);
        let [least, most] = range(shown().map(error_of));
        // Lines that lie near are shown as well.
        let lines = trade.main_readings().references(&trade.group).map(|(_, rmse)| rmse);
        let near = lines.chain(trade.bounds.error).filter(|y| *y > least / 2.0 && *y < most * 1.6);
        let [least, most] = range(near.chain([least, most]));
        let errors = trade.points.iter().map(error_of).filter(|error| *error < 1.15 * most);
        let most = errors.fold(most, f64::max);
        let label =
            |x: f64| if x < 1000.0 { significant(x, 2) } else { grouped(x.round() as usize) };
        let x = Axis::logarithmic(times.label(), around(least_x, most_x, label));
        let y = around(least, most, |error| significant(error, 2));
        let y = Axis::logarithmic(
            with_unit(&format!("RMSE of {}", symbol(&trade.group)), &trade.unit),
            y,
        );
        Self { times, x, y }
    }

    /// Whether a point lies in the picture.
    pub fn hold(&self, trade: &Trade, point: &Point) -> bool {
        self.x.holds(point.times.frame_ms) && self.y.holds(point.rmse(&trade.group))
    }
}

impl AxisOfTimes {
    fn label(&self) -> &'static str {
        if self.has_scans {
            "time of a frame, scan to estimate (ms)"
        } else {
            "time of decoding a frame (ms); the scan’s is unknown"
        }
    }

    pub fn rate_label(&self) -> &'static str {
        if !self.in_turn {
            "scans go on while the frame before is decoded"
        } else if self.has_scans {
            "frames a second"
        } else {
            "frames a second, by decoding alone"
        }
    }

    /// Frames a second along the x axis: level coordinates and labels. None where scan and decoding overlap.
    pub fn rates(&self, x: &Axis) -> Vec<(f64, String)> {
        if !self.in_turn {
            return Vec::new();
        }
        let ticks = ticks_between(1000.0 / x.ticks.high, 1000.0 / x.ticks.low, 24, |rate| {
            grouped(rate.round() as usize)
        });
        ticks.into_iter().map(|(rate, label)| (1000.0 / rate, label)).collect()
    }

    /// Bounds on time: what they are, and their level coordinate.
    pub fn uprights(&self, trade: &Trade) -> Vec<(String, f64)> {
        let rate = trade.bounds.frame_rate_hz.filter(|_| self.in_turn);
        let rate = rate.map(|hz| (format!("at least {hz} frames/s"), 1000.0 / hz));
        let latency = trade.bounds.latency_ms;
        let latency = latency.map(|ms| (format!("at most {ms} ms"), ms));
        rate.into_iter().chain(latency).collect()
    }
}

/// Lines across the picture: what they are, and their errors.
pub fn levels(trade: &Trade) -> Vec<(String, f64, &'static str)> {
    let readings = trade.main_readings();
    let with = match trade.distinction(readings) {
        of if of.is_empty() => of,
        of => format!(" with {of}"),
    };
    let references = readings.references(&trade.group).enumerate().map(|(place, (name, rmse))| {
        // What is read matters to all but the mean.
        let with = if place == 0 { "" } else { &with };
        (format!("{name}{with} {}", significant(rmse, 3)), rmse, "level")
    });
    let bound = trade.bounds.error.map(|y| (format!("at most {y}"), y, "bound"));
    references.chain(bound).collect()
}

/// Least and greatest of positive values.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = extent(values.filter(|value| *value > 0.0)).unwrap_or((1.0, 10.0));
    [low, high]
}

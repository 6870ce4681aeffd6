//! Axes of the picture: time of a frame against error, both logarithmic.

use taxel_learn::decoders::{linear, mean};

use crate::report::format::{grouped, significant};
use crate::report::tables;
use crate::report::ticks::{self, extent};
use taxel_evaluate::evaluate::trade::{Point, Times, Trade};

/// Factor by which what is no point of the front may lie beyond it and still be shown.
const BEYOND: f64 = 4.0;

/// Logarithmic range with ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    pub low: f64,
    pub high: f64,
    pub at: Vec<(f64, String)>,
}

impl Scale {
    /// Range from `low` to `high`, with some room.
    fn around(low: f64, high: f64, label: impl Fn(f64) -> String) -> Self {
        let room = (high / low).powf(0.06).max(1.03);
        let (low, high) = (low / room, high * room);
        let ticks = if high / low < 5.0 {
            ticks::linear([low, high], 5).at
        } else {
            ticks::logarithmic([low, high], label).at
        };
        let at = ticks.into_iter().filter(|(value, _)| (low..=high).contains(value)).collect();
        Self { low, high, at }
    }

    /// Place of a value: 0 at the low end, 1 at the high end.
    pub fn place(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Both axes, and what the level one shows.
pub struct Axes {
    /// Time that all scans take, if it is the same for all points. Then x is the time of decoding in µs; else it is that
    /// of scan and decoding in ms.
    pub scan_ms: Option<f64>,
    pub is_decoding: bool,
    pub x: Scale,
    pub y: Scale,
}

impl Axes {
    /// Axes that show the front, the chosen point, and what is not far from them.
    pub fn of(trade: &Trade) -> Self {
        let scan_ms = trade.points.first().and_then(|point| point.times.scan_ms);
        let is_decoding = trade.points.iter().all(|point| point.times.scan_ms == scan_ms);
        let x_of = |times: &Times| {
            if is_decoding { 1000.0 * times.decode_ms } else { times.frame_ms }
        };
        let shown = || {
            let chosen = |i: usize| trade.chosen == Some(i);
            let points = trade.points.iter().enumerate();
            points.filter(move |(i, p)| p.on_front || chosen(*i)).map(|(_, point)| point)
        };
        let [least_x, most_x] = range(shown().map(|point| x_of(&point.times)));
        let all_x = trade.points.iter().map(|point| x_of(&point.times));
        let most_x = all_x.filter(|x| *x <= BEYOND * most_x).fold(most_x, f64::max);
        let error_of = |point: &Point| point.rmse(&trade.group);
        let [least, most] = range(shown().map(error_of));
        // Lines that lie near are shown as well.
        let lines = trade.decoders.iter().map(|it| tables::rmse(&it.errors, &trade.group));
        let lines = lines.chain(trade.bounds.error).chain(trade.limit_rmse());
        let near = lines.filter(|y| *y > least / 2.0 && *y < most * 1.6);
        let [least, most] = range(near.chain([least, most]));
        let errors = trade.points.iter().map(error_of).filter(|error| *error < 1.15 * most);
        let most = errors.fold(most, f64::max);
        let label =
            |x: f64| if x < 1000.0 { significant(x, 2) } else { grouped(x.round() as usize) };
        Self {
            scan_ms,
            is_decoding,
            x: Scale::around(least_x, most_x, label),
            y: Scale::around(least, most, |error| significant(error, 2)),
        }
    }

    /// Level coordinate of a point.
    pub fn x_of(&self, times: &Times) -> f64 {
        if self.is_decoding { 1000.0 * times.decode_ms } else { times.frame_ms }
    }

    /// Level coordinate of a time of a frame in ms.
    pub fn x_of_frame(&self, frame_ms: f64) -> f64 {
        if self.is_decoding {
            1000.0 * (frame_ms - self.scan_ms.unwrap_or(0.0)).max(0.0)
        } else {
            frame_ms
        }
    }

    pub fn x_label(&self) -> String {
        match (self.is_decoding, self.scan_ms) {
            (false, _) => "time of a frame, scan and decoding, ms".into(),
            (true, Some(ms)) => {
                format!("time of decoding a frame, µs; each scan takes {ms} ms before")
            }
            (true, None) => "time of decoding a frame, µs; the scan’s is unknown".into(),
        }
    }

    pub fn rate_label(&self) -> &'static str {
        if self.scan_ms.is_some() || !self.is_decoding {
            "frames a second"
        } else {
            "frames a second, by decoding alone"
        }
    }

    /// Frames a second along the x axis: level coordinates and labels.
    pub fn rates(&self) -> Vec<(f64, String)> {
        let scan_ms = if self.is_decoding { self.scan_ms.unwrap_or(0.0) } else { 0.0 };
        let unit = if self.is_decoding { 1000.0 } else { 1.0 };
        let [most, least] = [self.x.low, self.x.high].map(|x| 1000.0 / (scan_ms + x / unit));
        let ticks = if most / least < 5.0 {
            ticks::linear([least, most], 24).at
        } else {
            ticks::logarithmic([least, most], |rate| grouped(rate.round() as usize)).at
        };
        let place = |(rate, label): (f64, String)| (self.x_of_frame(1000.0 / rate), label);
        ticks.into_iter().map(place).filter(|(x, _)| self.x.holds(*x)).collect()
    }

    /// Lines across the picture: what they are, and their errors.
    pub fn levels(trade: &Trade) -> Vec<(String, f64, &'static str)> {
        let named = |name: &str, words: &str, class| {
            let rmse = trade.decoders.iter().find(|baseline| baseline.decoder == name)?;
            let rmse = tables::rmse(&rmse.errors, &trade.group);
            Some((format!("{words} {}", significant(rmse, 3)), rmse, class))
        };
        let limit = trade.limit_rmse();
        let samples = trade.points.first().map_or(1, |point| point.samples_averaged);
        let several = trade.points.iter().any(|point| point.samples_averaged != samples);
        let with = match (several, samples) {
            (false, _) => String::new(),
            (true, 1) => " with 1 sample a reading".into(),
            (true, samples) => format!(" with {samples} samples a reading"),
        };
        let words = |y| format!("least possible{with} {}", significant(y, 3));
        let limit = limit.map(|y| (words(y), y, "level"));
        let bound = trade.bounds.error;
        let bound = bound.map(|y| (format!("at most {y}"), y, "bound"));
        let levels = [
            named(mean::NAME, "always predicting the mean", "level"),
            named(linear::NAME, "best linear decoder", "level"),
            limit,
            bound,
        ];
        levels.into_iter().flatten().collect()
    }

    /// Bounds on time: what they are, and their level coordinate.
    pub fn uprights(&self, trade: &Trade) -> Vec<(String, f64)> {
        let rate = trade.bounds.frame_rate_hz;
        let rate = rate.map(|hz| (format!("at least {hz} frames/s"), self.x_of_frame(1000.0 / hz)));
        let latency = trade.bounds.latency_ms;
        let latency = latency.map(|ms| (format!("at most {ms} ms"), self.x_of_frame(ms)));
        rate.into_iter().chain(latency).collect()
    }
}

/// Least and greatest of positive values.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = extent(values.filter(|value| *value > 0.0)).unwrap_or((1.0, 10.0));
    [low, high]
}

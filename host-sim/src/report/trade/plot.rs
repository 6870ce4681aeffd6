//! The chart of a trade: all points, their front, and what to compare them with.

use taxel_core::rbf::Format;
use taxel_evaluate::device::Times;
use taxel_evaluate::sweep::bounds::Bound;
use taxel_evaluate::trade::{Point, Trade};
use taxel_learn::decoders::centroid;

use super::{counted_rmse, words};
use crate::report::axes::Axis;
use crate::report::chart::{Chart, Mark, Series};
use crate::report::format::{short, significant, with_unit};
use crate::report::svg::Shape;
use crate::report::ticks::{self, Ticks};

/// Factors in time and in error by which a point may lie beyond the front and still be shown.
const BEYOND: [f64; 2] = [4.0, 1.15];

/// Shape of a format's points.
fn shape(format: Format) -> Shape {
    match format {
        Format::Fixed16 => Shape::Circle,
        Format::F32 => Shape::Square,
    }
}

/// Chart, and the number of points that lie outside it.
pub fn chart(trade: &Trade) -> (Chart, usize) {
    let error = counted_rmse(trade);
    let counted = trade.error();
    let at = |point: &Point| [point.times.frame_ms, point.result(&counted).unwrap_or(f64::NAN)];
    let chosen = trade.chosen.map(|i| &trade.points[i]);
    let is_chosen = |point: &Point| chosen.is_some_and(|chosen| std::ptr::eq(chosen, point));
    let (best, others): (Vec<&Point>, Vec<&Point>) =
        trade.points.iter().partition(|point| point.on_front || is_chosen(point));
    let most = [0, 1].map(|axis| best.iter().map(|point| at(point)[axis]).fold(0.0, f64::max));
    let is_near = |point: &&Point| (0..2).all(|axis| at(point)[axis] <= BEYOND[axis] * most[axis]);
    let near: Vec<&Point> = others.iter().copied().filter(is_near).collect();
    let shown = || best.iter().chain(&near).map(|point| at(point));
    let levels = levels(trade);
    // Lines across the picture widen it, unless they lie far away.
    let least = shown().map(|[_, y]| y).fold(f64::INFINITY, f64::min);
    let close =
        levels.iter().map(|line| line.1).filter(|y| (least / 2.0..most[1] * 1.6).contains(y));
    let x = Axis::logarithmic(label(trade), around(shown().map(|[x, _]| x)));
    let y = Axis::logarithmic(
        with_unit(&error, &trade.unit),
        around(shown().map(|[_, y]| y).chain(close)),
    );

    let mut series = Vec::new();
    let across = [x.ticks.low, x.ticks.high];
    for (name, error, class, mark) in levels {
        series.push(Series::new(&name, class, mark, across.map(|x| [x, error]).to_vec()));
    }
    let upright = [y.ticks.low, y.ticks.high];
    for (name, ms) in uprights(trade) {
        let line = if x.holds(ms) { upright.map(|y| [ms, y]).to_vec() } else { Vec::new() };
        series.push(Series::new(&name, "bound", Mark::Line, line));
    }
    if !near.is_empty() {
        series.push(Series::new(
            "dominated",
            "muted dominated",
            Mark::Points(Shape::Circle),
            vec![],
        ));
    }
    let front: Vec<&Point> = trade.front().into_iter().map(|i| &trade.points[i]).collect();
    let line = front.iter().map(|point| at(point)).collect();
    let mut points = vec![Series::new("Pareto front", "front", Mark::Line, line)];
    let both = trade.points.iter().any(|p| p.each_row) && trade.points.iter().any(|p| !p.each_row);
    for (each_row, class, network) in [(true, "c1", " rows"), (false, "c4", " array")] {
        for format in Format::ALL {
            let of = |points: &[&Point]| -> Vec<[f64; 2]> {
                let own = points.iter().filter(|p| p.each_row == each_row && p.format == format);
                own.map(|point| at(point)).collect()
            };
            let (pale, full) = (of(&near), of(&best));
            if pale.is_empty() && full.is_empty() {
                continue;
            }
            let (mark, network) = (Mark::Points(shape(format)), if both { network } else { "" });
            let pale = Series::new("dominated", class, mark.clone(), pale).unlisted();
            series.push(Series { opacity: 0.4, ..pale });
            points.push(Series::new(&format!("{}{network}", format.name()), class, mark, full));
        }
    }
    series.append(&mut points);
    let mut names: Vec<(String, [f64; 2])> = Vec::new();
    if let Some(chosen) = chosen {
        series.push(Series::new("chosen", "chosen", Mark::Points(Shape::Ring), vec![at(chosen)]));
        names.push((words::chosen(trade, chosen, at(chosen)[1]), at(chosen)));
    }
    let named = front.iter().filter(|point| !is_chosen(point));
    names.extend(named.map(|point| (words::brief(trade, point), at(point))));
    let (names, places) = names.into_iter().unzip();
    series.push(Series::new("front", "note-in-chart", Mark::Names(names), places).unlisted());
    let title = format!("{error} against the time of a frame");
    let outside = others.len() - near.len();
    (Chart { title, x, y, series, end_labels: false }, outside)
}

/// Logarithmic range around positive values, with linear ticks where it is short.
fn around(values: impl Iterator<Item = f64>) -> Ticks {
    let (low, high) = ticks::extent(values.filter(|value| *value > 0.0)).unwrap_or((1.0, 10.0));
    if high / low > 5.0 {
        return ticks::logarithmic([low, high], short);
    }
    let room = (high / low).powf(0.06).max(1.03);
    ticks::within(low / room, high * room, 5)
}

/// Label of the axis of time.
fn label(trade: &Trade) -> &'static str {
    if trade.points.iter().all(|point| point.times.scan_ms.is_some()) {
        "time of a frame, scan to estimate (ms)"
    } else {
        "time of decoding a frame (ms); the scan’s is unknown"
    }
}

/// Lines across the picture from top to bottom: what they are, their errors, and their style.
fn levels(trade: &Trade) -> Vec<(String, f64, &'static str, Mark)> {
    let bound = most(trade, &trade.error());
    let bound = bound.map(|y| (format!("at most {y}"), y, "bound", Mark::Line));
    // Other decoders are known on the own contacts alone.
    if trade.worst_case {
        return bound.into_iter().collect();
    }
    let Some(of) = trade.chosen.map(|i| &trade.points[i]).or(trade.points.first()) else {
        return vec![];
    };
    let with = match trade.distinction(of) {
        of if of.is_empty() => of,
        of => format!(" with {of}"),
    };
    let references = trade.references(of).into_iter().enumerate();
    let references = references.map(|(place, (name, rmse))| {
        // What is read matters to all but the mean.
        let (with, class) = if place == 0 { ("", "muted") } else { (with.as_str(), "c3") };
        let (class, mark) = match name {
            "least possible" => ("truth", Mark::Dotted),
            centroid::NAME => ("c2", Mark::Dashed),
            _ => (class, Mark::Dashed),
        };
        (format!("{name}{with} {}", significant(rmse, 3)), rmse, class, mark)
    });
    let mut levels: Vec<_> = references.chain(bound).collect();
    levels.sort_by(|a, b| b.1.total_cmp(&a.1));
    levels
}

/// Most that a result may be.
fn most(trade: &Trade, result: &str) -> Option<f64> {
    match trade.bounds.get(result) {
        Some(Bound::Most(most)) => Some(*most),
        _ => None,
    }
}

/// Bounds on time: what they are, and the time of a frame that each allows.
fn uprights(trade: &Trade) -> Vec<(String, f64)> {
    // A rate bounds the time of a frame only where the next scan starts when the estimate is finished.
    let in_turn = |times: &Times| (times.period_ms() / times.frame_ms - 1.0).abs() < 1e-9;
    let in_turn = trade.points.iter().all(|point| in_turn(&point.times));
    let rate = match trade.bounds.get("frames_per_s") {
        Some(Bound::Least { least }) if in_turn => Some(least),
        _ => None,
    };
    let rate = rate.map(|hz| (format!("at least {hz} frames/s"), 1000.0 / hz));
    let latency = most(trade, "frame_ms").map(|ms| (format!("at most {ms} ms"), ms));
    rate.into_iter().chain(latency).collect()
}

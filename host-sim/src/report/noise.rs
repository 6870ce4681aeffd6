//! Figure of Table 1: error against noise.

use taxel_learn::decoders::{linear, mean, standard};
use taxel_limit::limit;

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::figures::Figure;
use super::format::{noise, symbol, with_unit};
use super::svg::Shape;
use super::ticks;
use taxel_evaluate::metrics::rmse_of;
use taxel_evaluate::table1::{Column, NETWORK, Table1};

const WIDE: [f64; 2] = [920.0, 340.0];
const NARROW: [f64; 2] = [360.0, 270.0];

/// Least RMSE of a decoder over its spreads, or its only one; NaN without a finite one.
fn best(column: &Column, decoder: &str, group: &str) -> f64 {
    let entries = column.decoders.iter().filter(|entry| entry.decoder == decoder);
    let finite =
        entries.filter_map(|entry| rmse_of(&entry.errors, group)).filter(|rmse| rmse.is_finite());
    finite.min_by(f64::total_cmp).unwrap_or(f64::NAN)
}

/// Names of the table's decoders, in the order in which their lines are drawn.
fn decoder_names(table: &Table1) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for entry in table.columns.iter().flat_map(|column| &column.decoders) {
        if !names.contains(&entry.decoder.as_str()) {
            names.push(&entry.decoder);
        }
    }
    names.sort_by_key(|name| match *name {
        mean::NAME => 0,
        standard::NAME => 1,
        NETWORK => 2,
        _ => 3,
    });
    names
}

/// CSS class and mark of a decoder's line.
fn line_style(decoder: &str) -> (&'static str, Mark) {
    match decoder {
        mean::NAME => ("muted", Mark::Dashed),
        standard::NAME => ("c2", Mark::LineAnd(Shape::Square)),
        NETWORK => ("c1", Mark::LineAnd(Shape::Circle)),
        // A broken line, so that it can be seen together with a network that is no better.
        linear::NAME => ("c3 broken", Mark::LineAnd(Shape::Triangle)),
        limit::NAME => ("truth", Mark::Dotted),
        _ => ("c4", Mark::LineAnd(Shape::Diamond)),
    }
}

/// Figure of error against noise, by decoder.
pub fn error_by_noise(table: &Table1, group: &str, unit: &str) -> Figure {
    let positive = || table.columns.iter().filter(|column| column.noise_level > 0.0);
    let points = |decoder: &str| -> Vec<[f64; 2]> {
        positive().map(|column| [column.noise_level, best(column, decoder, group)]).collect()
    };
    let mut lines: Vec<(&str, Vec<[f64; 2]>)> =
        decoder_names(table).into_iter().map(|name| (name, points(name))).collect();
    let least = positive().filter_map(|column| {
        let limit = column.limit.groups.iter().find(|limit| limit.group == group)?;
        Some([column.noise_level, limit.limit])
    });
    let least: Vec<[f64; 2]> = least.collect();
    let known = if least.is_empty() {
        ""
    } else {
        lines.push((limit::NAME, least));
        " Limit: the least possible RMSE of any decoder of the whole frame."
    };
    let heights = |of_standard: bool| {
        let lines = lines.iter().filter(move |(name, _)| (*name == standard::NAME) == of_standard);
        lines.flat_map(|(_, points)| points.iter().map(|[_, y]| *y))
    };
    // The standard network's error may be larger by orders of magnitude; the others must stay apart.
    let most = 2.0 * ticks::extent(heights(false)).map_or(f64::INFINITY, |(_, high)| high);
    let near = heights(true).filter(|y| *y <= most);
    let y = ticks::linear(heights(false).chain(near).chain([0.0]), 5);
    let clipped = heights(true).any(|y| y > most);

    let name = symbol(group);
    let levels = ticks::logarithmic(positive().map(|column| column.noise_level), |level| {
        noise(table.noise_kind, level)
    });
    let series = lines.into_iter().map(|(name, mut points)| {
        // A reference line runs from edge to edge.
        if name == mean::NAME
            && let [[_, first], .., [_, last]] | [[_, first @ last]] = points[..]
        {
            points.insert(0, [levels.low, first]);
            points.push([levels.high, last]);
        }
        let (class, mark) = line_style(name);
        Series::new(name, class, mark, points)
    });
    let series = series.collect();
    let chart = Chart {
        title: format!("RMSE of {name} against noise level, by decoder"),
        x: Axis::logarithmic("noise level p", levels),
        y: Axis::linear(with_unit(&format!("RMSE of {name}"), unit), y),
        series,
        end_labels: true,
    };
    let clipped = if clipped {
        " Arrows at the upper edge mark values off the scale, with their numbers."
    } else {
        ""
    };
    let silent = if positive().count() < table.columns.len() {
        " The level without noise has no place on a logarithmic axis and is in the table only."
    } else {
        ""
    };
    Figure::of_chart(
        "error-by-noise",
        format!(
            "RMSE of {name} in {unit} against noise level (logarithmic). Network: K = {} \
             centres, {} training frames. Standard: the standard RBF network, one centre for \
             each of its {} training frames. Both are shown at their best spread of the table, \
             chosen on the test frames. Linear: the best linear decoder. Mean: always the training \
             mean.{known}{clipped}{silent}",
            table.centres,
            super::format::grouped(table.training_frames),
            table.standard_frames
        ),
        &chart,
        [WIDE, NARROW],
    )
}

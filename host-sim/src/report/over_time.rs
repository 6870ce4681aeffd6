//! Figures of a log over time: errors, and readings of the untouched sensor.

use taxel_evaluate::over_time::{OverTime, PercentOf, RestOverTime, RestStretch, Stretch};

use super::axes::Axis;
use super::chart::{Chart, Mark, STYLES, Series};
use super::figures::Figure;
use super::format::{grouped, symbol};
use super::svg::Shape;
use super::ticks::{self, Ticks};

const WIDE: [f64; 2] = [920.0, 300.0];
const NARROW: [f64; 2] = [360.0, 260.0];
/// Errors beyond so many times that of the mean are arrows at the edge.
const MOST: f64 = 3.0;

/// Least change in per cent that the axis of readings at rest covers, up and down.
const LEAST_PERCENT: f64 = 1.0;

/// Axis of time, and the factor that its numbers have to those of the log.
fn time_axis(log: &OverTime) -> (Axis, f64) {
    let last = log.errors.iter().map(|it| it.to).fold(f64::NEG_INFINITY, f64::max);
    let rest = log.rest.iter().flat_map(|rest| &rest.stretches).map(|it| it.to);
    let last = rest.fold(last, f64::max);
    let first = log.errors.first().map_or(0.0, |it| it.from);
    let first = log.rest.as_ref().map_or(first, |rest| first.min(rest.stretches[0].from));
    let (label, factor) = match (&log.column, log.unit) {
        (Some(_), "s") if last - first >= 7200.0 => ("time in h".to_owned(), 1.0 / 3600.0),
        (Some(_), "s") if last - first >= 180.0 => ("time in min".to_owned(), 1.0 / 60.0),
        (Some(_), "s") => ("time in s".to_owned(), 1.0),
        (Some(column), _) => (column.clone(), 1.0),
        (None, _) => ("line of the file".to_owned(), 1.0),
    };
    (Axis::linear(label, ticks::within(factor * first, factor * last, 8)), factor)
}

/// Figure of the model's errors over time.
pub fn errors(log: &OverTime) -> Figure {
    let (x, factor) = time_axis(log);
    let mut series = Vec::new();
    let shown = log.groups.iter().zip(&log.mean_rmse).zip(STYLES).enumerate();
    for (group, ((name, mean), (class, shape))) in shown {
        for held_out in [false, true] {
            let stretches = log.errors.iter().filter(|it| it.held_out == held_out);
            let point = |it: &Stretch| {
                let middle = factor * f64::midpoint(it.from, it.to);
                [middle, it.rmse[group].map_or(f64::NAN, |rmse| rmse / mean)]
            };
            let points: Vec<[f64; 2]> = stretches.map(point).collect();
            series.push(if held_out {
                Series::new(&symbol(name), class, Mark::LineAnd(shape), points)
            } else {
                let name = format!("{}, trained on", symbol(name));
                Series::new(&name, class, Mark::Dashed, points).unlisted()
            });
        }
    }
    let heights = series.iter().flat_map(|it| it.points.iter().map(|[_, y]| *y));
    let heights = heights.filter(|y| y.is_finite()).map(|y| y.min(MOST));
    let y = ticks::linear(heights.chain([0.0]), 4);
    let shown = STYLES.len().min(log.groups.len());
    let more = match log.groups.len() - shown {
        0 => String::new(),
        more => format!(" {more} more outputs are not shown."),
    };
    let dashed = if log.errors.iter().any(|it| !it.held_out) {
        " Dashed: lines that the model was trained on."
    } else {
        ""
    };
    let chart = Chart {
        title: "Error of the model over time, by output".into(),
        x,
        y: Axis::linear("RMSE ÷ that of always predicting the mean", y),
        series,
        end_labels: false,
    };
    Figure::of_chart(
        "errors-over-time",
        format!(
            "Errors over time, in stretches of equally many lines: RMSE as a share of that of always predicting the mean. \
             A steady rise comes from a sensor that changes, a single peak from presses unlike those of \
             training.{dashed}{more}"
        ),
        &chart,
        [WIDE, NARROW],
    )
}

/// Figure of readings of the untouched sensor over time.
pub fn at_rest(log: &OverTime, rest: &RestOverTime) -> Figure {
    let (x, factor) = time_axis(log);
    let points = |of: &dyn Fn(&RestStretch) -> f64| {
        let stretches = rest.stretches.iter();
        stretches.map(|it| [factor * f64::midpoint(it.from, it.to), of(it)]).collect()
    };
    let percentile = |at: usize| points(&move |it| it.percentiles_percent[at]);
    let mut series = vec![
        Series::new("10 to 90 % of readings", "muted", Mark::Dashed, percentile(0)),
        Series::new("90 % of readings", "muted", Mark::Dashed, percentile(2)).unlisted(),
        Series::new("median", "c1", Mark::LineAnd(Shape::Circle), percentile(1)),
    ];
    let most = points(&|it| it.most_percent);
    series.push(Series::new(&rest.most, "c2", Mark::LineAnd(Shape::Square), most));
    let heights = series.iter().flat_map(|it| it.points.iter().map(|[_, y]| *y));
    // Noise is not to fill the picture.
    let y: Ticks = ticks::linear(heights.chain([-LEAST_PERCENT, LEAST_PERCENT]), 4);
    let of = match rest.percent_of {
        PercentOf::Rest => "their value at rest",
        PercentOf::Range => "their range in the log",
    };
    let chart = Chart {
        title: "Readings of the untouched sensor over time".into(),
        x,
        y: Axis::linear(format!("change at rest, % of {of}"), y),
        series,
        end_labels: false,
    };
    Figure::of_chart(
        "readings-at-rest",
        format!(
            "Readings of the untouched sensor over time: change since the first stretch, in per cent of {of}, in the mean \
             over stretches of the {} lines at rest. {} changes most. {}",
            grouped(rest.lines),
            rest.most,
            if rest.drifts.is_empty() {
                "No reading drifts beyond its noise.".to_owned()
            } else {
                format!(
                    "{} of {} readings drift beyond their noise.",
                    rest.drifts.len(),
                    rest.readings
                )
            }
        ),
        &chart,
        [WIDE, NARROW],
    )
}

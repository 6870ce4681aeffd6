//! Picture of a recursion's learning curve.

use taxel_evaluate::evaluate::learning_curve::LearningCurve;

use super::axes::Axis;
use super::chart::{Chart, Mark, STYLES, Series};
use super::format::{grouped, significant, symbol};
use super::svg::standalone;
use super::ticks;

const SIZE: [f64; 2] = [920.0, 420.0];
/// Errors beyond so many times that of the mean are arrows at the edge: few frames fit their own noise.
const MOST: f64 = 10.0;

/// Picture of `curve` on `subject`, as a file of its own.
pub fn svg(curve: &LearningCurve, subject: &str) -> String {
    standalone(&chart(curve, subject).draw(SIZE), SIZE)
}

/// Errors as shares of that of always predicting the mean, so that outputs of all units share an axis.
fn chart(curve: &LearningCurve, subject: &str) -> Chart {
    let share = |group: usize, rmse: f64| rmse / curve.mean_rmse[group];
    let mut series: Vec<Series> = curve
        .groups
        .iter()
        .enumerate()
        .map(|(group, name)| {
            let (class, shape) = STYLES[group % STYLES.len()];
            let of = curve.points.iter().map(|p| [p.frames as f64, share(group, p.rmse[group])]);
            Series::new(&symbol(name), class, Mark::LineAnd(shape), of.collect())
        })
        .collect();
    let frames = curve.points.iter().map(|point| point.frames as f64);
    let mut x = ticks::logarithmic(frames, |frames| grouped(frames as usize));
    x.at.retain(|(frames, _)| frames.log10().fract().abs() < 1e-9);
    let ends = [[x.low, 1.0], [x.high, 1.0]];
    series.push(Series::new("the mean", "muted", Mark::Dashed, ends.to_vec()));
    let heights = series.iter().flat_map(|s| s.points.iter().map(|[_, y]| y.min(MOST)));
    let y = ticks::logarithmic(heights, |share| significant(share, 1));
    let on = curve.judged_on.words();
    Chart {
        title: format!(
            "Error on {on} by the number of frames that the recursion had taken in, {subject}"
        ),
        x: Axis::logarithmic("frames taken in", x),
        y: Axis {
            label: format!("{subject}: RMSE on {on}, ÷ that of always predicting the mean"),
            ticks: y,
            logarithmic: true,
        },
        series,
        end_labels: true,
    }
}

//! Section on contacts that move: a trajectory, and errors as a robot meets them.

use taxel_data::columns;
use taxel_evaluate::evaluate::moving_contacts::MovingContacts;

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::figures::Figure;
use super::format::{symbol, with_unit};
use super::ticks;

const WIDE: [f64; 2] = [920.0, 320.0];
const NARROW: [f64; 2] = [360.0, 280.0];

/// Figure of one output over a trajectory.
pub fn trajectory(moving: &MovingContacts) -> Figure {
    let shown = &moving.shown;
    let group = columns::group_of(&shown.output);
    let name = match shown.output.strip_suffix(group) {
        None | Some("") => symbol(group),
        Some(electrode) => format!("{} of {}", symbol(group), electrode.trim_end_matches('_')),
    };
    let points = |values: &[f64]| {
        shown.time_s.iter().zip(values).map(|(time, value)| [*time, *value]).collect::<Vec<_>>()
    };
    let series = vec![
        Series::new("newest estimate", "muted", Mark::Line, points(&shown.estimate)),
        Series::new("filtered", "c1", Mark::Line, points(&shown.filtered)),
        Series::new("truth", "c2", Mark::Line, points(&shown.truth)),
    ];
    let heights = series.iter().flat_map(|it| it.points.iter().map(|[_, y]| *y));
    let y = ticks::linear(heights.filter(|y| y.is_finite()).chain([0.0]), 5);
    let (first, last) = (shown.time_s.first(), shown.time_s.last());
    let (first, last) = (first.copied().unwrap_or(0.0), last.copied().unwrap_or(1.0));
    let chart = Chart {
        title: format!("{name} over a trajectory"),
        x: Axis::linear("time in s".to_owned(), ticks::within(first, last, 8)),
        y: Axis::linear(with_unit(&name, &shown.unit), y),
        series,
        end_labels: false,
    };
    Figure::of_chart(
        "trajectory",
        format!(
            "{name} while a contact slides and presses, every ms: the newest finished estimate, what a filter makes of it, and \
             the truth. Estimates come in steps, one per frame, and with a delay."
        ),
        &chart,
        [WIDE, NARROW],
    )
}

//! Section on contacts that move: a trajectory, and errors as a robot meets them.

use std::fmt::Write as _;

use taxel_data::columns;
use taxel_evaluate::evaluate::moving_contacts::MovingContacts;

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::figures::Figure;
use super::format::{UNDEFINED, fixed, significant, symbol, with_unit};
use super::svg::escape;
use super::tables::short_name;
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
             the truth. Estimates come in steps, one a frame, and late."
        ),
        &chart,
        [WIDE, NARROW],
    )
}

/// Table of errors with and without a filter and of the baselines, beside the age of an estimate.
pub fn table(moving: &MovingContacts) -> String {
    let groups = moving.ways.first().map_or(&[][..], |way| &way.errors);
    let mut html =
        String::from("<table>\n<thead><tr><th>Decoder</th><th class=\"number\">Age, ms</th>");
    for group in groups {
        let name = escape(&with_unit(&symbol(&group.group), &group.unit));
        let _ =
            write!(html, "<th class=\"number\">RMSE of {name}</th><th class=\"number\">R²</th>");
    }
    html += "</tr></thead>\n<tbody>\n";
    let ways = moving.ways.iter().map(|way| {
        let name = way.filter.map_or("Network".to_owned(), |filter| {
            let [tau, lead] = [filter.time_constant_ms, filter.lead_ms].map(|ms| fixed(ms, 1));
            format!("Network, filter of {tau} ms, {lead} ms ahead")
        });
        let age = way.times.age_ms.map_or(UNDEFINED.into(), |ms| fixed(ms, 2));
        (name, age, &way.errors)
    });
    let baselines = moving
        .decoders
        .iter()
        .map(|it| (short_name(it).to_owned(), UNDEFINED.to_owned(), &it.errors));
    for (name, age, errors) in ways.chain(baselines) {
        let _ = write!(html, "<tr><td>{}</td><td class=\"number\">{age}</td>", escape(&name));
        for errors in errors {
            let r_squared = errors.r_squared.map_or(UNDEFINED.into(), |it| fixed(it, 3));
            let rmse = significant(errors.rmse, 3);
            let _ = write!(
                html,
                "<td class=\"number\">{rmse}</td><td class=\"number\">{r_squared}</td>"
            );
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table>\n"
}

//! Section on contacts that move: a trajectory, and errors as a robot meets them.

use taxel_data::columns;
use taxel_evaluate::evaluate::moving_contacts::MovingContacts;
use taxel_evaluate::metrics::{Errors, NETWORK};

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::figures::Figure;
use super::format::{fixed, symbol, with_unit};
use super::sections::{Digits, Sections, TableOf};
use super::ticks;

const WIDE: [f64; 2] = [920.0, 320.0];
const NARROW: [f64; 2] = [360.0, 280.0];

/// Figure of one output over a trajectory.
fn trajectory(moving: &MovingContacts) -> Figure {
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

/// Adds errors with and without a filter and of the baselines, beside the age of an estimate, and a trajectory.
pub fn add(sections: &mut Sections, moving: &MovingContacts) {
    let ways = moving.ways.iter().map(|way| {
        let name = way.filter.map_or(NETWORK.to_owned(), |filter| {
            let [tau, lead] = [filter.time_constant_ms, filter.lead_ms].map(|ms| fixed(ms, 1));
            format!("{NETWORK}, filter of {tau} ms, {lead} ms ahead")
        });
        (name, way.times.age_ms, &way.errors[..])
    });
    let baselines = moving.decoders.iter().map(|it| (it.decoder.clone(), None, &it.errors[..]));
    let rows: Vec<(String, Option<f64>, &[Errors])> = ways.chain(baselines).collect();
    let caption = format!(
        "RMSE and R² as a robot meets them, on {}: the newest finished estimate against the truth at that moment, every ms, \
         read by the board. Age: mean time from the middle of a scan until its estimate is used.",
        moving.path.in_words()
    );
    let mut table = TableOf::new(&rows, caption)
        .names("decoder", |(name, ..)| name.clone())
        .numbers("age", "ms", Digits::Decimals(2), |(_, age, _)| *age);
    for group in rows.first().map_or(&[][..], |(.., errors)| errors) {
        let of = |errors: &[Errors]| errors.iter().find(|it| it.group == group.group).cloned();
        table = table
            .numbers(&symbol(&group.group), &group.unit, Digits::Significant(3), |(.., errors)| {
                Some(of(errors)?.rmse)
            })
            .numbers("R²", "", Digits::Decimals(3), |(.., errors)| of(errors)?.r_squared);
    }
    sections.table(table);
    for filter in moving.ways.iter().filter_map(|way| way.filter) {
        sections.note(format!(
            "The filter on a device: `host-sim link PORT configure --filter-ms {} --lead-ms {}` (docs/filter.md).",
            filter.time_constant_ms, filter.lead_ms
        ));
    }
    sections.figure(trajectory(moving));
}

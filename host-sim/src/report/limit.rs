//! Limit of a scene: what a sensor can know, with pictures.

use std::slice;

use serde_json::Value;
use taxel_limit::identify::Observability;
use taxel_limit::reference::GroupLimit;

use super::axes::Axis;
use super::chart::{Chart, Mark, STYLES, Series};
use super::colour::ColourScale;
use super::errors::BAR_PX;
use super::face::Face;
use super::face_map::{Map, Values};
use super::figures::{Figure, Panel};
use super::format::{UNDEFINED, noise, short, significant, symbol, with_unit};
use super::sections::{Digits, Fact, Section, Sections, TableOf, number_value};
use super::svg::Shape;
use super::ticks;
use taxel_evaluate::evaluate::limit::{Figures as Limits, Level, LimitResult};

/// Signal-to-noise ratios below this are not drawn.
const LEAST_RATIO: f64 = 1e-3;
/// Sizes of charts in wide and in narrow windows.
const SIZES: [[f64; 2]; 2] = [[920.0, 400.0], [480.0, 400.0]];
/// Signal-to-noise ratios that a table has of each row.
const SHOWN_RATIOS: usize = 4;
/// Directions that are drawn at most.
const MOST_DIRECTIONS: usize = 60;

/// Chart of the signal-to-noise ratio of every direction, against the noise.
fn directions(level: &Level) -> Chart {
    let line = |seen: &Observability| -> Vec<[f64; 2]> {
        let ratios = seen.signal_to_noise.iter().take(MOST_DIRECTIONS).enumerate();
        ratios.filter(|(_, r)| **r > LEAST_RATIO).map(|(i, r)| [i as f64 + 1.0, *r]).collect()
    };
    let all = line(&level.observability);
    let mut series = vec![Series::new("all readings", "c1", Mark::LineAnd(Shape::Square), all)];
    for (i, row) in level.by_row.iter().enumerate() {
        let name = match &row.row_wires[..] {
            _ if i == 0 => "each row by itself".into(),
            [wire] => format!("row {wire}"),
            wires => format!("{} rows", wires.len()),
        };
        let line = Series::new(&name, "c2", Mark::LineAnd(Shape::Circle), line(row));
        series.push(Series { opacity: 0.45, is_listed: i == 0, ..line });
    }
    let most = series.iter().map(|s| s.points.len()).max().unwrap_or(1) as f64;
    series.push(Series::new(
        "the noise",
        "muted",
        Mark::Dashed,
        vec![[0.5, 1.0], [most + 0.5, 1.0]],
    ));
    let ratios = series.iter().flat_map(|s| s.points.iter().map(|[_, ratio]| *ratio));
    let y = ticks::logarithmic(ratios, short);
    let mut x = ticks::linear([0.0, most], 8);
    (x.low, x.high) = (0.5, most + 0.5);
    x.at.retain(|(value, _)| (1.0..=most).contains(value));
    Chart {
        title: "Signal-to-noise ratio of every direction of the deformation".into(),
        x: Axis::linear("direction, the best visible one first", x),
        y: Axis::logarithmic("signal-to-noise ratio", y),
        series,
        end_labels: false,
    }
}

/// Sections of a scene's limit.
pub fn sections(result: &LimitResult) -> Sections {
    let mut sections = Sections::new(format!("What the sensor of {} can know", result.subject));
    sections.files = vec!["limit.json".into()];
    sections.value("subject", &result.subject);
    sections.value("seed", &result.seed);
    sections.value("noise_kind", &result.noise_kind);
    sections.value("frames", &result.frames);
    let at = result.levels.first().map_or(String::new(), |level| {
        format!("at {} ", noise(result.noise_kind, level.noise_level))
    });
    sections.note(format!(
        "The least possible errors {at}noise ({}), on {} test frames, seed {}.",
        result.noise_kind.name(),
        result.frames,
        result.seed
    ));
    sections.sections.push(Section::Facts(least(result)));
    if result.levels.len() > 1 {
        let caption = "Least possible RMSE from all readings against the noise, both logarithmic. Dashed: predicting the mean.";
        let chart = by_noise(result);
        sections.figure(Figure::of_chart("limit-by-noise", caption.into(), &chart, SIZES));
    }
    for level in &result.levels {
        figures(&mut sections, result, level);
    }
    sections.heading("Least possible errors");
    let lines = lines(slice::from_ref(result));
    sections.table_as("limits", limits(&lines));
    refusals(&mut sections, &lines, |line| name(&line.of.row_wires));
    models(&mut sections, slice::from_ref(result));
    sections.heading("Directions of the deformation");
    let rows = directions_of(slice::from_ref(result));
    sections.table_as("directions", directions_table(&rows));
    sections
}

/// Sections of several scenes: what all readings of each one show.
pub fn several(results: &[LimitResult]) -> Sections {
    let mut sections = Sections::new("What the sensors can know");
    let name_of = |line: &Line<'_>| line.result.subject.clone();
    let mut lines = lines(results);
    sections.rows("limits", limits(&lines));
    lines.retain(|line| line.is_whole);
    sections.table(limits(&lines));
    refusals(&mut sections, &lines, name_of);
    models(&mut sections, results);
    sections.rows("directions", directions_table(&directions_of(results)));
    sections
}

fn levels(results: &[LimitResult]) -> impl Iterator<Item = (&LimitResult, &Level)> {
    results.iter().flat_map(|result| result.levels.iter().map(move |level| (result, level)))
}

/// Limits from some readings at a level of noise.
struct Line<'r> {
    result: &'r LimitResult,
    level: &'r Level,
    of: &'r Limits,
    /// Whether they are from all readings.
    is_whole: bool,
}

impl Line<'_> {
    fn noise(&self) -> String {
        noise(self.result.noise_kind, self.level.noise_level)
    }
}

fn lines(results: &[LimitResult]) -> Vec<Line<'_>> {
    let mut lines = vec![];
    for (result, level) in levels(results) {
        let limits = level.limits.iter().enumerate();
        lines.extend(limits.map(|(i, of)| Line { result, level, of, is_whole: i == 0 }));
    }
    lines
}

/// Table of limits, with columns for each group of outputs.
fn limits<'r>(lines: &'r [Line<'r>]) -> TableOf<'r, Line<'r>> {
    let caption = "Least possible RMSE of any decoder, ± its standard error over the frames: root of the posteriors' mean variance. \
                   Prior: always predicting the mean. ESS: smallest and median effective sample size of the posteriors. Sampling \
                   error: largest share of the squared error that comes from sampling; it is subtracted.";
    let scene = |line: &Line<'r>| line.result.subject.clone();
    let table = TableOf::new(lines, caption);
    let mut table = if lines.iter().all(|line| scene(line) == scene(&lines[0])) {
        table.values("scene", |line| scene(line).into())
    } else {
        table.names("scene", "scene", scene)
    };
    table = table
        .values("noise_level", |line| number_value(Some(line.level.noise_level)))
        .values("row_wires", |line| line.of.row_wires.clone().into())
        .names("readings", "readings", |line| name(&line.of.row_wires))
        .names("noise", "noise", Line::noise);
    let mut names: Vec<&GroupLimit> = vec![];
    for group in lines.iter().flat_map(|line| &line.of.groups) {
        if names.iter().all(|known| known.group != group.group) {
            names.push(group);
        }
    }
    for name in names {
        let of = |line: &Line<'r>| line.of.groups.iter().find(|it| it.group == name.group);
        let limit = |line| of(line).map(|it| [it.limit, it.limit_standard_error]);
        let prior = |line| of(line).map(|it| it.prior_rmse);
        let (symbol, unit, digits) = (symbol(&name.group), &name.unit, Digits::Decimals(4));
        let key = |result: &str| format!("{result}_{}", name.group);
        let keys = [&*key("limit"), &key("limit_standard_error")];
        let of_prior = format!("prior {symbol}");
        table = table
            .estimates(keys, &symbol, unit, digits, limit)
            .numbers(&key("prior_rmse"), &of_prior, unit, digits, prior)
            .values(&key("rmse"), |line| number_value(of(line).map(|it| it.rmse)));
    }
    let samples = |line: &Line<'r>| line.of.effective_samples;
    let own = |line: &Line<'r>| {
        line.of.groups.iter().map(|group| 100.0 * group.monte_carlo_share).reduce(f64::max)
    };
    let text = |line| {
        samples(line).map_or(UNDEFINED.into(), |it| format!("{:.0}, {:.0}", it.least, it.median))
    };
    table
        .cells("effective_samples", "ESS", |line| {
            (text(line), number_value(samples(line).map(|it| it.least)))
        })
        .values("effective_samples_median", |line| number_value(samples(line).map(|it| it.median)))
        .numbers("monte_carlo_percent", "sampling error", "%", Digits::Decimals(2), own)
        .values("refused", |line| line.of.refused.clone().map_or(Value::Null, Value::from))
}

/// Adds the reasons for limits that are not given.
fn refusals(sections: &mut Sections, lines: &[Line<'_>], name_of: impl Fn(&Line<'_>) -> String) {
    for line in lines {
        if let Some(reason) = &line.of.refused {
            sections.note(format!("{}, {}: not given: {reason}", name_of(line), line.noise()));
        }
    }
}

/// Adds a table of the errors of models on the same frames, if there are any.
fn models(sections: &mut Sections, results: &[LimitResult]) {
    let mut rows = vec![];
    for (result, level) in levels(results) {
        let noise = noise(result.noise_kind, level.noise_level);
        for model in &level.decoders {
            rows.extend(model.errors.iter().map(|it| (result, noise.clone(), model, it)));
        }
    }
    let caption = "Models: RMSE on these frames, and its ratio to the limit of all readings.";
    let table = TableOf::new(&rows, caption)
        .names("model", "model", |(_, _, model, _)| model.decoder.clone())
        .names("scene", "scene", |(result, ..)| result.subject.clone())
        .names("noise", "noise", |(_, noise, ..)| noise.clone())
        .values("group", |(.., errors)| errors.group.as_str().into())
        .names("output", "output", |(.., errors)| with_unit(&symbol(&errors.group), &errors.unit))
        .numbers("rmse", "RMSE", "", Digits::Decimals(4), |(.., errors)| Some(errors.rmse))
        .estimates(
            ["ratio_to_limit", "ratio_standard_error"],
            "× limit",
            "",
            Digits::Decimals(3),
            |(.., errors)| Some([errors.ratio_to_limit?, errors.ratio_standard_error?]),
        );
    sections.table_as("models", table);
}

/// Figures of what one level of noise leaves visible.
fn figures(sections: &mut Sections, result: &LimitResult, level: &Level) {
    let seen = &level.observability;
    let noise = noise(result.noise_kind, level.noise_level);
    let of_level = match result.levels.len() {
        1 => String::new(),
        _ => format!(
            "-at-{}",
            noise.replace('\u{a0}', "-").replace('%', "percent").replace('Ω', "ohm")
        ),
    };
    sections.heading(format!("What {noise} noise leaves visible"));
    let caption = format!(
        "Signal-to-noise ratio of every direction: how far one standard deviation of the prior moves the readings, in \
         standard deviations of the noise. {} of {} directions are observable, above the dashed line. Ratios below \
         {LEAST_RATIO} are not drawn.",
        seen.observable, seen.unknowns
    );
    let name = format!("directions{of_level}");
    sections.figure(Figure::of_chart(&name, caption, &directions(level), SIZES));
    let caption = "Share of the prior's variance of each electrode's Δx, Δy and Δz that all readings take away, for a sensor \
                   linearised at the mean deformation: 0 is invisible, 1 is known.";
    let name = format!("known{of_level}");
    sections.figure(Figure::of_panels(&name, caption.into(), &known(result, seen)));
}

/// Least possible errors of all readings at the first noise level.
fn least(result: &LimitResult) -> Vec<Fact> {
    let of_level = |level: &Level| {
        let groups = level.limits.first().map_or(&[][..], |figures| &figures.groups);
        let fact = |group: &GroupLimit| Fact {
            label: format!("Least possible RMSE of {}", symbol(&group.group)),
            value: significant(group.limit, 3),
            unit: group.unit.clone(),
        };
        groups.iter().map(fact).collect()
    };
    result.levels.first().map_or(vec![], of_level)
}

/// Readings at a level of noise, and what they show.
type Shown<'r> = (&'r LimitResult, &'r Level, &'r Observability);

fn directions_of(results: &[LimitResult]) -> Vec<Shown<'_>> {
    let mut rows = vec![];
    for (result, level) in levels(results) {
        let all = [&level.observability].into_iter().chain(&level.by_row);
        rows.extend(all.map(|seen| (result, level, seen)));
    }
    rows
}

/// Table of what readings tell about the deformation along each axis, and of the first directions.
fn directions_table<'r>(rows: &'r [Shown<'r>]) -> TableOf<'r, Shown<'r>> {
    let caption = "Observable directions move the readings by more than the noise for one standard deviation of the prior: their \
                   signal-to-noise ratio is above 1. Known: share of the prior's variance that readings take away, and RMSE that \
                   is left, for a sensor linearised at the mean deformation. S/N: ratios of the first directions.";
    let mut table = TableOf::new(rows, caption)
        .values("scene", |(result, ..)| result.subject.as_str().into())
        .values("noise_level", |(_, level, _)| number_value(Some(level.noise_level)))
        .values("row_wires", |(.., seen)| seen.row_wires.clone().into())
        .names("readings", "readings", |(.., seen)| name(&seen.row_wires))
        .names("noise", "noise", |(result, level, _)| noise(result.noise_kind, level.noise_level))
        .cells("observable", "observable", |(.., seen)| {
            (format!("{} of {}", seen.observable, seen.unknowns), seen.observable.into())
        })
        .values("unknowns", |(.., seen)| seen.unknowns.into());
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        let known = |(.., seen): &Shown<'r>| Some(100.0 * seen.axes[axis].known);
        let rmse = |(.., seen): &Shown<'r>| Some(seen.axes[axis].rmse_mm);
        let [known_key, rmse_key] =
            [format!("known_percent_d{letter}"), format!("rmse_d{letter}_mm")];
        let [of_known, of_rmse] = [format!("known Δ{letter}"), format!("RMSE Δ{letter}")];
        table = table.numbers(&known_key, &of_known, "%", Digits::Decimals(0), known).numbers(
            &rmse_key,
            &of_rmse,
            "mm",
            Digits::Decimals(4),
            rmse,
        );
    }
    table.cells("signal_to_noise", "S/N", |(.., seen)| {
        let ratios = seen.signal_to_noise.iter().take(SHOWN_RATIOS);
        let text = ratios.map(|ratio| significant(*ratio, 3)).collect::<Vec<_>>().join(" ");
        (text, seen.signal_to_noise.clone().into())
    })
}

/// Name of the readings of these row-wires.
fn name(row_wires: &[usize]) -> String {
    match row_wires {
        [row] => format!("row {row}"),
        rows => format!("all {} rows", rows.len()),
    }
}

/// Chart of the limit against the noise level.
fn by_noise(result: &LimitResult) -> Chart {
    let of_array = || result.levels.iter().filter_map(|l| Some((l.noise_level, l.limits.first()?)));
    let names = of_array().map(|(_, figures)| &figures.groups).max_by_key(|groups| groups.len());
    let mut series = Vec::new();
    for (group, (class, shape)) in names.into_iter().flatten().zip(STYLES).take(3) {
        let line = |of: &dyn Fn(&GroupLimit) -> f64| {
            let mut points: Vec<[f64; 2]> = of_array()
                .filter_map(|(noise, f)| {
                    f.groups.iter().find(|g| g.group == group.group).map(|g| [noise, of(g)])
                })
                .collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points
        };
        let name = symbol(&group.group);
        let mean =
            Series::new(&format!("{name}, the mean"), class, Mark::Dashed, line(&|g| g.prior_rmse));
        series.push(mean.unlisted());
        series.push(Series::new(&name, class, Mark::LineAnd(shape), line(&|g| g.limit)));
    }
    let all = |axis: usize| series.iter().flat_map(move |s| s.points.iter().map(move |p| p[axis]));
    let (x, y) = (
        ticks::logarithmic(all(0), |level| noise(result.noise_kind, level)),
        ticks::logarithmic(all(1), short),
    );
    Chart {
        title: "Least possible RMSE against the noise".into(),
        x: Axis::logarithmic("noise", x),
        y: Axis::logarithmic("least possible RMSE (mm)", y),
        series,
        end_labels: true,
    }
}

/// Maps of what is known of each electrode, one an axis.
fn known(result: &LimitResult, seen: &Observability) -> [Panel; 3] {
    let per_row = seen.electrodes.len() / seen.row_wires.len().max(1);
    let [x_mm, y_mm, _] = result.size_mm;
    let size_mm = [x_mm / per_row.max(1) as f64, y_mm / result.row_wires.max(1) as f64];
    let places: Vec<[f64; 2]> = seen.electrodes.iter().map(|e| e.position_mm).collect();
    let face = Face::of_rectangles([x_mm, y_mm], size_mm, &places, &seen.row_wires);
    ['x', 'y', 'z'].map(|letter| {
        let axis = usize::from(letter as u8 - b'x');
        let of_cells: Vec<f64> = seen.electrodes.iter().map(|e| e.known[axis]).collect();
        let title = format!("Map over the face of what the readings show about Δ{letter}");
        let (label, scale) = ("share of the prior's variance", &ColourScale::of_shares());
        let shown = 3 * result.levels.len();
        let values = Values { of_cells: &of_cells, scale, label, unit: "", shown };
        Map::new(&face, &title, &format!("Δ{letter}: share known"), BAR_PX).values(&values)
    })
}

//! Results of a sweep: its points and their front, what the axes explain, and the best settings' scenes.

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::data::{Data, number};
use super::figures::Figure;
use super::format::{counted, significant, symbol};
use super::sections::{Digits, Section, Sections, TableOf};
use super::svg::{Anchor, Shape, Svg, TEXT_PX, text_width};
use super::ticks;
use taxel_evaluate::metrics::unit_of_rmse;
use taxel_evaluate::sweep::Merged;
use taxel_evaluate::sweep::bounds::Bounds;
use taxel_evaluate::sweep::effects::Level;
use taxel_evaluate::sweep::merge::Setting;
use taxel_evaluate::sweep::plan::SEED;

const WIDE: [f64; 2] = [920.0, 420.0];
const NARROW: [f64; 2] = [480.0, 420.0];
/// Settings on the front whose scenes are shown.
const SHOWN: usize = 12;

/// Name of a result for people, with its unit.
fn name(result: &str) -> String {
    let of_group = [
        ("limit_standard_error_", "standard error of the least possible RMSE of"),
        ("limit_", "least possible RMSE of"),
        ("rmse_", "RMSE of"),
        ("ratio_to_limit_", "ratio to the limit of"),
    ];
    for (start, words) in of_group {
        if let Some(group) = result.strip_prefix(start) {
            let unit = if start.starts_with("ratio") {
                String::new()
            } else {
                format!(" ({})", unit_of_rmse(group))
            };
            return format!("{words} {}{unit}", symbol(group));
        }
    }
    let known = [
        ("scan_ms", "time of a scan (ms)"),
        ("decode_ms", "time of decoding (ms)"),
        ("frame_ms", "time of a frame, scan and decoding (ms)"),
        ("frames_per_s", "frames in a second"),
        ("age_ms", "age of an estimate when it is used (ms)"),
        ("cycles", "cycles of decoding"),
        ("blob_bytes", "blob (bytes)"),
        ("ram_bytes", "RAM for decoding (bytes)"),
        ("area_cm2", "area (cm²)"),
    ];
    known
        .iter()
        .find(|(known, _)| *known == result)
        .map_or_else(|| result.into(), |(_, words)| (*words).into())
}

/// Text of a setting's result, with its deviation between repeats.
pub fn result_text(setting: &Setting, name: &str) -> String {
    let Some(value) = setting.results.get(name) else { return "-".into() };
    let is_count = value.fract() == 0.0 && value.abs() < 1e9;
    match setting.deviations.get(name) {
        Some(deviation) if *deviation > 0.0 => {
            format!("{} ± {}", significant(*value, 4), significant(*deviation, 2))
        }
        _ if is_count => format!("{value}"),
        _ => significant(*value, 4),
    }
}

/// Short names of the fields that settings differ in, for heads of tables.
pub fn setting_heads(merged: &Merged) -> Vec<String> {
    let is_name = |part: &&str| part.parse::<usize>().is_err();
    fields(merged)
        .map(|field| field.rsplit('.').find(is_name).unwrap_or(field).to_owned())
        .collect()
}

/// A setting's values of these.
pub fn setting_cells(merged: &Merged, setting: &Setting) -> Vec<String> {
    let text = |field: &str| match setting.values.get(field) {
        Some(serde_json::Value::String(text)) => text.clone(),
        Some(value) => value.to_string(),
        None => "-".into(),
    };
    fields(merged).map(text).collect()
}

fn fields(merged: &Merged) -> impl Iterator<Item = &str> {
    merged.fields.iter().map(String::as_str).filter(|field| *field != SEED)
}

/// At most `most` places among so many things, evenly spread, both ends among them.
pub fn evenly(things: usize, most: usize) -> Vec<usize> {
    if things <= most {
        return (0..things).collect();
    }
    (0..most).map(|place| place * (things - 1) / (most - 1)).collect()
}

/// Results on the x axis and the y axis of the picture.
fn shown(merged: &Merged) -> Option<[&str; 2]> {
    let y = merged.objectives.first()?;
    let x = merged
        .objectives
        .iter()
        .skip(1)
        .next_back()
        .or_else(|| merged.columns.iter().find(|it| *it == "scan_ms"));
    Some([x.unwrap_or(y), y])
}

/// Axis of a result, logarithmic where all values are positive and differ much.
fn axis(result: &str, values: &[f64]) -> Axis {
    let (low, high) = ticks::extent(values.iter().copied()).unwrap_or((0.0, 1.0));
    if low > 0.0 && high > 1.5 * low {
        return Axis::logarithmic(
            name(result),
            ticks::logarithmic(values.iter().copied(), |it| significant(it, 1)),
        );
    }
    let digits = ticks::linear(values.iter().copied(), 6);
    Axis::linear(name(result), digits)
}

/// Chart of all settings, and the line of their front.
fn front(merged: &Merged) -> Option<Chart> {
    let [x, y] = shown(merged)?;
    let at = |setting: &Setting| Some([*setting.results.get(x)?, *setting.results.get(y)?]);
    let points = |wanted: &dyn Fn(&Setting) -> bool| -> Vec<[f64; 2]> {
        merged.settings.iter().filter(|setting| wanted(setting)).filter_map(at).collect()
    };
    let all = points(&|_| true);
    if all.is_empty() {
        return None;
    }
    let mut on_front = points(&|setting| setting.on_front);
    on_front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut outside = Series::new(
        "outside the bounds",
        "muted",
        Mark::Points(Shape::Diamond),
        points(&|it| !it.is_within),
    );
    outside.opacity = 0.45;
    let mut beaten = Series::new(
        "other settings",
        "c1",
        Mark::Points(Shape::Circle),
        points(&|it| it.is_within && !it.on_front),
    );
    beaten.opacity = 0.6;
    // A line through the front holds for two objectives only.
    let mark = if merged.objectives.len() == 2 {
        Mark::LineAnd(Shape::Square)
    } else {
        Mark::Points(Shape::Square)
    };
    let front = Series::new("Pareto front", "c2", mark, on_front);
    let series = [outside, beaten, front].into_iter().filter(|series| !series.points.is_empty());
    let column = |axis: usize| all.iter().map(|point| point[axis]).collect::<Vec<_>>();
    Some(Chart {
        title: format!("{} against {}", name(y), name(x)),
        x: axis(x, &column(0)),
        y: axis(y, &column(1)),
        series: series.collect(),
        end_labels: false,
    })
}

/// Bars of what each axis explains of each objective.
fn bars(merged: &Merged, width: f64) -> String {
    const LINE: f64 = 22.0;
    let fields: Vec<&String> = merged.fields_with_effects().collect();
    let label = fields.iter().map(|field| text_width(field)).fold(60.0, f64::max) + 12.0;
    let value = text_width("100 %") + 8.0;
    let groups: Vec<&String> = merged
        .objectives
        .iter()
        .filter(|name| merged.effects.iter().any(|it| it.result == **name))
        .collect();
    let height = groups.len() as f64 * (fields.len() as f64 * LINE + 44.0);
    let mut svg =
        Svg::new(width, height.max(LINE), "Share of the variance that each axis explains");
    let mut y = 0.0;
    for objective in groups {
        svg.text(0.0, y + TEXT_PX, Anchor::Start, "label strong", &name(objective));
        y += 24.0;
        for field in &fields {
            let share = merged.effect(field, objective).map_or(0.0, |effect| effect.share);
            let full = width - label - value;
            svg.text(label - 8.0, y + 14.0, Anchor::End, "tick", field);
            svg.rect([label, y + 3.0], [full, LINE - 8.0], "face", "");
            svg.rect([label, y + 3.0], [(full * share).max(1.0), LINE - 8.0], "c1 mark", "");
            svg.text(
                width - value + 6.0,
                y + 14.0,
                Anchor::Start,
                "tick",
                &format!("{:.0} %", 100.0 * share),
            );
            y += LINE;
        }
        y += 20.0;
    }
    svg.finish()
}

/// What the axes explain, as a table.
fn shares(merged: &Merged) -> Data {
    let mut data = Data::new(&["result", "axis", "share of the variance (%)"]);
    for effect in &merged.effects {
        let share = number(100.0 * effect.share);
        data.lines.push(vec![effect.result.clone(), effect.field.clone(), share]);
    }
    data
}

/// Sections of a sweep or a comparison whose files begin with `stem`.
pub fn sections(merged: &Merged, stem: &str) -> Sections {
    let mut sections = Sections::new(match stem {
        "compare" => "Layouts compared".into(),
        _ => format!("Sweep {}", merged.plan),
    });
    sections.prefix = format!("{stem}-");
    sections.files = vec![format!("{stem}.csv"), format!("{stem}.json")];
    let within = merged.settings.iter().filter(|setting| setting.is_within).count();
    let bounded = if merged.bounds.is_empty() { 0 } else { within };
    let counts = [
        (merged.failed().count(), "failed"),
        (merged.missing.len(), "missing"),
        (bounded, "within the bounds"),
        (merged.front().len(), "on the front"),
    ];
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let (points, settings) = (merged.points.len(), merged.settings.len());
    let all = [counted(points, "point"), counted(settings, "setting")].into_iter();
    let all = all.chain(counts.map(|(count, what)| format!("{count} {what}")));
    let all = all.collect::<Vec<_>>().join(", ");
    sections.note(format!("{all}; {}", merged.build));
    merged.none_within().into_iter().for_each(|sentence| sections.note(sentence));
    for (note, count) in merged.notes() {
        sections
            .note(format!("{} with {note}; the JSON says why of each", counted(count, "point")));
    }
    if let Some(chart) = front(merged) {
        let caption = "Every setting, and the Pareto front, on which no other setting within the bounds is as good in all \
                       objectives and better in one.";
        sections.figure(Figure::of_chart("front", caption.into(), &chart, [WIDE, NARROW]));
    }
    front_table(&mut sections, merged);
    if !merged.effects.is_empty() {
        sections.heading("What the axes do");
        let drawings = [WIDE, NARROW].map(|size| bars(merged, size[0]));
        let caption = "Share of the variance of each result that the levels of an axis explain, whatever the other axes are: of \
                       its logarithm where all values are positive. What is left belongs to axes together, and to chance.";
        let data = shares(merged);
        sections.figure(Figure::of_drawings("effects", caption.into(), drawings, data));
        shares_table(&mut sections, merged);
        levels(&mut sections, merged);
    }
    sections
}

/// Bounds in words.
pub fn in_bounds(bounds: &Bounds) -> String {
    let bounds = bounds.iter().map(|(result, bound)| format!("{} {bound}", name(result)));
    bounds.collect::<Vec<_>>().join(", ")
}

/// Adds columns of the fields that settings differ in and of their objectives.
fn with_settings<'r>(
    table: TableOf<'r, &'r Setting>,
    merged: &'r Merged,
) -> TableOf<'r, &'r Setting> {
    let mut table = table;
    for (place, head) in setting_heads(merged).iter().enumerate() {
        table = table.names(head, |setting| setting_cells(merged, setting)[place].clone());
    }
    for objective in &merged.objectives {
        table = table.texts(&name(objective), "", |setting| result_text(setting, objective));
    }
    table
}

/// Adds the settings on the front, evenly chosen where they are many.
fn front_table(sections: &mut Sections, merged: &Merged) {
    let front = merged.front();
    let places = evenly(front.len(), SHOWN);
    let shown: Vec<&Setting> = places.iter().map(|place| front[*place]).collect();
    let bounds = in_bounds(&merged.bounds);
    let bounds = if bounds.is_empty() { bounds } else { format!(" Bounds: {bounds}.") };
    let some = if front.len() > SHOWN {
        format!(" {SHOWN} of {} settings; the files have all.", front.len())
    } else {
        String::new()
    };
    let caption = format!("The Pareto front.{some}{bounds}");
    sections.table(with_settings(TableOf::new(&shown, caption), merged));
    let scenes = shown.iter().filter_map(|setting| {
        let scene = vec![Section::Listing(setting.scene.clone()?)];
        Some(Section::Folded(setting.in_words(), scene))
    });
    let scenes: Vec<Section> = scenes.collect();
    if !scenes.is_empty() {
        let summary = "Scenes of these settings, each of which can be saved as a file, and run";
        sections.sections.push(Section::Folded(summary.into(), scenes));
    }
}

/// Adds the share of each objective's variance that each axis explains.
fn shares_table(sections: &mut Sections, merged: &Merged) {
    let fields: Vec<&String> = merged.fields_with_effects().collect();
    let caption = "Share of the variance that each axis explains, in per cent.";
    let mut table = TableOf::new(&fields, caption).names("axis", |field| (*field).clone());
    for objective in &merged.objectives {
        table = table.numbers(&name(objective), "", Digits::Decimals(0), |field| {
            merged.effect(field, objective).map(|effect| 100.0 * effect.share)
        });
    }
    sections.table(table);
}

/// Adds means of each objective by the levels of each axis.
fn levels(sections: &mut Sections, merged: &Merged) {
    let mut rows: Vec<(&String, usize, &Level)> = vec![];
    for field in &merged.fields {
        let first = merged.objectives.iter().find_map(|objective| merged.effect(field, objective));
        let levels = first.map_or(&[][..], |effect| &effect.levels);
        rows.extend(levels.iter().enumerate().map(|(place, level)| (field, place, level)));
    }
    let caption = "Geometric means over all settings of a level, whatever their other axes are.";
    let mut table = TableOf::new(&rows, caption)
        .names("axis", |(field, ..)| (*field).clone())
        .names("level", |(.., level)| level.name.clone())
        .texts("settings", "", |(.., level)| level.points.to_string());
    for objective in &merged.objectives {
        table = table.numbers(&name(objective), "", Digits::Significant(3), |(field, place, _)| {
            let level = merged.effect(field, objective)?.levels.get(*place)?;
            Some(level.mean)
        });
    }
    let summary = "Means by level".into();
    sections.sections.push(Section::Folded(summary, vec![table.section()]));
}

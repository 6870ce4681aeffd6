//! Results of a sweep: its points and their front, what the axes explain, and the best settings' scenes.

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::data::{Data, number};
use super::figures::Figure;
use super::format::{UNDEFINED, counted, short, significant, with_unit};
use super::quantity::{Quantity, in_bounds};
use super::sections::{Digits, Section, Sections, Table, TableOf, number_value};
use super::svg::{Anchor, Shape, Svg, TEXT_PX, text_width};
use super::ticks;
use serde_json::Value;
use taxel_evaluate::sweep::Merged;
use taxel_evaluate::sweep::effects::Level;
use taxel_evaluate::sweep::merge::{PointResult, Setting};
use taxel_evaluate::sweep::plan::is_of_repeats;

const WIDE: [f64; 2] = [920.0, 420.0];
const NARROW: [f64; 2] = [480.0, 420.0];
/// What tells errors apart.
pub const EQUAL_ERRORS: &str = "Errors count as equal if they differ by at most two standard errors of their difference on the \
                                same test frames, or by half a per cent.";
/// Kinds of remarks on points that are written out.
const NOTES: usize = 3;
/// Settings on the front whose scenes are shown.
const SHOWN: usize = 12;

/// Text of a setting's result, with its deviation between repeats.
fn result_text(setting: &Setting, name: &str) -> String {
    let value = setting.results.get(name).copied();
    match (value, setting.deviations.get(name)) {
        (Some(value), Some(deviation)) if *deviation > 0.0 => {
            format!("{} ± {}", significant(value, 4), significant(*deviation, 2))
        }
        _ => Quantity::of(name).digits.text(value),
    }
}

/// Setting's value of a field, and its text.
fn field_value(setting: Option<&Setting>, field: &str) -> (String, Value) {
    let value = setting.and_then(|it| it.values.get(field)).cloned().unwrap_or_default();
    let text = match &value {
        Value::Null => UNDEFINED.into(),
        Value::String(text) => text.clone(),
        value => value.to_string(),
    };
    (text, value)
}

/// Headings of `fields`: their last names, or the whole paths of those whose last names are alike.
fn headings(fields: &[&str]) -> Vec<String> {
    let is_name = |part: &&str| part.parse::<usize>().is_err();
    let last = |field: &&str| field.rsplit('.').find(is_name).unwrap_or(field).replace('_', " ");
    let last: Vec<String> = fields.iter().map(last).collect();
    let is_one = |name: &String| last.iter().filter(|it| *it == name).count() == 1;
    let heading = |(name, field): (&String, &&str)| {
        if is_one(name) { name.clone() } else { (*field).to_owned() }
    };
    last.iter().zip(fields).map(heading).collect()
}

/// Adds columns of the fields that settings differ in, and of these results. A row without a setting has none of them.
pub fn with_results<'r, R>(
    mut table: TableOf<'r, R>,
    (fields, results): (&[&str], &[&str]),
    setting: impl Fn(&'r R) -> Option<&'r Setting>,
) -> TableOf<'r, R> {
    for (field, heading) in fields.iter().zip(headings(fields)) {
        table = table.named(field, &heading, |row| field_value(setting(row), field));
    }
    for result in results {
        let Quantity { heading, unit, .. } = Quantity::of(result);
        table = table.cells(result, &with_unit(&heading, &unit), |row| {
            let Some(setting) = setting(row) else { return (UNDEFINED.into(), Value::Null) };
            let value = number_value(setting.results.get(*result).copied());
            (result_text(setting, result), value)
        });
    }
    table
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

/// Place of a setting in the picture.
fn place(setting: &Setting, [x, y]: [&str; 2]) -> Option<[f64; 2]> {
    Some([*setting.results.get(x)?, *setting.results.get(y)?])
}

/// Axis of a result, logarithmic where all values are positive and differ much.
fn axis(result: &str, values: &[f64]) -> Axis {
    let (low, high) = ticks::extent(values.iter().copied()).unwrap_or((0.0, 1.0));
    if low > 0.0 && high > 1.5 * low {
        return Axis::logarithmic(
            Quantity::of(result).label(),
            ticks::logarithmic(values.iter().copied(), short),
        );
    }
    let digits = ticks::linear(values.iter().copied(), 6);
    Axis::linear(Quantity::of(result).label(), digits)
}

/// Chart of all settings, and the line of their front.
fn front(merged: &Merged) -> Option<Chart> {
    let [x, y] = shown(merged)?;
    let at = |setting: &Setting| place(setting, [x, y]);
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
        title: format!("{} against {}", Quantity::of(y).label(), Quantity::of(x).label()),
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
        svg.text(0.0, y + TEXT_PX, Anchor::Start, "label strong", &Quantity::of(objective).label());
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

/// All points: their fields, their results, and why there are none, as files have them.
pub fn points(merged: &Merged) -> Table {
    let text = |text: &Option<String>| text.clone().map_or(Value::Null, Value::from);
    let mut table =
        TableOf::new(&merged.points, "All points.").values("id", |it| it.id.as_str().into());
    for field in &merged.fields {
        table = table.values(field, |it| it.values.get(field).cloned().unwrap_or_default());
    }
    for name in &merged.columns {
        table = table.values(name, |it| number_value(it.results.get(name).copied()));
    }
    let notes = |it: &PointResult| Some(it.notes.join("; ")).filter(|notes| !notes.is_empty());
    table.values("notes", |it| text(&notes(it))).values("failed", |it| text(&it.failed)).table()
}

/// All settings, as files have them.
fn settings(merged: &Merged) -> TableOf<'_, Setting> {
    let mut table = TableOf::new(&merged.settings, "All settings.");
    for field in merged.fields.iter().filter(|field| !is_of_repeats(field)) {
        table = table.values(field, |it| it.values.get(field).cloned().unwrap_or_default());
    }
    table = table.values("repeats", |it| it.repeats.into());
    for name in &merged.columns {
        table = table.values(name, |it| number_value(it.results.get(name).copied()));
    }
    for name in &merged.columns {
        if merged.settings.iter().any(|it| it.deviations.contains_key(name)) {
            let key = format!("deviation_{name}");
            table = table.values(&key, |it| number_value(it.deviations.get(name).copied()));
        }
    }
    table
        .values("is_within", |it| it.is_within.into())
        .values("on_front", |it| it.on_front.into())
        .values("scene_toml", |it| it.scene.clone().map_or(Value::Null, Value::from))
}

/// Adds what programs read of a plan's results.
pub fn values(sections: &mut Sections, merged: &Merged) {
    sections.value("plan", &merged.plan);
    sections.value("build", &merged.build);
    sections.value("fields", &merged.fields);
    sections.value("columns", &merged.columns);
    sections.value("objectives", &merged.objectives);
    sections.value("bounds", &merged.bounds);
    sections.value("points", &points(merged));
    sections.value("missing", &merged.missing);
    sections.rows("settings", settings(merged));
}

/// Sections of a sweep whose files begin with `stem`.
pub fn sections(merged: &Merged, stem: &str) -> Sections {
    let mut sections = Sections::new(format!("Sweep {}", merged.plan));
    of_files(&mut sections, stem);
    values(&mut sections, merged);
    counts(&mut sections, merged);
    picture(&mut sections, merged, &[]);
    front_table(&mut sections, merged);
    if !merged.effects.is_empty() {
        sections.heading("Effects of the axes");
        let effects = effects(&mut sections, merged);
        sections.sections.extend(effects);
    }
    sections
}

/// Notes the files beside a page, whose names begin with `stem`.
pub fn of_files(sections: &mut Sections, stem: &str) {
    sections.prefix = format!("{stem}-");
    sections.files = vec![format!("{stem}.csv"), format!("{stem}.json")];
}

/// Adds how many points there are, and what is to be known of them.
pub fn counts(sections: &mut Sections, merged: &Merged) {
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
    sections.note(format!("{all}; {}.", merged.build));
    merged.none_within().into_iter().for_each(|sentence| sections.note(sentence));
    let notes = merged.notes();
    for (note, count) in notes.iter().take(NOTES) {
        sections.note(format!("{} with {note}.", counted(*count, "point")));
    }
    if let Some(more) = notes.len().checked_sub(NOTES).filter(|more| *more > 0) {
        sections
            .note(format!("{more} more remarks on points are in the CSV file and in the JSON."));
    }
}

/// Adds the picture of all settings, with `names` of some of them.
pub fn picture(sections: &mut Sections, merged: &Merged, names: &[(&str, &Setting)]) {
    if let Some(mut chart) = front(merged) {
        let at = names.iter().filter_map(|(name, setting)| {
            Some(((*name).to_owned(), place(setting, shown(merged)?)?))
        });
        let (names, places): (Vec<String>, Vec<[f64; 2]>) = at.unzip();
        if !names.is_empty() {
            let names = Series::new("names", "note-in-chart", Mark::Names(names), places);
            chart.series.push(names.unlisted());
        }
        let caption = format!(
            "Every setting, and the Pareto front, on which no other setting within the bounds is as good in all objectives and \
             better in one. {EQUAL_ERRORS}"
        );
        sections.figure(Figure::of_chart("front", caption, &chart, [WIDE, NARROW]));
    }
}

/// Effects of the axes, as a picture and as tables; programs read them as well.
pub fn effects(sections: &mut Sections, merged: &Merged) -> Vec<Section> {
    let table = TableOf::new(&merged.effects, "Effects.")
        .names("field", "axis", |it| it.field.clone())
        .names("result", "result", |it| it.result.clone())
        .values("share", |it| number_value(Some(it.share)));
    sections.rows("effects", table);
    let drawings = [WIDE, NARROW].map(|size| bars(merged, size[0]));
    let caption = "Share of the variance of each result that the levels of an axis explain, whatever the other axes are: of \
                   its logarithm where all values are positive. The rest comes from combinations of axes, and from chance.";
    let data = shares(merged);
    let bars = Section::Figure(Figure::of_drawings("effects", caption.into(), drawings, data));
    let levels = Section::Folded("Means by level".into(), vec![levels(sections, merged)]);
    vec![bars, shares_table(merged), levels]
}

/// Settings on the front, evenly chosen where they are many.
pub fn front_table(sections: &mut Sections, merged: &Merged) {
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
    let fields = merged.fields.iter().map(String::as_str).filter(|field| !is_of_repeats(field));
    let fields: Vec<&str> = fields.collect();
    let objectives: Vec<&str> = merged.objectives.iter().map(String::as_str).collect();
    let table = TableOf::new(&shown, caption);
    sections.table(with_results(table, (&fields, &objectives), |setting| Some(*setting)));
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

/// Share of each objective's variance that each axis explains.
fn shares_table(merged: &Merged) -> Section {
    let fields: Vec<&String> = merged.fields_with_effects().collect();
    let all = merged.points.len();
    let few = merged.objectives.iter().filter_map(|name| {
        let known = merged.points.iter().filter(|it| it.results.contains_key(name)).count();
        let heading = Quantity::of(name).heading;
        (known < all).then(|| format!(" Only {known} of {all} points have the result {heading}."))
    });
    let few: String = few.collect();
    let caption = format!("Share of the variance that each axis explains, in per cent.{few}");
    let mut table = TableOf::new(&fields, caption).names("field", "axis", |field| (*field).clone());
    for objective in &merged.objectives {
        let heading = Quantity::of(objective).heading;
        table = table.numbers(objective, &heading, "", Digits::Decimals(0), |field| {
            merged.effect(field, objective).map(|effect| 100.0 * effect.share)
        });
    }
    Section::Table(table.table())
}

/// Means of each objective by the levels of each axis; programs read them as well.
fn levels(sections: &mut Sections, merged: &Merged) -> Section {
    let mut rows: Vec<(&String, usize, &Level)> = vec![];
    for field in &merged.fields {
        let first = merged.objectives.iter().find_map(|objective| merged.effect(field, objective));
        let levels = first.map_or(&[][..], |effect| &effect.levels);
        rows.extend(levels.iter().enumerate().map(|(place, level)| (field, place, level)));
    }
    let caption = "Geometric means over all settings of a level, whatever their other axes are.";
    let mut table = TableOf::new(&rows, caption)
        .names("field", "axis", |(field, ..)| (*field).clone())
        .names("level", "level", |(.., level)| level.name.clone())
        .numbers("settings", "settings", "", Digits::Count, |row| Some(row.2.points as f64));
    for objective in &merged.objectives {
        let Quantity { heading, unit, .. } = Quantity::of(objective);
        let digits = Digits::Significant(3);
        table = table.numbers(objective, &heading, &unit, digits, |(field, place, _)| {
            let level = merged.effect(field, objective)?.levels.get(*place)?;
            Some(level.mean)
        });
    }
    let table = table.table();
    sections.value("levels", &table);
    Section::Table(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_with_the_same_last_name_have_their_paths_as_headings() {
        let fields = ["sensor.size_mm.0", "sensor.size_mm.2", "training.each_row"];
        assert_eq!(headings(&fields), ["sensor.size_mm.0", "sensor.size_mm.2", "each row"]);
        assert_eq!(headings(&fields[1..]), ["size mm", "each row"]);
    }
}

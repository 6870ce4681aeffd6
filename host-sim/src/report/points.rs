//! Page of a sweep: its points and their front, what the axes explain, and the best settings' scenes.

use std::fmt::Write as _;

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::data::{Data, number};
use super::figures::{Figure, Figures, Page, link};
use super::format::{counted, significant, symbol};
use super::html::document;
use super::svg::{Anchor, Shape, Svg, TEXT_PX, escape, text_width};
use super::tables::numbers;
use super::ticks;
use taxel_evaluate::metrics::unit_of_rmse;
use taxel_evaluate::sweep::Merged;
use taxel_evaluate::sweep::effects::Effect;
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

/// Page of a sweep.
pub fn html(merged: &Merged, stem: &str, command: &str) -> Page {
    let mut figures = Figures::in_files(&format!("{stem}-"));
    let title = format!("Taxel: sweep {}", merged.plan);
    let failed = merged.failed().count();
    let missing = merged.missing.len();
    let mut lacking = String::new();
    for (count, what) in
        [(failed, "failed"), (missing, "missing")].into_iter().filter(|(count, _)| *count > 0)
    {
        let _ = write!(lacking, "; {count} {what}");
    }
    for (note, count) in merged.notes() {
        let _ = write!(lacking, "; {count} with {note}");
    }
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p>{}{lacking}; {}; {}</p>\n</header>\n",
        escape(&title),
        counted(merged.points.len(), "point"),
        counted(merged.settings.len(), "setting"),
        link(&format!("{stem}.csv"), "all points as a table"),
    );
    if let Some(sentence) = merged.none_within() {
        let _ = writeln!(body, "<p>{}</p>", escape(&sentence));
    }
    if let Some(chart) = front(merged) {
        let bounds: Vec<String> =
            merged.bounds.iter().map(|(name, bound)| in_bound(name, *bound)).collect();
        let bounds = if bounds.is_empty() {
            String::new()
        } else {
            format!(" Bounds: {}.", bounds.join(", "))
        };
        let caption = format!(
            "Every setting. On the Pareto front of {} no other setting within the bounds is as good in all and better in \
             one.{bounds}",
            merged.objectives.iter().map(|it| name(it)).collect::<Vec<_>>().join(" and ")
        );
        body += &figures.html(&Figure::of_chart("front", caption, &chart, [WIDE, NARROW]));
    }
    body += &front_table(merged);
    if !merged.effects.is_empty() {
        let drawings = [WIDE, NARROW].map(|size| bars(merged, size[0]));
        let caption = "Share of the variance of each result that the levels of an axis explain, whatever the other axes are: of \
                       its logarithm where all values are positive. What is left belongs to axes together, and to chance.";
        body += "<h2>What the axes do</h2>\n";
        body += &figures.html(&Figure::of_drawings(
            "effects",
            caption.into(),
            drawings,
            shares(merged),
        ));
        body += &levels(merged);
    }
    let _ = writeln!(
        body,
        "<p class=\"note\">Made by <code>{}</code>, {}</p>",
        escape(command),
        escape(&merged.build)
    );
    Page { html: document(&title, &body), figures: figures.files }
}

fn in_bound(name: &str, bound: taxel_evaluate::sweep::file::Bound) -> String {
    use taxel_evaluate::sweep::file::Bound;
    match bound {
        Bound::Most(most) => format!("{name} at most {most}"),
        Bound::Least { least } => format!("{name} at least {least}"),
    }
}

/// A table with these heads, its caption and its lines.
fn table(caption: &str, first: &str, heads: impl Iterator<Item = String>, lines: &str) -> String {
    format!(
        "<figure class=\"table\">\n<figcaption>{caption}</figcaption>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" \
         aria-label=\"{first}\">\n<table class=\"wrap\">\n<thead><tr><th>{first}</th>{}</tr></thead>\n<tbody>\n{lines}</tbody>\n</table>\n</div>\n\
         </figure>\n",
        numbers("th", heads)
    )
}

fn front_table(merged: &Merged) -> String {
    let front = merged.front();
    let places = evenly(front.len(), SHOWN);
    let mut lines = String::new();
    let mut scenes = String::new();
    for place in &places {
        let setting = front[*place];
        let (fields, results) = (setting_cells(merged, setting), merged.objectives.iter());
        let results = results.map(|name| result_text(setting, name));
        let mut cells = fields.into_iter().map(|cell| escape(&cell)).chain(results);
        let first = cells.next().unwrap_or_default();
        let _ = writeln!(lines, "<tr><td>{first}</td>{}</tr>", numbers("td", cells));
        if let Some(scene) = &setting.scene {
            let _ = write!(
                scenes,
                "<details>\n<summary>{}</summary>\n<pre>{}</pre>\n</details>\n",
                escape(&setting.in_words()),
                escape(scene)
            );
        }
    }
    let some = if front.len() > SHOWN {
        format!(" {SHOWN} of {} settings.", front.len())
    } else {
        String::new()
    };
    let mut heads =
        setting_heads(merged).into_iter().chain(merged.objectives.iter().map(|it| name(it)));
    let first = heads.next().unwrap_or_default();
    let table = table(&format!("The front.{some}"), &first, heads.map(|it| escape(&it)), &lines);
    format!(
        "{table}<details>\n<summary>Scenes of these settings</summary>\n<p class=\"note\">Each can be saved as a file, and \
         run.</p>\n{scenes}</details>\n"
    )
}

/// Means of each objective by the levels of each axis.
fn levels(merged: &Merged) -> String {
    let mut lines = String::new();
    for field in &merged.fields {
        let of_field: Vec<Option<&Effect>> =
            merged.objectives.iter().map(|objective| merged.effect(field, objective)).collect();
        let Some(first) = of_field.iter().flatten().next() else { continue };
        let _ = writeln!(
            lines,
            "<tr><th class=\"group\" scope=\"rowgroup\">{}</th></tr>",
            escape(field)
        );
        for (place, level) in first.levels.iter().enumerate() {
            let means = of_field.iter().map(|effect| {
                let level = effect.and_then(|effect| effect.levels.get(place));
                level.map_or("-".into(), |level| significant(level.mean, 3))
            });
            let _ = writeln!(
                lines,
                "<tr><td>{} <small>{} settings</small></td>{}</tr>",
                escape(&level.name),
                level.points,
                numbers("td", means)
            );
        }
    }
    let heads = merged.objectives.iter().map(|it| escape(&name(it)));
    let table = table(
        "Geometric means over all settings of a level, whatever their other axes are.",
        "axis",
        heads,
        &lines,
    );
    format!("<details>\n<summary>Means by level</summary>\n{table}</details>\n")
}

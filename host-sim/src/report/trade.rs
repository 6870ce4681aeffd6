//! Report of a trade between speed and accuracy: a picture, and a page.

use std::fmt::Write as _;

use model_core::rbf::Format;

use super::chart::{Axis, Chart, Mark, Series};
use super::format::{grouped, percent, significant, symbol};
use super::html::document;
use super::svg::{Shape, escape, standalone};
use super::{tables, ticks};
use crate::evaluate::trade::{Arithmetic, Point, Trade};
use crate::metrics::{DecoderErrors, LimitSummary};

/// Style of an arithmetic's points: two classes for networks of a row, two for networks of the whole
/// array, and the shape of both. The second of two classes is for points behind a gate.
type Style = ([&'static str; 2], [&'static str; 2], Shape);

/// Styles of every arithmetic, in the order of [`Arithmetic::all`].
const STYLES: [Style; 5] = [
    (["c1", "c1 hollow"], ["c4", "c4 hollow"], Shape::Circle),
    (["c2", "c2 hollow"], ["c4", "c4 hollow"], Shape::Square),
    (["c3", "c3 hollow"], ["c4", "c4 hollow"], Shape::Triangle),
    (["c3 pale", "c3 pale hollow"], ["c4 pale", "c4 pale hollow"], Shape::Diamond),
    (["muted", "muted hollow"], ["c4", "c4 hollow"], Shape::Dash),
];

/// Chart of cycles against error, both logarithmic: every point by its number of samples, and the front.
fn chart(trade: &Trade) -> Chart {
    let at = |point: &Point| [point.frame.cycles as f64, point.rmse(&trade.group)];
    let mut series = Vec::new();
    let mut samples: Vec<usize> = trade.points.iter().map(|p| p.samples_averaged).collect();
    samples.sort_unstable();
    samples.dedup();
    let marks = [Mark::Line, Mark::Dashed].into_iter().chain(std::iter::repeat(Mark::Dotted));
    for (&samples, mark) in samples.iter().zip(marks) {
        let on_front = trade.points.iter().filter(|p| p.on_front && p.samples_averaged == samples);
        let mut line: Vec<[f64; 2]> = on_front.map(at).collect();
        line.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let plural = if samples == 1 { "" } else { "s" };
        let name = format!("front, {samples} sample{plural}");
        series.push(Series::new(&name, "front", mark, line));
    }
    let arithmetics: Vec<Arithmetic> = Arithmetic::all().collect();
    assert_eq!(arithmetics.len(), STYLES.len(), "a style for every arithmetic");
    for whole_array in [false, true] {
        for (&arithmetic, &(of_rows, of_array, shape)) in arithmetics.iter().zip(&STYLES) {
            let classes = if whole_array { of_array } else { of_rows };
            for (gated, class) in [false, true].into_iter().zip(classes) {
                let of = |p: &&Point| {
                    (p.arithmetic, p.whole_array, p.gate_k.is_some())
                        == (arithmetic, whole_array, gated)
                };
                let points: Vec<&Point> = trade.points.iter().filter(of).collect();
                let Some(way) = points.first().map(|point| point.way()) else { continue };
                let name = if gated { format!("{way}, gate") } else { way };
                let points = points.into_iter().map(at).collect();
                series.push(Series::new(&name, class, Mark::Points(shape), points));
            }
        }
    }
    if let Some(chosen) = trade.chosen {
        let point = vec![at(&trade.points[chosen])];
        series.push(Series::new("chosen", "chosen", Mark::Points(Shape::Ring), point));
    }
    // K is noted at one point of the lowest line for each.
    let most = samples.last().copied();
    let lowest = trade.points.iter().filter(|p| Some(p.samples_averaged) == most && p.on_front);
    let mut notes: Vec<([f64; 2], String)> = Vec::new();
    for point in lowest.filter(|p| p.arithmetic.format == Format::Fixed16) {
        let note = format!("K = {}", point.centres);
        if notes.iter().all(|(_, known)| *known != note) {
            notes.push((at(point), note));
        }
    }
    series.retain(|series| !series.points.is_empty());
    let cycles = trade.points.iter().map(|p| p.frame.cycles as f64);
    let errors = trade.points.iter().map(|p| p.rmse(&trade.group));
    Chart {
        title: format!("RMSE of {} against cycles of a frame", symbol(&trade.group)),
        x: Axis {
            label: "cycles of a frame, Cortex-M4F".into(),
            ticks: ticks::logarithmic(cycles, grouped_cycles),
            logarithmic: true,
        },
        y: Axis {
            label: format!("RMSE of {}, {}", symbol(&trade.group), trade.unit),
            ticks: ticks::logarithmic(errors, |error| significant(error, 2)),
            logarithmic: true,
        },
        series,
        bands: vec![],
        notes,
        end_labels: false,
    }
}

fn grouped_cycles(cycles: f64) -> String {
    grouped(cycles.round() as usize)
}

/// Picture of a trade, as a file of its own.
pub fn svg(trade: &Trade) -> String {
    let size = [960.0, 560.0];
    standalone(&chart(trade).draw(size), size)
}

/// Page of a trade.
pub fn html(trade: &Trade, _command: &str) -> String {
    let chart = chart(trade);
    let title = format!("Taxel: speed against accuracy, {}", trade.scene);
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p>Noise {} a sample; {} test frames; cycles of a frame of a \
         Cortex-M4F by the project's models, at zero wait states and from flash (not checked against silicon), code of {}; \
         times at {} MHz.</p>\n</header>\n",
        escape(&title),
        percent(trade.noise_level),
        grouped(trade.test_frames),
        escape(&trade.compiler),
        trade.device.clock_mhz
    );
    let _ = write!(
        body,
        "<figure id=\"figure-1\">\n{}<figcaption><b>Figure 1.</b> RMSE of {} in {} against cycles of a \
         frame, both logarithmic. Lines: the front, where nothing is better in one of RMSE, cycles and samples \
         and worse in none. Array: one network for all rows, behind a projection; else one a row. Rank: components that this network computes, which are expanded to all outputs. {}RMSE of the baselines: {}.</figcaption>\n</figure>\n",
        chart.draw_responsive([920.0, 520.0], [480.0, 460.0]),
        symbol(&trade.group),
        escape(&trade.unit),
        if trade.points.iter().any(|p| p.gate_k.is_some()) {
            "Hollow: behind a gate that skips untouched rows, with the mean cycles of the test frames. "
        } else {
            ""
        },
        baselines(trade),
    );
    body += &table(trade);
    document(&title, &body)
}

/// RMSE of every baseline in words.
fn baselines(trade: &Trade) -> String {
    let of = |baseline: &DecoderErrors| {
        let rmse = significant(tables::rmse(&baseline.errors, &trade.group), 3);
        format!("{} {rmse} {}", tables::decoder_name(baseline).to_lowercase(), trade.unit)
    };
    trade.baselines.iter().map(of).collect::<Vec<_>>().join(", ")
}

fn table(trade: &Trade) -> String {
    let note = trade.limit.as_ref().map_or(String::new(), LimitSummary::note);
    let mut html = format!(
        "<figure id=\"table-1\" class=\"table\">\n<figcaption><b>Table 1.</b> Every point; those on the \
         Pareto front are bold. In brackets: RMSE relative to the smallest of all points. × limit: that of {} relative to the least \
         possible one with as many samples a reading. {}</figcaption>\n<div class=\"scroll\" \
         tabindex=\"0\" role=\"region\" aria-label=\"Table 1\">\n<table>\n<thead><tr><th>format</th>\
         <th class=\"number\">K</th><th class=\"number\">rank</th><th class=\"after\">tail</th><th class=\"number\">samples</th>\
         <th class=\"number\">gate k</th>",
        symbol(&trade.group),
        escape(&note),
    );
    for (group, unit) in trade.groups() {
        let (group, unit) = (symbol(group), escape(unit));
        let _ = write!(html, "<th class=\"number\">RMSE of {group}, {unit}</th>");
    }
    html += "<th class=\"number\">× limit</th>";
    for head in ["instructions", "cycles", "from flash", "µs", "flash, B", "RAM, B"] {
        let _ = write!(html, "<th class=\"number\">{head}</th>");
    }
    html += "</tr></thead>\n<tbody>\n";
    for (i, p) in trade.points.iter().enumerate() {
        let cell = if p.on_front { "th" } else { "td" };
        let mark = if trade.chosen == Some(i) { " (chosen)" } else { "" };
        let _ = write!(
            html,
            "<tr><{cell}>{}{mark}</{cell}><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"after\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td>",
            p.way(),
            p.centres,
            p.output_rank.map_or("–".into(), |rank| rank.to_string()),
            if p.affine_tail { "yes" } else { "no" },
            p.samples_averaged,
            p.gate_k.map_or("–".into(), |k| k.to_string())
        );
        for (e, ratio) in p.errors.iter().zip(&p.ratio_to_best) {
            let _ =
                write!(html, "<td class=\"number\">{} ({ratio:.2})</td>", significant(e.rmse, 3));
        }
        let ratio = p.ratio_to_limit(&trade.group);
        let ratio = ratio.map_or("–".into(), |ratio| format!("{ratio:.2}"));
        let _ = write!(html, "<td class=\"number\">{ratio}</td>");
        let times = significant(p.times.decode_ms, 3);
        for number in [
            grouped(p.frame.instructions as usize),
            grouped(p.frame.cycles as usize),
            grouped(p.frame.flash_cycles as usize),
            times,
            grouped(p.flash_bytes),
            grouped(p.ram_bytes),
        ] {
            let _ = write!(html, "<td class=\"number\">{number}</td>");
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table>\n</div>\n</figure>\n"
}

//! Table of the front.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::words::rate;
use crate::report::format::{UNDEFINED, fixed, grouped, significant, symbol, with_unit};
use crate::report::svg::escape;
use taxel_evaluate::evaluate::trade::{Point, Trade};

/// Points of the front from fast to slow, and the chosen one.
pub fn of_front(trade: &Trade) -> String {
    let mut shown = trade.front();
    shown.extend(trade.chosen.filter(|chosen| !shown.contains(chosen)));
    let mut columns = columns(trade);
    columns.retain(|column| {
        shown.iter().any(|point| (column.text)(trade, &trade.points[*point]) != UNDEFINED)
    });
    let mut html = String::from(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table 1\">\n\
         <table class=\"front-table\">\n<thead><tr>",
    );
    for column in &columns {
        let class = if column.is_text { "" } else { " class=\"number\"" };
        let _ = write!(html, "<th{class}>{}</th>", escape(&column.name));
    }
    html += "</tr></thead>\n<tbody>\n";
    for &i in &shown {
        let point = &trade.points[i];
        html += if trade.chosen == Some(i) { "<tr class=\"chosen-row\">" } else { "<tr>" };
        for (place, column) in columns.iter().enumerate() {
            let class = if column.is_text { "" } else { " class=\"number\"" };
            let mark = if place == 0 && trade.chosen == Some(i) { " (chosen)" } else { "" };
            let (name, text) = (escape(&column.name), escape(&(column.text)(trade, point)));
            let _ = write!(html, "<td{class} data-name=\"{name}\">{text}{mark}</td>");
        }
        html += "</tr>\n";
    }
    html += "</tbody>\n</table>\n</div>\n";
    let worst: BTreeSet<&str> = shown
        .iter()
        .filter_map(|point| trade.points[*point].worst_other())
        .map(|worst| worst.name.as_ref())
        .collect();
    if !worst.is_empty() {
        let names = escape(&worst.into_iter().collect::<Vec<_>>().join(", "));
        let _ = writeln!(html, "<p class=\"note\">Worst of other contacts: {names}.</p>");
    }
    html
}

/// Column of the table.
struct Column {
    name: String,
    is_text: bool,
    text: fn(&Trade, &Point) -> String,
}

/// All columns that there may be.
fn columns(trade: &Trade) -> Vec<Column> {
    let number = |name: &str, text: fn(&Trade, &Point) -> String| Column {
        name: name.into(),
        is_text: false,
        text,
    };
    let time = if trade.points.iter().any(|p| p.times.scan_ms.is_some()) {
        "scan + decode, ms"
    } else {
        "decode, ms"
    };
    let rmse = format!("RMSE of {}", with_unit(&symbol(&trade.group), &trade.unit));
    vec![
        Column { name: "format".into(), is_text: true, text: |_, p| p.way() },
        number("K", |_, p| p.centres.to_string()),
        number("columns", |_, p| known(p.columns, |columns| columns.to_string())),
        number("samples", |trade, p| {
            let averaged = trade.points.iter().any(|p| p.samples_averaged > 1);
            known(averaged.then_some(p.samples_averaged), |samples| samples.to_string())
        }),
        number("filter, ms", |_, p| known(p.filter, |filter| fixed(filter.time_constant_ms, 1))),
        number(&rmse, |trade, p| significant(p.rmse(&trade.group), 3)),
        number("worst of other contacts", |_, p| {
            known(p.worst_other(), |worst| significant(worst.rmse, 3))
        }),
        number("× limit", |trade, p| {
            known(p.ratio_to_limit(&trade.group), |ratio| fixed(ratio, 2))
        }),
        number(time, |_, p| fixed(p.times.frame_ms, 3)),
        number("age, ms", |_, p| known(p.times.age_ms, |ms| fixed(ms, 3))),
        number("frames/s", |_, p| rate(p.times.frames_per_s)),
        number("cycles", |_, p| grouped(p.frame.cycles as usize)),
        number("blob, B", |_, p| grouped(p.blob_bytes)),
        number("RAM, B", |_, p| grouped(p.ram_bytes)),
    ]
}

/// Text of a value, or that there is none.
fn known<T>(value: Option<T>, text: impl Fn(T) -> String) -> String {
    value.map_or(UNDEFINED.into(), text)
}

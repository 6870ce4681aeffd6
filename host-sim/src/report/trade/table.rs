//! Table of the front.

use std::fmt::Write as _;

use super::words::rate;
use crate::report::format::{UNDEFINED, fixed, grouped, significant, symbol, with_unit};
use crate::report::svg::escape;
use taxel_evaluate::evaluate::trade::{Point, Trade};

/// Points of the front from fast to slow, and the chosen one.
pub fn of_front(trade: &Trade) -> String {
    let mut shown = trade.front();
    shown.extend(trade.chosen.filter(|chosen| !shown.contains(chosen)));
    let columns = columns(trade);
    let mut html = String::from("<table class=\"front-table\">\n<thead><tr>");
    for column in &columns {
        let class = if column.is_text { "" } else { " class=\"number\"" };
        let _ = write!(html, "<th{class}>{}</th>", escape(&column.name));
    }
    html += "</tr></thead>\n<tbody>\n";
    for i in shown {
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
    html + "</tbody>\n</table>\n"
}

/// Column of the table.
struct Column {
    name: String,
    is_text: bool,
    text: fn(&Trade, &Point) -> String,
}

/// Columns that tell points apart.
fn columns(trade: &Trade) -> Vec<Column> {
    let any = |of: fn(&Point) -> bool| trade.points.iter().any(of);
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
    let columns = [
        Some(Column { name: "format".into(), is_text: true, text: |_, p| p.way() }),
        Some(number("K", |_, p| p.centres.to_string())),
        any(|p| p.output_rank.is_some()).then(|| {
            number("rank", |_, p| p.output_rank.map_or(UNDEFINED.into(), |rank| rank.to_string()))
        }),
        Some(number("tail", |_, p| if p.affine_tail { "yes" } else { "no" }.into())),
        any(|p| p.columns.is_some()).then(|| {
            number("columns", |_, p| p.columns.map_or(UNDEFINED.into(), |it| it.to_string()))
        }),
        any(|p| p.samples_averaged > 1)
            .then(|| number("samples", |_, p| p.samples_averaged.to_string())),
        any(|p| p.gate_k.is_some())
            .then(|| number("gate k", |_, p| p.gate_k.map_or(UNDEFINED.into(), |k| k.to_string()))),
        any(|p| p.filter.is_some()).then(|| {
            number("filter, ms", |_, p| {
                p.filter.map_or(UNDEFINED.into(), |filter| fixed(filter.time_constant_ms, 1))
            })
        }),
        Some(number(&rmse, |trade, p| significant(p.rmse(&trade.group), 3))),
        any(|p| !p.others.is_empty()).then(|| {
            number("worst of other contacts", |_, p| {
                let worst = p.worst_other();
                worst.map_or(UNDEFINED.into(), |it| {
                    format!("{} ({})", significant(it.rmse, 3), it.name)
                })
            })
        }),
        any(|p| p.errors.iter().any(|e| e.ratio_to_limit.is_some())).then(|| {
            number("× limit", |trade, p| {
                p.ratio_to_limit(&trade.group).map_or(UNDEFINED.into(), |ratio| fixed(ratio, 2))
            })
        }),
        Some(number(time, |_, p| fixed(p.times.frame_ms, 3))),
        any(|p| p.times.age_ms.is_some()).then(|| {
            number("age, ms", |_, p| p.times.age_ms.map_or(UNDEFINED.into(), |ms| fixed(ms, 3)))
        }),
        Some(number("frames/s", |_, p| rate(p.times.frames_per_s))),
        Some(number("cycles", |_, p| grouped(p.frame.cycles as usize))),
        Some(number("from flash", |_, p| grouped(p.frame.flash_cycles as usize))),
        Some(number("blob, B", |_, p| grouped(p.blob_bytes))),
        Some(number("RAM, B", |_, p| grouped(p.ram_bytes))),
    ];
    columns.into_iter().flatten().collect()
}

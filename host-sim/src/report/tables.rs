//! Tables of errors.

use std::fmt::Write as _;

use taxel_learn::decoders::{linear, mean};

use super::format::{UNDEFINED, decimals, fixed, grouped, percent, significant, symbol, with_unit};
use super::svg::escape;
use super::ticks;
use crate::evaluate::table1::{Column, NETWORK, PAPER_PRINTED_PERCENT, Table1};
use crate::metrics::{DecoderErrors, Definition, Errors};
use crate::run::RunResult;

/// Errors of one group, if it is among `errors`.
pub fn of_group<'e>(errors: &'e [Errors], group: &str) -> Option<&'e Errors> {
    errors.iter().find(|errors| errors.group == group)
}

/// RMSE of one group; NaN if it is not among `errors`.
pub fn rmse(errors: &[Errors], group: &str) -> f64 {
    of_group(errors, group).map_or(f64::NAN, |errors| errors.rmse)
}

/// Name of a decoder on the page.
pub fn decoder_name(decoder: &DecoderErrors) -> &str {
    match decoder.decoder.as_str() {
        NETWORK => "Network",
        linear::NAME => "Best linear decoder",
        mean::NAME => "Training mean",
        other => other,
    }
}

fn heading(definition: Definition) -> &'static str {
    match definition {
        Definition::Rmse => "RMSE",
        Definition::RelativeL2Percent => "Relative L2",
        Definition::FullScalePercent => "% FS",
        Definition::PositionalPercent => "Positional",
        Definition::RSquared => "R²",
        Definition::MeanRelativePercent => "Mean relative",
        Definition::RatioToLimit => "× limit",
    }
}

/// Text of an error by one definition; RMSE with `rmse_decimals`, so that decimal points line up.
fn value(definition: Definition, errors: &Errors, rmse_decimals: usize) -> String {
    let Some(value) = definition.of(errors).filter(|value| value.is_finite()) else {
        return UNDEFINED.into();
    };
    match definition {
        Definition::Rmse => {
            format!("{}\u{a0}{}", fixed(value, rmse_decimals), escape(&errors.unit))
        }
        Definition::RSquared => fixed(value, 3),
        Definition::RatioToLimit => match errors.ratio_standard_error {
            Some(error) => format!("{}\u{a0}± {}", fixed(value, 2), fixed(error, 2)),
            None => fixed(value, 2),
        },
        Definition::RelativeL2Percent | Definition::MeanRelativePercent => {
            format!("{}\u{a0}%", fixed(value, 1))
        }
        Definition::FullScalePercent | Definition::PositionalPercent => {
            format!("{}\u{a0}%", fixed(value, 2))
        }
    }
}

/// Table of errors by axis, decoder and definition.
pub fn errors(result: &RunResult) -> String {
    let mut html = String::from("<table>\n<thead><tr><th>Output</th><th>Decoder</th>");
    for definition in Definition::ALL {
        let _ = write!(html, "<th class=\"number\">{}</th>", heading(definition));
    }
    html += "</tr></thead>\n";
    let groups = result.decoders.first().map_or(&[][..], |decoder| &decoder.errors);
    for group in groups {
        html += "<tbody>\n";
        let all = result.decoders.iter().map(|decoder| rmse(&decoder.errors, &group.group));
        let rmse_decimals = ticks::extent(all).map_or(0, |(least, _)| decimals(least, 3));
        for (i, decoder) in result.decoders.iter().enumerate() {
            let Some(errors) = of_group(&decoder.errors, &group.group) else { continue };
            html += "<tr>";
            if i == 0 {
                let name = escape(&with_unit(&symbol(&group.group), &group.unit));
                let rows = result.decoders.len();
                let _ = write!(html, "<th scope=\"rowgroup\" rowspan=\"{rows}\">{name}</th>");
            }
            let _ = write!(html, "<td>{}</td>", escape(decoder_name(decoder)));
            for definition in Definition::ALL {
                let value = value(definition, errors, rmse_decimals);
                let _ = write!(html, "<td class=\"number\">{value}</td>");
            }
            html += "</tr>\n";
        }
        html += "</tbody>\n";
    }
    html + "</table>\n"
}

/// Table of the example's outputs, true and decoded, for outputs that belong to no electrode.
pub fn example(result: &RunResult) -> String {
    let mut html = String::from(
        "<table>\n<thead><tr><th>Output</th><th class=\"number\">True</th>\
         <th class=\"number\">Decoded</th></tr></thead>\n<tbody>\n",
    );
    for output in &result.example.outputs {
        let name = escape(&with_unit(&symbol(&output.group), &output.unit));
        for (truth, estimate) in output.truth.iter().zip(&output.estimate) {
            let [truth, estimate] = [truth, estimate].map(|value| fixed(*value, 3));
            let _ = writeln!(
                html,
                "<tr><th scope=\"row\">{name}</th><td class=\"number\">{truth}</td>\
                 <td class=\"number\">{estimate}</td></tr>"
            );
        }
    }
    html + "</tbody>\n</table>\n"
}

/// Table of the network's RMSE by depth of the contact (lines) and output (columns).
pub fn by_depth(result: &RunResult) -> String {
    let mut html =
        String::from("<table>\n<thead><tr><th>Depth</th><th class=\"number\">Frames</th>");
    for errors in result.by_depth.first().map_or(&[][..], |range| &range.errors) {
        let name = escape(&with_unit(&symbol(&errors.group), &errors.unit));
        let _ = write!(html, "<th class=\"number\">{name}</th>");
    }
    html += "</tr></thead>\n<tbody>\n";
    for range in &result.by_depth {
        let (depth, frames) = (escape(&range.range()), grouped(range.frames));
        let _ =
            write!(html, "<tr><th scope=\"row\">{depth}</th><td class=\"number\">{frames}</td>");
        for errors in &range.errors {
            let _ = write!(html, "<td class=\"number\">{}</td>", significant(errors.rmse, 3));
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table>\n"
}

/// List of the formulas of all definitions.
pub fn legend() -> String {
    let formulas =
        Definition::ALL.map(|definition| format!("<li>{}</li>", escape(definition.formula())));
    format!(
        "<ul class=\"formulas\">{}</ul>\n<p class=\"note\">e = decoded − true; Δ stands for the \
         true output; H is the thickness of the sensor. “{UNDEFINED}”: not defined.</p>\n",
        formulas.concat()
    )
}

/// Definition in which the paper's table is shown: positional where it is defined.
pub fn printed_definition(table: &Table1, group: &str) -> Definition {
    let mean =
        table.columns.first().and_then(|column| of_group(column.errors(mean::NAME, None), group));
    match mean.and_then(|errors| errors.positional_percent) {
        Some(_) => Definition::PositionalPercent,
        None => Definition::FullScalePercent,
    }
}

/// Caption of [`table1`].
pub fn table1_caption(table: &Table1, group: &str) -> String {
    let definition = printed_definition(table, group);
    let [low, high] = PAPER_PRINTED_PERCENT;
    format!(
        "Error of {} by spread and noise level, arranged as Table 1 of the paper: {}. Network with \
         K = {}. The paper prints {low}–{high} % and does not state its definition. Cells marked † \
         are no better than always predicting the training mean.",
        escape(&symbol(group)),
        escape(definition.formula()),
        table.centres
    )
}

/// Table of errors by spread (lines) and noise level (columns).
pub fn table1(table: &Table1, group: &str) -> String {
    let definition = printed_definition(table, group);
    let of = |errors: &[Errors]| {
        of_group(errors, group).and_then(|e| definition.of(e)).filter(|v| v.is_finite())
    };
    let cell = |value: Option<f64>| value.map_or(UNDEFINED.into(), |v| format!("{v:.2}\u{a0}%"));
    let mut html = format!(
        "<table class=\"compact\">\n<thead><tr><th rowspan=\"2\">Spread</th>\
         <th class=\"span\" colspan=\"{}\">Noise level</th></tr>\n<tr>",
        table.columns.len()
    );
    for column in &table.columns {
        let _ = write!(html, "<th class=\"number\">{}</th>", percent(column.noise_level));
    }
    html += "</tr></thead>\n<tbody>\n";
    for spread in table.columns.first().into_iter().flat_map(Column::spreads) {
        let _ = write!(html, "<tr><th scope=\"row\">{spread:?}</th>");
        for column in &table.columns {
            let value = of(column.errors(NETWORK, Some(spread)));
            let poor = value
                .zip(of(column.errors(mean::NAME, None)))
                .is_some_and(|(value, mean)| value >= mean);
            let (class, mark) =
                if poor { (" poor", "<span class=\"dagger\">†</span>") } else { ("", "") };
            let text = cell(value);
            let _ = write!(html, "<td class=\"number{class}\">{text}{mark}");
            let printed = table.printed.iter().find(|printed| {
                same(printed.spread, spread) && same(printed.noise_level, column.noise_level)
            });
            if let Some(printed) = printed {
                let _ = write!(html, "<small>paper {}\u{a0}%</small>", printed.percent);
            }
            html += "</td>";
        }
        html += "</tr>\n";
    }
    html += "</tbody>\n<tbody class=\"reference\">\n";
    for baseline in table.columns.first().into_iter().flat_map(Column::baselines) {
        let name = capitalised(&baseline.decoder);
        let _ = write!(html, "<tr><th scope=\"row\">{}</th>", escape(&name));
        for column in &table.columns {
            let text = cell(of(column.errors(&baseline.decoder, None)));
            let _ = write!(html, "<td class=\"number\">{text}</td>");
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table>\n"
}

/// Name with a capital letter, as the head of a line.
fn capitalised(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Whether two settings that people typed are the same number.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

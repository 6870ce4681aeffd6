//! Tables of errors.

use std::fmt::Write as _;

use taxel_learn::decoders::{centroid, linear, mean};

use super::format::{UNDEFINED, decimals, fixed, grouped, percent, significant, symbol, with_unit};
use super::svg::escape;
use super::ticks;
use super::view::View;
use taxel_evaluate::by_load::LoadErrors;
use taxel_evaluate::evaluate::printed::{CELLS, NOISE_LEVELS, SPREADS};
use taxel_evaluate::evaluate::table1::{Comparison, NETWORK, Table1};
use taxel_evaluate::metrics::{self, DecoderErrors, Definition, Errors};
use taxel_evaluate::others::Others;

/// Errors of one group, if it is among `errors`.
pub fn of_group<'e>(errors: &'e [Errors], group: &str) -> Option<&'e Errors> {
    errors.iter().find(|errors| errors.group == group)
}

/// RMSE of one group; NaN if it is not among `errors`.
pub fn rmse(errors: &[Errors], group: &str) -> f64 {
    of_group(errors, group).map_or(f64::NAN, |errors| errors.rmse)
}

/// Short name of a decoder, for the head of a column.
pub fn short_name(decoder: &DecoderErrors) -> &str {
    match decoder.decoder.as_str() {
        NETWORK => "Network",
        linear::NAME => "Linear",
        centroid::NAME => "Centroid",
        mean::NAME => "Mean",
        other => other,
    }
}

/// Definitions in the order of the table: those that matter most come first, where narrow windows show them.
const ORDER: [Definition; 7] = [
    Definition::Rmse,
    Definition::RatioToLimit,
    Definition::RSquared,
    Definition::FullScalePercent,
    Definition::RelativeL2Percent,
    Definition::PositionalPercent,
    Definition::MeanRelativePercent,
];

fn heading(definition: Definition) -> &'static str {
    match definition {
        Definition::Rmse => "RMSE",
        Definition::RelativeL2Percent => "Relative L2, %",
        Definition::FullScalePercent => "%FS",
        Definition::PositionalPercent => "Positional, %",
        Definition::RSquared => "R²",
        Definition::MeanRelativePercent => "Mean relative, %",
        Definition::RatioToLimit => "×\u{a0}limit",
    }
}

/// Text of an error by one definition; RMSE with `rmse_decimals`, so that decimal points line up.
fn value(definition: Definition, errors: &Errors, rmse_decimals: usize) -> String {
    let Some(value) = definition.of(errors).filter(|value| value.is_finite()) else {
        return UNDEFINED.into();
    };
    match definition {
        Definition::Rmse => fixed(value, rmse_decimals),
        Definition::RSquared => fixed(value, 3),
        Definition::RatioToLimit => match errors.ratio_standard_error {
            Some(error) => format!("{}\u{a0}±\u{a0}{}", fixed(value, 2), fixed(error, 2)),
            None => fixed(value, 2),
        },
        Definition::RelativeL2Percent | Definition::MeanRelativePercent => fixed(value, 1),
        Definition::FullScalePercent | Definition::PositionalPercent => fixed(value, 2),
    }
}

/// Names of the groups of outputs with their units.
fn groups(decoders: &[DecoderErrors]) -> &[Errors] {
    decoders.first().map_or(&[][..], |decoder| &decoder.errors)
}

/// Decimals with which the RMSE of all decoders have at least three digits.
fn rmse_decimals(decoders: &[DecoderErrors], group: &str) -> usize {
    let all = decoders.iter().map(|decoder| rmse(&decoder.errors, group));
    ticks::extent(all).map_or(0, |(least, _)| decimals(least, 3))
}

/// Cells of numbers, as HTML: `th` in the head of a table, `td` in a line.
pub fn numbers(tag: &str, cells: impl IntoIterator<Item = String>) -> String {
    let cell = |cell| format!("<{tag} class=\"number\">{cell}</{tag}>");
    cells.into_iter().map(cell).collect()
}

/// Line of a table: its head, and numbers.
fn line(head: &str, cells: impl IntoIterator<Item = String>) -> String {
    format!("<tr><th scope=\"row\">{head}</th>{}</tr>\n", numbers("td", cells))
}

/// Name of a group with its unit, as HTML.
fn name(group: &Errors) -> String {
    escape(&with_unit(&symbol(&group.group), &group.unit))
}

/// Small table of RMSE by group and decoder, beside the least possible one.
pub fn headline(view: &View<'_>) -> String {
    let (decoders, linear, limits) = (view.decoders, view.linear_at_training, &view.limit.groups);
    let trained = (!linear.is_empty()).then(|| "Linear in training".to_owned());
    // Columns of the limit, where there is one.
    let known = |cells: [String; 2]| cells.into_iter().filter(|_| !limits.is_empty());
    let heads = decoders.iter().map(|decoder| escape(short_name(decoder)));
    let heads =
        heads.chain(trained).chain(known(["Least possible", "×\u{a0}limit"].map(String::from)));
    let lines = groups(decoders).iter().map(|group| {
        let decimals = rmse_decimals(decoders, &group.group);
        let cells = decoders.iter().map(|it| fixed(rmse(&it.errors, &group.group), decimals));
        let linear = (!linear.is_empty()).then(|| {
            let of_group = linear.iter().find(|it| it.group == group.group);
            of_group.map_or(UNDEFINED.into(), |it| fixed(it.rmse, decimals))
        });
        let limit = limits.iter().find(|limit| limit.group == group.group);
        let limit = limit.map_or(UNDEFINED.into(), |limit| fixed(limit.limit, decimals));
        let ratio = group.ratio_to_limit.map_or(UNDEFINED.into(), |ratio| fixed(ratio, 2));
        line(&name(group), cells.chain(linear).chain(known([limit, ratio])))
    });
    format!(
        "<table class=\"headline\">\n<thead><tr><th>RMSE</th>{}</tr></thead>\n<tbody>\n{}</tbody>\n</table>\n",
        numbers("th", heads),
        lines.collect::<String>()
    )
}

/// Definitions that have a column: those by which any error is defined.
fn defined(decoders: &[DecoderErrors]) -> Vec<Definition> {
    let all = || decoders.iter().flat_map(|decoder| &decoder.errors);
    ORDER.into_iter().filter(|it| all().any(|errors| it.of(errors).is_some())).collect()
}

/// Table of errors by axis, decoder and definition.
pub fn errors(decoders: &[DecoderErrors]) -> String {
    let shown = defined(decoders);
    let heads = shown.iter().map(|definition| heading(*definition).into());
    let mut html =
        format!("<table>\n<thead><tr><th>Decoder</th>{}</tr></thead>\n", numbers("th", heads));
    for group in groups(decoders) {
        let (name, columns) = (name(group), shown.len() + 1);
        let _ = writeln!(
            html,
            "<tbody>\n<tr><th class=\"group\" scope=\"rowgroup\" colspan=\"{columns}\">{name}</th></tr>"
        );
        let decimals = rmse_decimals(decoders, &group.group);
        for decoder in decoders {
            let Some(errors) = of_group(&decoder.errors, &group.group) else { continue };
            let cells = shown.iter().map(|definition| value(*definition, errors, decimals));
            let name = escape(short_name(decoder));
            let _ = writeln!(html, "<tr><td>{name}</td>{}</tr>", numbers("td", cells));
        }
        html += "</tbody>\n";
    }
    html + "</table>\n"
}

/// Outputs that a table lists at most.
const MOST_OUTPUTS: usize = 24;

/// Table of the outputs of the shown frames, true and decoded, for outputs that belong to no electrode.
pub fn frames(view: &View<'_>) -> String {
    let shown = view.distribution;
    let mut html = String::from("<table>\n<thead><tr><th rowspan=\"2\">Output</th>");
    for frame in &shown.frames {
        let name = super::frames::name(frame);
        let number = frame.frame;
        let _ = write!(html, "<th class=\"span\" colspan=\"2\">{name} ({number})</th>");
    }
    html += "</tr>\n<tr>";
    for _ in &shown.frames {
        html += "<th class=\"number\">True</th><th class=\"number\">Decoded</th>";
    }
    html += "</tr></thead>\n<tbody>\n";
    for (column, output) in shown.outputs.iter().enumerate().take(MOST_OUTPUTS) {
        let name = escape(&with_unit(&symbol(&output.name), &output.unit));
        let places = decimals(output.rmse, 2);
        let lines = shown.frames.iter().flat_map(|frame| [&frame.truth, &frame.estimate]);
        html += &line(&name, lines.map(|line| fixed(line[column], places)));
    }
    html += "</tbody>\n</table>\n";
    match shown.outputs.len().saturating_sub(MOST_OUTPUTS) {
        0 => html,
        more => html + &format!("<p class=\"note\">{more} more outputs are not listed.</p>\n"),
    }
}

/// Table of RMSE by depth or force of the contact (lines) and output (columns), of the centroid below the model's.
pub fn by_load(ranges: &[LoadErrors]) -> String {
    let groups = ranges.first().map_or(&[][..], |range| &range.errors);
    let heads = std::iter::once("Frames".into()).chain(groups.iter().map(name));
    let of = |head: &str, frames: String, errors: &[Errors]| {
        let errors = errors.iter().map(|errors| significant(errors.rmse, 3));
        line(&escape(head), std::iter::once(frames).chain(errors))
    };
    let lines = ranges.iter().map(|range| {
        let own = of(&range.range(), grouped(range.frames), &range.errors);
        if range.centroid.is_empty() {
            return own;
        }
        own + &of("centroid", String::new(), &range.centroid)
    });
    format!(
        "<table>\n<thead><tr><th>Range</th>{}</tr></thead>\n<tbody>\n{}</tbody>\n</table>\n",
        numbers("th", heads),
        lines.collect::<String>()
    )
}

/// Whether the model has a confidence, which tells what is novel.
pub fn knows_novel(others: &Others) -> bool {
    others.own_percent_novel.is_some()
}

/// Table of errors on contacts that the model was not trained on, below those on its own.
pub fn others(others: &Others, decoders: &[DecoderErrors]) -> String {
    let [own, own_mean] = [NETWORK, mean::NAME].map(|name| metrics::of_decoder(decoders, name));
    let heads = own.iter().flat_map(|group| [name(group), "R²".into(), "Mean".into()]);
    let of = |label: &str, errors: &[Errors], mean: &[Errors], novel: Option<f64>| {
        let cells = errors.iter().zip(mean).flat_map(|(errors, mean)| {
            let decimals = rmse_decimals(decoders, &errors.group);
            let r_squared = errors.r_squared.map_or(UNDEFINED.into(), |it| fixed(it, 2));
            [fixed(errors.rmse, decimals), r_squared, fixed(mean.rmse, decimals)]
        });
        let novel = knows_novel(others)
            .then(|| novel.map_or(UNDEFINED.into(), |percent| fixed(percent, 1)));
        line(&escape(label), cells.chain(novel))
    };
    let own = of("As trained", own, own_mean, others.own_percent_novel);
    let contacts = others.contacts.iter();
    let lines = contacts.map(|it| of(&it.name, &it.errors, &it.mean, it.percent_novel));
    format!(
        "<table>\n<thead><tr><th>Contact</th>{}</tr></thead>\n<tbody>\n{own}{}</tbody>\n</table>\n",
        numbers("th", heads.chain(knows_novel(others).then(|| "Novel, %".into()))),
        lines.collect::<String>()
    )
}

/// List of the formulas of the definitions that have a column.
pub fn legend(decoders: &[DecoderErrors]) -> String {
    let shown = defined(decoders);
    let formulas: Vec<String> =
        shown.iter().map(|it| format!("<li>{}</li>", escape(it.formula()))).collect();
    let formulas = formulas.concat();
    let thickness = if shown.contains(&Definition::PositionalPercent) {
        "; H is the thickness of the sensor"
    } else {
        ""
    };
    format!(
        "<ul class=\"formulas\">{formulas}</ul>\n<p class=\"note\">e = decoded − true; Δ stands for the true \
         output{thickness}. “{UNDEFINED}”: not defined.</p>\n"
    )
}

/// Caption of [`table1`].
pub fn table1_caption(table: &Table1, nearest: &Comparison) -> String {
    format!(
        "Error of Δz by spread and noise level: {}. Network with K = {}. Below each cell is the paper's, which states no \
         formula; by this one the cells are nearest to it. Cells marked † are no better than always predicting the \
         training mean.",
        escape(&nearest.formula),
        table.centres
    )
}

/// Table of errors by spread (lines) and noise level (columns), by the formula that is `nearest` to the printed table.
pub fn table1(nearest: &Comparison) -> String {
    let cell = |percent: f64| format!("{percent:.2}\u{a0}%");
    let mut html = format!(
        "<table class=\"compact\">\n<thead><tr><th rowspan=\"2\">Spread</th>\
         <th class=\"span\" colspan=\"{}\">Noise level</th></tr>\n<tr>{}</tr></thead>\n<tbody>\n",
        NOISE_LEVELS.len(),
        numbers("th", NOISE_LEVELS.into_iter().map(percent))
    );
    for ((spread, cells), printed) in SPREADS.into_iter().zip(&nearest.cells).zip(&CELLS) {
        let _ = write!(html, "<tr><th scope=\"row\">{spread:?}</th>");
        for ((found, mean), printed) in cells.iter().zip(nearest.mean_percent).zip(printed) {
            let (class, mark) = if *found >= mean {
                (" poor", "<span class=\"dagger\">†</span>")
            } else {
                ("", "")
            };
            let _ = write!(
                html,
                "<td class=\"number{class}\">{}{mark}<small>paper {}</small></td>",
                cell(*found),
                cell(*printed)
            );
        }
        html += "</tr>\n";
    }
    html += "</tbody>\n<tbody class=\"reference\">\n";
    html + &line("Mean", nearest.mean_percent.into_iter().map(cell)) + "</tbody>\n</table>\n"
}

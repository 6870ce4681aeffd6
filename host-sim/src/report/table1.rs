//! Table 1 of the paper: errors by spread and noise, and the printed cells beside them.

use serde_json::json;
use taxel_data::columns;
use taxel_learn::decoders::{mean, standard};
use taxel_simulate::noise::NoiseKind;

use super::sections::{Digits, Sections, Table, TableOf, number_value};
use taxel_evaluate::metrics::{Definition, Errors};
use taxel_evaluate::table1::printed::{self, CELLS, NOISE_LEVELS, Nearness, SPREADS};
use taxel_evaluate::table1::{Comparison, Entry, NETWORK, Table1};

/// Values of Table 1, which programs read.
pub fn values(table: &Table1) -> Sections {
    let mut sections = Sections::default();
    sections.value("centres", &table.centres);
    sections.value("noise_kind", &table.noise_kind);
    sections.value("training_frames", &table.training_frames);
    sections.value("test_frames", &table.test_frames);
    sections.value("standard_frames", &table.standard_frames);
    sections.value("solver", &table.solver);
    sections.value("errors", &all_errors(table));
    let limits = TableOf::new(&table.columns, "")
        .values("noise_level", |column| number_value(Some(column.noise_level)))
        .values("limit", |column| json!(column.limit));
    sections.rows("limits", limits);
    sections.rows("comparison", nearness_table(&nearness(&table.comparison)));
    sections
}

/// Text of a CSV file with all errors.
pub fn csv(table: &Table1) -> String {
    all_errors(table).csv()
}

/// Errors of all decoders and groups of outputs by every definition, beside the printed cells.
fn all_errors(table: &Table1) -> Table {
    let entries = table
        .columns
        .iter()
        .flat_map(|column| column.decoders.iter().map(move |entry| (column.noise_level, entry)));
    let rows: Vec<(f64, &Entry, &Errors)> = entries
        .flat_map(|(level, entry)| entry.errors.iter().map(move |errors| (level, entry, errors)))
        .collect();
    let is_along_z = |errors: &Errors| columns::is_compression(&errors.group);
    let mut cells = TableOf::new(&rows, "")
        .values("noise_level", |row| number_value(Some(row.0)))
        .values("decoder", |row| row.1.decoder.as_str().into())
        .values("spread", |row| number_value(row.1.spread))
        .values("group", |row| row.2.group.as_str().into())
        .values("unit", |row| row.2.unit.as_str().into())
        .values("count", |row| row.2.count.into());
    for definition in Definition::ALL {
        cells = cells.values(definition.name, |row| number_value(definition.of(row.2)));
    }
    cells
        .values("ratio_standard_error", |row| number_value(row.2.ratio_standard_error))
        .values("largest_positional_percent", |(_, entry, errors)| {
            number_value(entry.largest_positional_percent.filter(|_| is_along_z(errors)))
        })
        .values("printed_percent", |(level, entry, errors)| {
            let is_printed = !table.comparison.is_empty() && is_along_z(errors);
            let spread = entry.spread.filter(|_| is_printed && entry.decoder == NETWORK);
            number_value(spread.and_then(|spread| printed::cell(spread, *level)))
        })
        .table()
}

/// Sections of Table 1: the errors of a `group` of outputs by every definition.
pub fn sections(subject: &str, table: &Table1, group: &str) -> Sections {
    let mut sections = Sections::new(format!("Table 1, {subject}: {group}"));
    sections.extend(values(table));
    sections.note(format!(
        "K = {}, {} training and {} test frames, weights by {}. In brackets: the standard network, K = N = {}.",
        table.centres,
        table.training_frames,
        table.test_frames,
        if table.solver == "rls" { "recursive least squares" } else { "QR decomposition" },
        table.standard_frames
    ));
    for definition in Definition::ALL {
        errors(&mut sections, table, definition, group);
    }
    for column in &table.columns {
        let noise = table.noise_kind.in_words(column.noise_level);
        sections.note(format!("Noise {noise}: {}", column.limit.note()));
    }
    if let Some(nearest) = table.nearest_formula() {
        compare(&mut sections, &table.comparison, nearest);
    }
    sections
}

/// Adds the errors by one definition, if it has any: of networks by spread, then of baselines.
fn errors(sections: &mut Sections, table: &Table1, definition: Definition, group: &str) {
    let of =
        |errors: &[Errors]| errors.iter().find(|e| e.group == group).and_then(|e| definition.of(e));
    if table.columns.iter().all(|column| of(column.errors(mean::NAME, None)).is_none()) {
        return;
    }
    let spreads =
        table.columns[0].spreads().map(|it| (format!("network, spread {it:?}"), NETWORK, Some(it)));
    let baselines =
        table.columns[0].baselines().map(|it| (it.decoder.clone(), it.decoder.as_str(), None));
    let rows: Vec<_> = spreads.chain(baselines).collect();
    let caption = definition.in_words();
    let digits = Digits::of(&definition);
    let mut cells = TableOf::new(&rows, caption).names("decoder", "decoder", |row| row.0.clone());
    for column in &table.columns {
        let noise = format!("{} noise", table.noise_kind.in_words(column.noise_level));
        cells = cells.texts(&noise, &noise, |(_, decoder, spread)| {
            let own = digits.text(of(column.errors(decoder, *spread)));
            let standard = spread.map(|_| of(column.errors(standard::NAME, *spread)));
            standard.map_or(own.clone(), |it| format!("{own} ({})", digits.text(it)))
        });
    }
    sections.table(cells);
}

/// Adds the printed cells beside the computed ones, by the formula that is `nearest`, and how near every formula comes.
pub fn compare(sections: &mut Sections, by_formula: &[Comparison], nearest: &Comparison) {
    let mut rows: Vec<(String, Vec<String>)> = vec![];
    for ((spread, line), printed) in SPREADS.iter().zip(&nearest.cells).zip(&CELLS) {
        let pairs = line.iter().zip(printed).map(|(a, b)| format!("{a:.2} / {b:.2}"));
        rows.push((format!("spread {spread:?}"), pairs.collect()));
    }
    rows.push(("mean".into(), nearest.mean_percent.iter().map(|it| format!("{it:.2}")).collect()));
    let caption = format!(
        "As printed in the paper, for z. The paper does not state its formula; the nearest is {}: computed / printed, %.",
        nearest.formula
    );
    let mut cells =
        TableOf::new(&rows, caption).names("decoder", "decoder", |(name, _)| name.clone());
    for (place, level) in NOISE_LEVELS.into_iter().enumerate() {
        let noise = format!("{} noise", NoiseKind::Relative.in_words(level));
        cells = cells.texts(&noise, &noise, |(_, line)| line[place].clone());
    }
    sections.table(cells);
    sections.table(nearness_table(&nearness(by_formula)));
}

/// How near the table comes to the printed one by each formula, and a table of equal cells.
fn nearness(by_formula: &[Comparison]) -> Vec<(&str, Nearness)> {
    if by_formula.is_empty() {
        return vec![];
    }
    let formulas = by_formula.iter().map(|it| (it.formula, it.nearness));
    [("a constant", Nearness::of_a_constant())].into_iter().chain(formulas).collect()
}

fn nearness_table<'r>(rows: &'r [(&'r str, Nearness)]) -> TableOf<'r, (&'r str, Nearness)> {
    let caption = "Distance of each formula from the printed cells. Gap: root of the mean square over all cells, in points. docs/paper.md lists open questions.";
    TableOf::new(rows, caption)
        .names("formula", "formula", |(name, _)| (*name).into())
        .numbers("gap", "gap", "", Digits::Decimals(2), |(_, it)| Some(it.gap))
        .numbers("correlation", "correlation", "", Digits::Decimals(2), |(_, it)| it.correlation)
}

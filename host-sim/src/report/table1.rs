//! Table 1 of the paper: errors by spread and noise, and the printed cells beside them.

use taxel_learn::decoders::{mean, standard};
use taxel_simulate::noise::NoiseKind;

use super::sections::{Digits, Sections, TableOf};
use taxel_evaluate::metrics::{Definition, Errors};
use taxel_evaluate::table1::printed::{CELLS, NOISE_LEVELS, Nearness, SPREADS};
use taxel_evaluate::table1::{Comparison, NETWORK, Table1};

/// Sections of Table 1: the errors of a `group` of outputs by every definition.
pub fn sections(subject: &str, table: &Table1, group: &str) -> Sections {
    let mut sections = Sections::new(format!("Table 1, {subject}: {group}"));
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
        "As the paper prints it, for z. It does not state its formula; nearest is {}: computed / printed, %.",
        nearest.formula
    );
    let mut cells =
        TableOf::new(&rows, caption).names("decoder", "decoder", |(name, _)| name.clone());
    for (place, level) in NOISE_LEVELS.into_iter().enumerate() {
        let noise = format!("{} noise", NoiseKind::Relative.in_words(level));
        cells = cells.texts(&noise, &noise, |(_, line)| line[place].clone());
    }
    sections.table(cells);
    let constant = ("a constant".to_owned(), Nearness::of_a_constant());
    let formulas = by_formula.iter().map(|it| (it.formula.clone(), it.nearness));
    let rows: Vec<(String, Nearness)> = [constant].into_iter().chain(formulas).collect();
    let caption = "How near each formula comes. Gap: root of the mean square over all cells, in points. docs/paper.md says what is open.";
    let table = TableOf::new(&rows, caption)
        .names("formula", "formula", |(name, _)| name.clone())
        .numbers("gap", "gap", "", Digits::Decimals(2), |(_, it)| Some(it.gap))
        .numbers("correlation", "correlation", "", Digits::Decimals(2), |(_, it)| it.correlation);
    sections.table(table);
}

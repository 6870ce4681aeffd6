//! Command `table1`: the paper's Table 1, by every definition of error.

use std::path::PathBuf;

use super::progress::Terminal;
use crate::Result;
use crate::evaluate::printed::{CELLS, NOISE_LEVELS, Nearness, SPREADS};
use crate::evaluate::table1::{self, Comparison, NETWORK, Table1};
use crate::metrics::{Definition, Errors};
use crate::report::{Digits, Sections, TableOf};
use clap::Args;
use serde::Serialize;
use taxel_data::output;
use taxel_learn::decoders::{mean, standard};
use taxel_simulate::noise::NoiseKind;

use super::scene_argument::{RelativeInputsArgument, SceneArgument, group_of_scene};
use super::{Common, print};

/// Compute the paper's Table 1: errors by spread and noise.
///
/// Every definition of error is given. The K-centre network is compared with the training mean, the best
/// linear decoder, the paper's standard network (K = N), and the 40 cells that the paper prints.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim table1 paper -o table1.csv
  host-sim table1 paper-as-printed")]
pub struct Arguments {
    /// A built-in scene (paper, paper-as-printed) or the path of a scene file with [table1].
    #[arg(default_value = "paper")]
    scene: String,
    #[command(flatten)]
    relative_inputs: RelativeInputsArgument,
    /// CSV file to write, with all axes, decoders and definitions.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Outputs to print, such as dz_mm or dx_mm.
    #[arg(long, value_name = "GROUP", default_value = "dz_mm")]
    group: String,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    seed: u64,
    #[serde(flatten)]
    table: Table1,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let argument = SceneArgument::new(&arguments.scene);
    let mut scene = argument.load(common)?;
    arguments.relative_inputs.apply(&mut scene);
    if scene.table1.is_some() {
        group_of_scene(&scene, &arguments.group)?;
    }
    if let Some(path) = &arguments.output {
        print::check_output(path, &[argument.path()])?;
    }
    let table = table1::compute(&scene, &Terminal::new())?;
    if let Some(path) = &arguments.output {
        output::write_bytes(path, table.to_csv().as_bytes())?;
    }
    if common.json {
        return print::json(&Summary { subject: scene.name, seed: scene.world.seed, table });
    }
    print::Page::of(sections(&scene.name, &table, &arguments.group).text().trim_end()).print()
}

fn sections(subject: &str, table: &Table1, group: &str) -> Sections {
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
    let mut cells = TableOf::new(&rows, definition.formula()).names("decoder", |row| row.0.clone());
    for column in &table.columns {
        let noise = table.noise_kind.in_words(column.noise_level);
        cells = cells.texts(&format!("{noise} noise"), "", |(_, decoder, spread)| {
            let own = number(definition, of(column.errors(decoder, *spread)));
            let standard = spread.map(|_| of(column.errors(standard::NAME, *spread)));
            standard.map_or(own.clone(), |it| format!("{own} ({})", number(definition, it)))
        });
    }
    sections.table(cells);
}

/// Adds the printed cells beside the computed ones, by the formula that is `nearest`, and how near every formula comes.
fn compare(sections: &mut Sections, by_formula: &[Comparison], nearest: &Comparison) {
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
    let mut cells = TableOf::new(&rows, caption).names("decoder", |(name, _)| name.clone());
    for (place, level) in NOISE_LEVELS.into_iter().enumerate() {
        let noise = NoiseKind::Relative.in_words(level);
        cells = cells.texts(&format!("{noise} noise"), "", |(_, line)| line[place].clone());
    }
    sections.table(cells);
    let constant = ("a constant".to_owned(), Nearness::of_a_constant());
    let formulas = by_formula.iter().map(|it| (it.formula.clone(), it.nearness));
    let rows: Vec<(String, Nearness)> = [constant].into_iter().chain(formulas).collect();
    let caption = "How near each formula comes. Gap: root of the mean square over all cells, in points. docs/paper.md says what is open.";
    let table = TableOf::new(&rows, caption)
        .names("formula", |(name, _)| name.clone())
        .numbers("gap", "", Digits::Decimals(2), |(_, it)| Some(it.gap))
        .numbers("correlation", "", Digits::Decimals(2), |(_, it)| it.correlation);
    sections.table(table);
}

fn number(definition: Definition, value: Option<f64>) -> String {
    match (value, definition) {
        (None, _) => "-".into(),
        (Some(v), _) if v.abs() >= 1e4 => format!("{v:.1e}"),
        (Some(v), Definition::RatioToLimit) => format!("{v:.3}"),
        (Some(v), Definition::Rmse | Definition::RSquared) => format!("{v:.4}"),
        (Some(v), _) => format!("{v:.2}"),
    }
}

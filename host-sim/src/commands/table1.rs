//! Command `table1`: the paper's Table 1, by every definition of error.

use std::path::PathBuf;

use super::progress::Terminal;
use crate::Result;
use crate::evaluate::printed::{CELLS, NOISE_LEVELS, Nearness, SPREADS};
use crate::evaluate::table1::{self, Comparison, Entry, NETWORK, Table1};
use crate::metrics::{Definition, Errors};
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
    page_of(&table, &arguments.group).print()
}

fn page_of(table: &Table1, group: &str) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{group}: K = {}, {} training and {} test frames, weights by {}\n\
         (in brackets: the standard network, K = N = {})",
        table.centres,
        table.training_frames,
        table.test_frames,
        if table.solver == "rls" { "recursive least squares" } else { "QR decomposition" },
        table.standard_frames
    ));
    for definition in Definition::ALL {
        let of = |errors: &[Errors]| {
            errors.iter().find(|e| e.group == group).and_then(|e| definition.of(e))
        };
        if table.columns.iter().all(|column| of(column.errors(mean::NAME, None)).is_none()) {
            continue;
        }
        page.line(format_args!("\n{}", definition.formula()));
        let kind = table.noise_kind;
        let levels = table.columns.iter().map(|c| format!("{:>20}", kind.in_words(c.noise_level)));
        page.line(format_args!("{:<16}{}", "noise", levels.collect::<String>()));
        for spread in table.columns[0].spreads() {
            let cells = table.columns.iter().map(|column| {
                let of_decoder = |name| of(column.errors(name, Some(spread)));
                format!(
                    "{:>9} {:>10}",
                    number(definition, of_decoder(NETWORK)),
                    format!("({})", number(definition, of_decoder(standard::NAME)))
                )
            });
            page.line(format_args!("spread {spread:<9?}{}", cells.collect::<String>()));
        }
        for Entry { decoder, .. } in table.columns[0].baselines() {
            let cells = table.columns.iter().map(|column| {
                let value = of(column.errors(decoder, None));
                format!("{:>9}{:11}", number(definition, value), "")
            });
            page.line(format_args!("{decoder:<16}{}", cells.collect::<String>().trim_end()));
        }
    }
    page.line("");
    for column in &table.columns {
        page.line(format_args!(
            "noise {}: {}",
            table.noise_kind.in_words(column.noise_level),
            column.limit.note()
        ));
    }
    if let Some(nearest) = table.nearest_formula() {
        compare(&mut page, &table.comparison, nearest);
    }
    page
}

/// Adds the printed cells beside the computed ones, by the formula that is `nearest`, and how near every formula comes.
fn compare(page: &mut print::Page, by_formula: &[Comparison], nearest: &Comparison) {
    page.line(format_args!(
        "\nAs the paper prints it, for z. It does not state its formula; nearest is {}, computed / printed, %:",
        nearest.formula
    ));
    let levels = NOISE_LEVELS.map(|level| format!("{:>18}", NoiseKind::Relative.in_words(level)));
    page.line(format_args!("{:<10}{}", "noise", levels.concat()));
    for ((spread, line), printed) in SPREADS.iter().zip(&nearest.cells).zip(&CELLS) {
        let pairs =
            line.iter().zip(printed).map(|(a, b)| format!("{:>18}", format!("{a:.2} / {b:.2}")));
        page.line(format_args!("spread {spread:?}{}", pairs.collect::<String>()));
    }
    let mean = nearest.mean_percent.map(|it| format!("{it:>18.2}"));
    page.line(format_args!("{:<10}{}", "mean", mean.concat()));
    page.line(format_args!("\n{:<26} {:>11} {:>12}", "formula", "gap, points", "correlation"));
    let mut line = |name: &str, nearness: &Nearness| {
        let correlation = nearness.correlation.map_or("-".into(), |it| format!("{it:.2}"));
        page.line(format_args!("{name:<26} {:>11.2} {correlation:>12}", nearness.gap));
    };
    line("a constant", &Nearness::of_a_constant());
    for it in by_formula {
        line(&it.formula, &it.nearness);
    }
    page.line("gap: root of the mean square over all cells. docs/paper.md says what is open.\n");
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

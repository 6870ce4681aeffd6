//! Command `table1`: the paper's Table 1, by every definition of error.

use std::path::PathBuf;

use super::progress::Terminal;
use clap::Args;
use host_sim::evaluate::table1::{self, Entry, NETWORK, PAPER_PRINTED_PERCENT, Printed, Table1};
use host_sim::metrics::{Definition, Errors};
use host_sim::{Error, Result};
use serde::Serialize;
use taxel_data::data_file::DataFile;
use taxel_data::{columns, output};
use taxel_learn::decoders::{mean, standard};
use taxel_simulate::sensor::Precision;

use super::scene_argument::{RelativeInputsArgument, SceneArgument};
use super::{Common, arguments, print};

/// Compute the paper's Table 1: errors by spread and noise.
///
/// Every definition of error is given. The K-centre network is compared with the training mean, the best
/// linear decoder and the paper's standard network (K = N).
#[derive(Args)]
#[command(after_help = "Example: host-sim table1 paper -o table1.csv")]
pub struct Arguments {
    /// A built-in scene (paper, press) or the path of a scene file.
    #[arg(default_value = "paper")]
    scene: String,
    /// Precision of the sensor's readings, instead of the scene's.
    #[arg(long, value_parser = arguments::precision())]
    precision: Option<Precision>,
    #[command(flatten)]
    relative_inputs: RelativeInputsArgument,
    /// CSV file to write, with all axes, decoders and definitions.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// CSV file of the paper's printed cells, to be listed and stored with the computed ones (columns
    /// spread, noise_level as a fraction, percent).
    #[arg(long, value_name = "FILE")]
    printed: Option<PathBuf>,
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
    let argument = SceneArgument::new(&arguments.scene, arguments.precision);
    let mut scene = argument.load(common)?;
    arguments.relative_inputs.apply(&mut scene);
    let names = scene.world.output_names();
    let groups: Vec<&str> = columns::groups(&names).into_iter().map(|(group, _)| group).collect();
    if scene.table1.is_some() && !groups.contains(&arguments.group.as_str()) {
        let message = format!("--group {}: the scene has {}", arguments.group, groups.join(", "));
        return Err(Error::Usage(message));
    }
    if let Some(path) = &arguments.output {
        let printed = arguments.printed.as_deref().unwrap_or(argument.path());
        print::check_output(path, &[argument.path(), printed])?;
    }
    let printed = match &arguments.printed {
        Some(path) => Printed::from_file(&DataFile::read(path)?)?,
        None => Vec::new(),
    };
    let mut table = table1::compute(&scene, &Terminal::new())?;
    table.printed = printed;
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
        "{group}: K = {}, affine tail: {}, {} training and {} test frames, weights by {}\n\
         (in brackets: the standard network, K = N = {})",
        table.centres,
        if table.affine_tail { "yes" } else { "no" },
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
        let levels = table.columns.iter().map(|c| format!("{:>20}", percent(c.noise_level)));
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
        page.line(format_args!("noise {}: {}", percent(column.noise_level), column.limit.note()));
    }
    if !table.printed.is_empty() {
        page.line("\nas the paper prints it, for z, %");
        for Printed { spread, noise_level, percent: printed } in &table.printed {
            let noise = percent(*noise_level);
            page.line(format_args!("spread {spread:<9} noise {noise:<8} {printed}"));
        }
    }
    let [low, high] = PAPER_PRINTED_PERCENT;
    page.line(format_args!(
        "\nThe paper prints {low} to {high} % for z and \
         does not state its definition; docs/paper.md compares."
    ));
    for group in table.groups() {
        if let Some(ratio) = table.worst_ratio_to_mean(group) {
            page.line(format_args!(
                "{group}: the worst cell's RMSE is {ratio:.3} × that of the mean"
            ));
        }
    }
    page
}

fn percent(level: f64) -> String {
    format!("{} %", (level * 1e6).round() / 1e4)
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

//! Command `table1`: the paper's Table 1, by every definition of error.

use std::path::PathBuf;

use super::progress::Terminal;
use crate::Result;
use crate::experiment::Experiment;
use crate::report;
use clap::Args;
use serde::Serialize;
use taxel_data::output;
use taxel_evaluate::table1::{self, Table1};

use super::scene_argument::{SceneArgument, group_of_scene};
use super::{Common, print};

/// Compute the paper's Table 1: errors by spread and noise.
///
/// Every definition of error is given. The K-centre network is compared with the training mean, the best
/// linear decoder, the paper's standard network (K = N), and the 40 cells that the paper prints.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel table1 paper -o table1.csv
  taxel table1 paper-as-printed")]
pub struct Arguments {
    /// A built-in scene (paper, paper-as-printed) or the path of a scene file with [table1].
    #[arg(default_value = "paper")]
    scene: String,
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

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let argument = SceneArgument::new(&arguments.scene);
    let scene = argument.load(common)?;
    if scene.table1.is_some() {
        group_of_scene(&scene, &arguments.group)?;
    }
    if let Some(path) = &arguments.output {
        print::check_output(path, &[argument.path()])?;
    }
    let text = Experiment::text(&arguments.scene)?;
    let table = table1::compute(&scene, &text, &Terminal::new(common))?;
    if let Some(path) = &arguments.output {
        output::write_bytes(path, table.to_csv().as_bytes())?;
    }
    if common.json {
        return print::json(
            common,
            &Summary { subject: scene.name, seed: scene.world.seed, table },
        );
    }
    let text = report::of_table1(&scene.name, &table, &arguments.group).text();
    Ok(print::Page::of(text.trim_end()).outcome())
}

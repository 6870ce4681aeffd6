//! Command `table1`: the paper's Table 1, by every definition of error.

use super::progress::Terminal;
use crate::{Result, report};
use clap::Args;
use taxel_evaluate::table1;

use super::scene_argument::{SceneArgument, group_of_scene};
use super::{Common, arguments, print};

/// Compute the paper's Table 1: errors by spread and noise.
///
/// Every definition of error is printed. The K-centre network is compared with the training mean, the best linear
/// decoder, the paper's standard network (K = N), and the 40 cells that the paper prints. -o writes a CSV file with all
/// outputs, decoders and definitions.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel table1 paper -o table1.csv
  taxel table1 paper-as-printed")]
pub struct Arguments {
    /// A built-in scene (paper, paper-as-printed) or the path of a scene file with [table1].
    #[arg(default_value = "paper")]
    scene: String,
    #[command(flatten)]
    to: arguments::WantedFile,
    /// Outputs to print, such as dz_mm or dx_mm.
    #[arg(long, value_name = "GROUP", default_value = "dz_mm")]
    group: String,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let argument = SceneArgument::new(&arguments.scene);
    let scene = argument.load(common)?;
    if scene.table1.is_some() {
        group_of_scene(&scene, &arguments.group)?;
    }
    arguments.to.check(&[argument.path()])?;
    let table = table1::compute(&scene, &Terminal::new(common))?;
    arguments.to.write(report::table1_csv(&table).as_bytes())?;
    let mut sections = report::of_table1(&scene.name, &table, &arguments.group);
    sections.value("subject", &scene.name);
    sections.value("seed", &scene.world.seed);
    Ok(print::sections(common, &sections))
}

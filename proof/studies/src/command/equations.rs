//! Study `equations`: the sensor's equations as a decoder.

use crate::equations::{DAMPED, EXACT};
use crate::picture;
use crate::question::equations::{self, EquationsResult, Plan, RowWire};
use clap::Args;
use host_sim::Result;
use host_sim::metrics::NETWORK;
use taxel_learn::decoders::{linear, mean};

use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::SceneArgument;
use host_sim::commands::{Common, print};

use super::Picture;

/// Solve the sensor's equations for each row's deformation, without training, by noise.
///
/// Equation 6 of the paper has as many unknowns as readings: `equations` solves it exactly, from rest, by damped Newton
/// steps in f64. `damped` stops where readings are met within their noise, and knows mean and covariance of the scene's
/// deformations. Beside them stand the scene's network, the best linear decoder, the mean, and the limit. So what the
/// sensor loses is told from what a network loses (docs/what-the-sensor-knows.md).
#[derive(Args)]
#[command(after_help = "Examples:
  cargo xtask study equations paper -o equations.svg
  cargo xtask study equations press --json")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    /// Test frames [default: 60].
    #[arg(short = 'n', long, value_name = "N")]
    frames: Option<usize>,
    #[command(flatten)]
    picture: Picture,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        self.picture.check(self.scene.path())?;
        let scene = self.scene.load(common)?;
        let default = Plan::default();
        let plan = Plan { frames: self.frames.unwrap_or(default.frames), ..default };
        let result = equations::study(&scene, plan, &Terminal::new())?;
        self.picture.write(|| picture::equations_svg(&result))?;
        super::show(common, &result, page_of)
    }
}

fn page_of(result: &EquationsResult) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} rows of {} test frames, seed {}; networks by K-means on {} frames",
        result.subject, result.rows, result.frames, result.seed, result.training_frames
    ));
    let decoders = [EXACT, DAMPED, NETWORK, linear::NAME, mean::NAME];
    super::errors_by_noise(&mut page, &result.levels, &decoders);
    let solved = result.levels.iter().map(|level| format!("{:>10.1}", level.percent_solved));
    page.line(format_args!("\n{:<18}{}", "solved exactly, %", solved.collect::<String>()));
    page.line("All rows count: one without a solution has the last place of the search, in the box of 20 % of H.");
    super::refusals(&mut page, &result.levels);
    page.line(format_args!(
        "\nWithout noise, % of the rows, by row-wire ({} more searches a row for deformations that read alike)",
        result.searches
    ));
    page.line(format_args!(
        "{:>8} {:>8} {:>8} {:>9} {:>9} {:>9} {:>10} {:>6} {:>12} {:>8}",
        "row",
        "truth",
        "another",
        "unsolved",
        "reached",
        "z < 1e-6",
        "ambiguous",
        "most",
        "any decoder",
        "turned"
    ));
    for row in &result.without_noise {
        page.line(line_of(&row.row_wire.to_string(), row));
    }
    if let Some(all) = result.all_rows() {
        page.line(line_of("all", &all));
    }
    page.line(
        "truth: solved to the true deformation; another: to one that reads alike; reached: to the truth by any search;\n\
         z < 1e-6: off by less, in mm, at every electrode; ambiguous: several deformations within the scene's ranges\n\
         read alike, `most` of one row; any decoder: rows that the best choice among these gets right;\n\
         turned: the determinant of ∂ln R/∂Δ has not the sign that it has at rest.",
    );
    page
}

fn line_of(name: &str, row: &RowWire) -> String {
    let optional = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.1}"));
    format!(
        "{name:>8} {:>8.1} {:>8.1} {:>9.1} {:>9.1} {:>9.1} {:>10.1} {:>6} {:>12} {:>8}",
        row.percent_true,
        row.percent_other,
        row.percent_unsolved,
        row.percent_reached,
        row.percent_z_exact,
        row.percent_ambiguous,
        row.most_alike,
        optional(row.percent_any_decoder),
        optional(row.percent_turned)
    )
}

//! Study `widths`: what a width for each centre gains over one for all.

use crate::question::widths::{self, Gain, Model, Plan, WidthsStudy};
use clap::Args;
use host_sim::{Error, Result};

use host_sim::commands::arguments::of_option;
use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::{
    NoiseArgument, SceneArgument, group_of_scene, read_one_row,
};
use host_sim::commands::{Common, print};

/// Compare a width for each centre (by its neighbours) with one for all.
///
/// Trains both rules by K-means alone and refined, for each K, and judges them on fresh frames. Other frames choose the
/// best spread of each rule. A width for each centre needs the format f32-direct; one for all is tried in f32 and in
/// fixed16 (docs/training.md).
#[derive(Args)]
#[command(after_help = "Example: cargo xtask study widths press --row 4")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Row-wire (from 1) that is read.
    #[arg(long, value_name = "ROW", default_value_t = 4)]
    row: usize,
    #[command(flatten)]
    plan: Plan,
    /// Outputs whose error is shown, such as dz_mm.
    #[arg(long, value_name = "GROUP", default_value = "dz_mm")]
    group: String,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        let mut scene = self.scene.load(common)?;
        self.noise.apply(&mut scene)?;
        read_one_row(&mut scene, self.row)?;
        group_of_scene(&scene, &self.group)?;
        let study = widths::compute(&scene, &self.group, &self.plan, &Terminal::new());
        let study = study.map_err(|error| match error {
            Error::Data(taxel_data::Error::Setting(bad)) => {
                let options = ["spreads", "spread"].map(|field| (field, "--spread"));
                of_option(bad, &[&options[..], &[("centres", "--centres")]].concat())
            }
            other => other,
        })?;
        super::show(common, &study, page_of)
    }
}

fn page_of(study: &WidthsStudy) -> print::Page {
    let mut page = print::Page::default();
    let rows: Vec<String> = study.row_wires.iter().map(usize::to_string).collect();
    page.line(format_args!(
        "{}: {} noise, row {}, seed {}, {} training and {} test frames\n",
        study.subject,
        print::percent(study.noise_level),
        rows.join(", "),
        study.seed,
        study.training_frames,
        study.test_frames
    ));
    let heading = format!("RMSE of {}, {}", study.group, study.unit);
    page.line(format_args!(
        "{:<9} {:>4}  {:<10} {:<10} {:>6}  {:<12} {heading:>18} {:>8} {:>7} {:>8}",
        "training", "K", "widths", "format", "spread", "from … to", "× limit", "bytes", "cycles"
    ));
    study.models.iter().for_each(|model| page.line(model_line(model)));
    page.line(format_args!("{:<57} {:>18.4}\n", "mean", study.mean_rmse));
    page.line("RMSE with a width for each centre, over that with one for all:");
    study.gains.iter().for_each(|gain| page.line(gain_line(gain)));
    print::wrapped(&mut page, &study.limit.note());
    page.line(
        "spread: the best by other frames; refinement starts from it. from … to: widths in the model.\n\
         cycles: of a frame of this row on a Cortex-M4F, at zero wait. mean: always predicting the mean.",
    );
    page
}

fn training(refined: bool) -> &'static str {
    if refined { "refined" } else { "K-means" }
}

fn model_line(model: &Model) -> String {
    let [low, high] = model.width_range;
    let range = format!("{low:.3} … {high:.3}");
    format!(
        "{:<9} {:>4}  {:<10} {:<10} {:>6}  {range:<12} {:>17.4} {:>8} {:>7} {:>8}",
        training(model.refined),
        model.centres,
        model.widths.name(),
        model.format,
        model.spread,
        model.rmse,
        model.ratio_to_limit.map_or("–".into(), |ratio| format!("{ratio:.3}")),
        model.blob_bytes,
        model.cycles
    )
}

fn gain_line(gain: &Gain) -> String {
    let cost = gain.at_equal_cost.map_or("no such model".into(), |ratio| format!("{ratio:.3}"));
    format!(
        "  {:<8} K = {:<4} {:.3} with as many centres; {cost} within the same bytes and cycles",
        training(gain.refined),
        gain.centres,
        gain.at_equal_centres
    )
}

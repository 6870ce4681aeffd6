//! Command `confidence`: how many errors a model's intervals cover, and which frames it finds novel.

use std::path::PathBuf;

use clap::Args;
use host_sim::commands::coverage_page;
use host_sim::evaluate::confidence::{Coverage, coverage};
use host_sim::{Error, Result};
use serde::Serialize;
use taxel_data::random::Stream;
use taxel_learn::Exponential;
use taxel_simulate::Synthesis;

use crate::question::confidence::{Detection, detections};

use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::{self, NoiseArgument, SceneArgument};
use host_sim::commands::{Common, print};

/// Confidence of a scene's model: errors that its intervals cover, and frames that it finds novel.
///
/// Errors are those of test frames. Frames that should be novel have a broken wire, two wires that touch, or two
/// contacts where the scene has one (docs/confidence.md).
#[derive(Args)]
#[command(after_help = "Examples:
  cargo xtask study confidence press
  host-sim train press --whole-array --confidence -o array.bin
  cargo xtask study confidence press --model array.bin")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Test frames, and frames of every anomaly.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 8000)]
    frames: usize,
    /// Weight blob of this scene, trained with --confidence, instead of training one.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    seed: u64,
    model_crc: String,
    frames: usize,
    coverage: Vec<Coverage>,
    detections: Vec<Detection>,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        let mut scene = self.scene.load(common)?;
        scene.require_inverse("confidence")?;
        self.noise.apply(&mut scene)?;
        scene.world.check_frames("--frames", self.frames)?;
        scene.training.confidence = true;
        let blob = scene_argument::model(self.model.as_deref(), &scene, &Terminal::new())?;
        let model = blob.prepare(Exponential::default());
        let own = f64::from(model.model().metadata().noise_level);
        if (own - scene.world.noise.level).abs() > 1e-3 * scene.world.noise.level {
            eprintln!(
                "note: the model was trained for noise of {:.2} %, and is judged at the scene's {:.2} %; see --noise",
                100.0 * own,
                100.0 * scene.world.noise.level
            );
        }
        scene.training.relative_inputs = model.model().metadata().relative_inputs;
        let test = scene.dataset(&Synthesis::new(&scene.world), Stream::Test, self.frames);
        let of_inputs = model.clone().of_inputs();
        let Some((deviations, _)) = of_inputs.assess(&test.inputs.values) else {
            let path = self.model.clone().unwrap_or_default();
            let message = "this model has no confidence: train it with --confidence".into();
            return Err(Error::Unfit { path, message });
        };
        let ratios_95 = model.model().confidence().map_or(&[][..], |it| it.ratios_95());
        let estimates = of_inputs.decode_lines(&test.inputs.values);
        let summary = Summary {
            subject: scene.name.clone(),
            seed: scene.world.seed,
            model_crc: format!("{:08x}", model.model().crc()),
            frames: self.frames,
            coverage: coverage(&test.outputs, &estimates, &deviations, ratios_95),
            detections: detections(&scene, &model, self.frames),
        };
        super::show(common, &summary, page_of)
    }
}

fn page_of(summary: &Summary) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{} test frames of scene {}; intervals should cover 68.3 % and 95 % of the errors",
        summary.frames, summary.subject
    ));
    coverage_page::add(&mut page, &summary.coverage);
    page.line(format_args!("\n{:<58} {:>7} {:>9}", "frames with", "frames", "novel"));
    for Detection { anomaly, frames, percent_novel } in &summary.detections {
        page.line(format_args!("{anomaly:<58} {frames:>7} {percent_novel:>7.2} %"));
    }
    page
}

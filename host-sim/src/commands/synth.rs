//! Command `synth`: frames of a scene as CSV.

use std::path::PathBuf;

use clap::Args;
use host_sim::Result;
use serde::Serialize;
use taxel_data::random::Stream;
use taxel_data::{csv_file, output};
use taxel_simulate::synthesise;

use super::scene_argument::{NoiseArgument, SceneArgument};
use super::{Common, print};

/// Synthesise frames of a scene as CSV: noisy readings, true outputs.
#[derive(Args)]
#[command(
    after_help = "Example: host-sim synth press -n 5000 --seed 2 -o test.csv\n\nA scene's own seed gives the very frames that `train` and `run` train on: evaluate on another."
)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Frames to synthesise.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 1000)]
    frames: usize,
    /// CSV file to write: readings, then outputs, one frame a line.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    frames: usize,
    readings: usize,
    outputs: usize,
    seed: u64,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut scene = arguments.scene.load(common)?;
    arguments.noise.apply(&mut scene)?;
    scene.world.check_frames("-n", arguments.frames)?;
    output::check_writable(&arguments.output, &[arguments.scene.path()])?;
    let dataset = synthesise(&scene.world, Stream::Training, arguments.frames);
    let names = dataset.inputs.names.iter().chain(&dataset.outputs.names).map(String::as_str);
    let lines = dataset.inputs.lines().zip(dataset.outputs.lines());
    let lines = lines.map(|(readings, outputs)| readings.iter().chain(outputs).copied());
    csv_file::write(&arguments.output, names, lines)?;
    let summary = Summary {
        frames: dataset.frames(),
        readings: dataset.inputs.names.len(),
        outputs: dataset.outputs.names.len(),
        seed: scene.world.seed,
        file: arguments.output.clone(),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!(
        "{} frames of {} readings and {} outputs in {}",
        summary.frames,
        summary.readings,
        summary.outputs,
        summary.file.display()
    ));
    page.print()
}

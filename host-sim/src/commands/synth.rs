//! Command `synth`: frames of a scene as CSV.

use std::path::PathBuf;

use crate::verdict::Warning;
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_data::csv_file;
use taxel_data::random::Stream;
use taxel_simulate::Synthesis;

use super::scene_argument::{NoiseArgument, SceneArgument};
use super::{Common, print, stderr};

/// Synthesise frames of a scene as CSV: noisy readings, true outputs.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim synth press -n 5000 --seed 2 -o test.csv
  host-sim synth press -n 100 --seed 2 --untouched -o rest.csv

A scene's own seed gives the very frames that `train` and `run` train on: evaluate on another.")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Frames to synthesise.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 1000)]
    frames: usize,
    /// Leave the sensor untouched: frames of which a baseline is made.
    #[arg(long)]
    untouched: bool,
    /// Multiply all readings by this, as a sensor does whose gain has drifted: 1.02 is 2 % more.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    /// CSV file to write: readings, then outputs, one frame a line.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    frames: usize,
    readings: usize,
    outputs: usize,
    seed: u64,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut scene = arguments.scene.load_world(common)?;
    arguments.noise.apply(&mut scene)?;
    scene.world.check_frames("-n", arguments.frames)?;
    print::check_output(&arguments.output, &[arguments.scene.path()])?;
    if !(arguments.scale.is_finite() && arguments.scale > 0.0) {
        let message = format!("--scale {}: give a positive number, such as 1.02", arguments.scale);
        return Err(Error::Usage(message));
    }
    let mut synthesis = Synthesis::new(&scene.world);
    if arguments.untouched {
        synthesis = synthesis.untouched();
    }
    let mut dataset = synthesis.frames(Stream::Training, arguments.frames);
    dataset.inputs.values.iter_mut().for_each(|reading| *reading *= arguments.scale);
    let names = dataset.inputs.names.iter().chain(&dataset.outputs.names).map(String::as_str);
    let lines = dataset.inputs.lines().zip(dataset.outputs.lines());
    let lines = lines.map(|(readings, outputs)| readings.iter().chain(outputs).copied());
    csv_file::write(&arguments.output, names, lines)?;
    if let Some(warning) = Warning::not_positive(&dataset.inputs) {
        stderr::remark(warning);
    }
    let summary = Summary {
        subject: scene.name.clone(),
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

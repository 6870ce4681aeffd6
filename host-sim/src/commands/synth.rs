//! Command `synth`: frames of a scene as CSV.

use crate::verdict::Warning;
use crate::{Error, Result};
use clap::Args;
use taxel_data::random::Stream;
use taxel_data::{Dataset, csv_file};
use taxel_recording::{Extras, Frame};
use taxel_simulate::Synthesis;
use taxel_simulate::timetable::Timetable;

use super::decoder_arguments::ScanTimeArgument;
use super::recordings::{self, is_recording};
use super::scene_argument::{FrameRateArgument, FramesArgument, NoiseArgument, SceneArgument};
use super::{Common, arguments, print};
use crate::device::{Device, Wires};
use crate::experiment::Experiment;
use crate::live::replay::USUAL_RATE;
use crate::live::sheet;
use crate::report::Sections;

/// Synthesise frames of a scene as CSV (one frame per line: noisy readings, then true outputs) or as a recording (.mcap,
/// docs/live.md).
///
/// A scene whose contacts move (`[motion]`) is written as a log: time_s and trajectory come first, and each row is read
/// at its own time, as the board scans. Trajectories are one second apart, so that a filter restarts with each.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel synth press -n 5000 --seed 2 -o test.csv
  taxel synth press -n 100 --seed 2 --untouched -o rest.csv
  taxel synth moving -n 6000 --frame-rate 1000 --scan-ms 0.9 -o touches.csv
  taxel synth press -n 6000 --untouched --frame-rate 500 -o rest.csv

A scene's own seed gives the frames that `train` and `run` train on: use another seed to evaluate.")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    #[command(flatten)]
    count: FramesArgument,
    /// Synthesise frames of the untouched sensor, for a baseline.
    #[arg(long)]
    untouched: bool,
    /// Synthesise still contacts of a scene whose contacts move, as its model is trained on.
    #[arg(long)]
    still: bool,
    #[command(flatten)]
    rate: FrameRateArgument,
    #[command(flatten)]
    scan: ScanTimeArgument,
    /// Multiply all readings by this factor, like a sensor whose gain has drifted: 1.02 is 2 % more.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    scale: f64,
    #[command(flatten)]
    to: arguments::OutputFile,
}

/// Time between the end of a trajectory and the start of the next one in s.
const PAUSE_S: f64 = 1.0;

impl Arguments {
    /// Times of the scans of a trajectory, if the frames follow one another in time.
    fn timetable(&self, scene: &Experiment) -> Result<Option<Timetable>> {
        let path = scene.world.path.as_ref().filter(|_| !self.still && !self.untouched);
        if path.is_none() && (!self.untouched || self.rate.frame_rate.is_none()) {
            if self.rate.frame_rate.is_some() || self.scan.scan_ms.is_some() {
                let message = "--frame-rate and --scan-ms set times of frames, and still frames have none: use a scene with \
                               [motion], or --untouched with --frame-rate";
                return Err(Error::Usage(message.into()));
            }
            return Ok(None);
        }
        let not_positive = |ms: &f64| !(ms.is_finite() && *ms > 0.0);
        if let Some(ms) = self.scan.scan_ms.filter(not_positive) {
            return Err(Error::Usage(format!("--scan-ms {ms}: give a positive number")));
        }
        let device = Device { scan_ms: self.scan.scan_ms, ..Device::default() };
        let scan_s = device.scan_ms(Some(Wires::of(&scene.world)), 1).unwrap_or_default() / 1000.0;
        let period_s = self.rate.frame_rate.map_or(scan_s, |rate| 1.0 / rate);
        if period_s < scan_s * (1.0 - 1e-9) {
            let most = 1.0 / scan_s;
            let message = format!(
                "--frame-rate {}: a scan takes {:.3} ms; give at most {most:.1}, or a shorter --scan-ms",
                1.0 / period_s,
                scan_s * 1000.0
            );
            return Err(Error::Usage(message));
        }
        let frames = self.count.frames as f64;
        let duration_s = path.map_or(frames * period_s, |path| path.duration_s);
        Ok(Some(Timetable::every(period_s, scan_s, duration_s)?))
    }
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let mut scene = arguments.scene.load_world(common)?;
    arguments.noise.apply(&mut scene)?;
    scene.world.check_frames("-n", arguments.count.frames)?;
    print::check_output(&arguments.to.output, &[arguments.scene.path()])?;
    if !(arguments.scale.is_finite() && arguments.scale > 0.0) {
        let message = format!("--scale {}: give a positive number, such as 1.02", arguments.scale);
        return Err(Error::Usage(message));
    }
    let mut synthesis = Synthesis::new(&scene.world);
    if arguments.untouched {
        synthesis = synthesis.untouched();
    }
    let timetable = arguments.timetable(&scene)?;
    if let Some(timetable) = &timetable {
        let path = scene.world.path.filter(|_| !arguments.untouched);
        synthesis = match path {
            Some(path) => synthesis.along(path, timetable.clone()),
            None => synthesis.timed(timetable.clone()),
        };
    }
    let mut dataset = synthesis.frames(Stream::Training, arguments.count.frames);
    dataset.inputs.values.iter_mut().for_each(|reading| *reading *= arguments.scale);
    if is_recording(&arguments.to.output) {
        return recorded(arguments, &scene, &dataset, timetable.as_ref(), common);
    }
    let names = dataset.inputs.names.iter().chain(&dataset.outputs.names).map(String::as_str);
    let lines = dataset.inputs.lines().zip(dataset.outputs.lines());
    let lines = lines.map(|(readings, outputs)| readings.iter().chain(outputs).copied());
    match &timetable {
        None => csv_file::write(&arguments.to.output, names, lines)?,
        Some(timetable) => {
            let names = ["time_s", "trajectory"].into_iter().chain(names);
            let duration_s = scene.world.path.as_ref().map_or(0.0, |path| path.duration_s);
            let of_frame = |frame: usize| {
                let trajectory = frame / timetable.scans();
                let start_s = start_s(timetable, duration_s, frame);
                // To the nanosecond: a sum of binary fractions has more digits than it means.
                [(start_s * 1e9).round() / 1e9, (trajectory + 1) as f64]
            };
            let lines =
                lines.enumerate().map(|(frame, line)| of_frame(frame).into_iter().chain(line));
            csv_file::write(&arguments.to.output, names, lines)?;
        }
    }
    Ok(conclude(arguments, &scene, &dataset, common))
}

/// Time of the start of a frame since the first one in s.
fn start_s(timetable: &Timetable, duration_s: f64, frame: usize) -> f64 {
    let (trajectory, scan) = (frame / timetable.scans(), frame % timetable.scans());
    trajectory as f64 * (duration_s + PAUSE_S) + timetable.starts_s[scan]
}

/// Writes the frames as a recording.
fn recorded(
    arguments: &Arguments,
    scene: &Experiment,
    dataset: &Dataset,
    timetable: Option<&Timetable>,
    common: &Common,
) -> Result<print::Outcome> {
    let columns = |names: &[String]| sheet::columns(names.iter().map(String::as_str), []);
    let (readings, outputs) = (columns(&dataset.inputs.names), columns(&dataset.outputs.names));
    let layout = sheet::layout(&scene.name, readings, outputs, Some(&scene.world.sensor));
    let extras = Extras { scene: Some(scene.text.clone()), ..Extras::default() };
    let duration_s = scene.world.path.as_ref().map_or(0.0, |path| path.duration_s);
    let floats = |line: &[f64]| line.iter().map(|value| *value as f32).collect();
    let lines = dataset.inputs.lines().zip(dataset.outputs.lines());
    let frames = lines.enumerate().map(|(number, (readings, outputs))| {
        let start_s = match timetable {
            Some(timetable) => start_s(timetable, duration_s, number),
            None => number as f64 / USUAL_RATE,
        };
        Frame {
            time_us: (start_s * 1e6).round() as u64,
            number: number as u32,
            readings: floats(readings),
            truth: Some(floats(outputs)),
            ..Frame::default()
        }
    });
    recordings::write(&arguments.to.output, &layout, &extras, frames)?;
    Ok(conclude(arguments, scene, dataset, common))
}

/// Says what was written.
fn conclude(
    arguments: &Arguments,
    scene: &Experiment,
    dataset: &Dataset,
    common: &Common,
) -> print::Outcome {
    if let Some(warning) = Warning::not_positive(&dataset.inputs) {
        common.remark(warning);
    }
    let mut result = Sections::new("Synthesised frames");
    result.fact("subject", "scene", "", &scene.name);
    result.fact("frames", "frames", "", dataset.frames());
    result.fact("readings", "readings of a frame", "", dataset.inputs.names.len());
    result.fact("outputs", "outputs of a frame", "", dataset.outputs.names.len());
    result.fact("seed", "seed", "", scene.world.seed);
    result.fact("file", "file", "", arguments.to.output.display().to_string());
    print::sections(common, &result)
}

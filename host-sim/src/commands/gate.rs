//! `gate`: what leaving rows at rest alone saves and misses.

use std::path::PathBuf;

use super::progress::Terminal;
use clap::Args;
use host_sim::evaluate::cost::{Costs, Frames};
use host_sim::evaluate::gate::{self, BASELINE_FRAMES, GateResult, Line, MISSED_OVER_MM, Settings};
use host_sim::metrics::Errors;
use host_sim::{Error, Result};
use taxel_learn::Exponential;

use super::arguments::of_option;
use super::scene_argument::{self, NoiseArgument, SceneArgument};
use super::{Common, print};

/// Leave rows at rest alone: what that saves, misses, and does to the errors.
///
/// A row is at rest if its readings, and their sum, are within k times their noise of the baseline: the mean
/// of frames of the untouched sensor with the same noise. It then takes the model's answer to the baseline.
/// Test and model compute as on the device (docs/gating.md).
#[derive(Args)]
#[command(after_help = "Example: host-sim gate press --k 3,3.5,4 --noise 0.01")]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    noise: NoiseArgument,
    /// Frames of the scene, and as many of the untouched sensor.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 4000)]
    frames: usize,
    /// Weight blob of this scene, instead of training one.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Tolerances, in standard deviations of a reading's noise.
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_values_t = [3.0, 3.5, 4.0, 5.0, 6.0], allow_negative_numbers = true)]
    k: Vec<f64>,
    /// Frames that the baseline averages.
    #[arg(long, value_name = "N", default_value_t = BASELINE_FRAMES)]
    baseline_frames: usize,
    /// Cycles of a frame without a gate, of one whose rows are all at rest, and of one whose rows are all
    /// awake, instead of those that `cargo xtask cycles` measured of such models; REST is below AWAKE.
    #[arg(
        long,
        value_name = "FRAME,REST,AWAKE",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true
    )]
    cycles: Vec<u64>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut scene = arguments.scene.load(common)?;
    arguments.noise.apply(&mut scene)?;
    scene.world.check_frames("--frames", arguments.frames)?;
    scene.world.check_frames("--baseline-frames", arguments.baseline_frames)?;
    let mut settings = Settings {
        k: arguments.k.clone(),
        frames: arguments.frames,
        baseline_frames: arguments.baseline_frames,
        frame_cycles: given(&arguments.cycles)?,
    };
    let options = [("k", "--k"), ("baseline-frames", "--baseline-frames")];
    settings.check(&scene.world).map_err(|bad| of_option(bad, &options))?;
    let blob = scene_argument::model(arguments.model.as_deref(), &scene, &Terminal::new())?;
    let model = blob.prepare(Exponential::default());
    let own = f64::from(model.model().metadata().noise_level);
    if (own - scene.world.noise.level).abs() > 1e-3 * scene.world.noise.level {
        eprintln!(
            "note: the model was trained for noise of {}, and is judged at the scene's {}; see --noise",
            percent(own, 2),
            percent(scene.world.noise.level, 2)
        );
    }
    if settings.frame_cycles.is_none() {
        let measured = Costs::measured()?.frames_of_model(model.model());
        settings.frame_cycles = measured.map(|frames| frames.map(|cost| cost.cycles));
    }
    let result = gate::measure(&scene, &model, &settings)?;
    if common.json { print::json(&result) } else { page_of(&result).print() }
}

fn given(cycles: &[u64]) -> Result<Option<Frames<u64>>> {
    match *cycles {
        [] => Ok(None),
        [ungated, at_rest, awake] if ungated > 0 && (1..awake).contains(&at_rest) => {
            Ok(Some(Frames { ungated, at_rest, awake }))
        }
        _ => Err(Error::Usage(format!(
            "--cycles {cycles:?}: give three positive numbers, FRAME,REST,AWAKE with REST below AWAKE, as \
             `cargo xtask cycles` measures them (docs/gating.md)"
        ))),
    }
}

fn page_of(result: &GateResult) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} frames of {} rows, and as many untouched; noise {}; baseline of {} frames; seed {}, model {}\n",
        result.scene,
        result.frames,
        result.rows,
        percent(result.noise_level, 2),
        result.baseline_frames,
        result.seed,
        result.model_crc
    ));
    rows(&mut page, result);
    errors(&mut page, result);
    match &result.frame_cycles {
        Some(frames) => frames_cost(&mut page, result, frames),
        None => page.line(
            "what frames cost is not known: no model of this kind was measured, see firmware/cycles.csv; \
             give --cycles\n",
        ),
    }
    page.line(
        "k: standard deviations of their noise within which a row's readings are, and their sum is, for it to\n\
         be at rest; tolerance: k × noise, what a device is configured with. skipped: rows of the scene that\n\
         are at rest, of all. woken: rows of the untouched sensor that are not; theory: at most\n\
         1 − (1 − 2Q(k'))^(n+1) for n readings a row (of one network for the whole array, whose rows wake\n\
         together, as many times over as there are rows), k' = k/√(1 + 1/B) for a baseline of B frames. missed: rows\n\
         at rest, of those in which some electrode moved by more than the size, ‖Δ‖; largest: the largest ‖Δ‖\n\
         in a row at rest.\n\
         RMSE: √mean(e²) over all rows of the scene, whether at rest or not.",
    );
    page
}

fn rows(page: &mut print::Page, result: &GateResult) {
    let sizes = MISSED_OVER_MM.map(|mm| format!(" {:>9}", format!("> {mm} mm"))).concat();
    page.line(format_args!(
        "{:>6} {:>10} {:>9} {:>9} {:>9}   missed:{sizes} {:>9}",
        "k", "tolerance", "skipped", "woken", "(theory)", "largest"
    ));
    for line in &result.lines {
        let missed = line.missed.iter().map(|missed| {
            format!(" {:>9}", missed.share().map_or("-".into(), |share| percent(share, 2)))
        });
        page.line(format_args!(
            "{:>6} {:>10} {:>9} {:>9} {:>9}          {} {:>9}",
            line.k,
            percent(line.rest_tolerance, 3),
            percent(line.skipped, 2),
            percent(line.woken, 3),
            format!("({})", percent(line.woken_by_theory, 3)),
            missed.collect::<String>(),
            line.largest_missed_mm.map_or("-".into(), |mm| format!("{mm:.3} mm"))
        ));
    }
    let sizes = result.lines.first().map_or(&[][..], |line| &line.missed);
    let rows: Vec<String> = sizes.iter().map(|size| format!(" {:>9}", size.rows)).collect();
    page.line(format_args!("{:>47}   of rows:{}\n", "", rows.concat()));
}

fn errors(page: &mut print::Page, result: &GateResult) {
    let header = result.ungated_errors.iter().map(|group| format!(" {:>13}", group.group));
    page.line(format_args!("{:<19}{}", "RMSE", header.collect::<String>()));
    let mut line = |what: String, errors: &[Errors]| {
        let cells = errors.iter().map(|group| format!(" {:>10.4} {:<2}", group.rmse, group.unit));
        page.line(format_args!("{what:<19}{}", cells.collect::<String>().trim_end()));
    };
    line("without a gate".into(), &result.ungated_errors);
    for Line { k, errors, .. } in &result.lines {
        line(format!("k = {k}"), errors);
    }
    line("answering the mean".into(), &result.mean_errors);
    page.line("");
}

fn frames_cost(page: &mut print::Page, result: &GateResult, frames: &Frames<u64>) {
    page.line(format_args!(
        "cycles of a frame: {} without a gate, {} with all rows at rest, {} with all awake; in parts of the\n\
         first, mean over the scene, and untouched:",
        frames.ungated, frames.at_rest, frames.awake
    ));
    let part = |cost: Option<f64>| cost.map_or("-".into(), |cost| percent(cost, 1));
    for line in &result.lines {
        let (scene, untouched) = (part(line.relative_cost), part(line.relative_cost_untouched));
        page.line(format_args!("{:>6} {scene:>10} {untouched:>10}", line.k));
    }
    page.line("");
}

fn percent(share: f64, decimals: usize) -> String {
    format!("{:.decimals$} %", 100.0 * share)
}

//! `gate`: what leaving rows at rest alone saves and misses.

use std::path::PathBuf;

use clap::Args;
use host_sim::evaluate::gate::{self, Costs, GateResult, Line, MISSED_OVER_MM, Settings};
use host_sim::evaluate::metrics::Errors;
use host_sim::progress::Progress;
use host_sim::{Error, Result};

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
    #[arg(long, value_name = "N", default_value_t = 100)]
    baseline_frames: usize,
    /// Cycles of a row without a gate, of a row at rest, and of the test of a row that is awake, for the cost
    /// of frames.
    #[arg(
        long,
        value_name = "ROW,REST,TEST",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true
    )]
    cycles: Vec<f64>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut scene = arguments.scene.load(common)?;
    arguments.noise.apply(&mut scene)?;
    scene.check_frames("--frames", arguments.frames)?;
    scene.check_frames("--baseline-frames", arguments.baseline_frames)?;
    let settings = Settings {
        k: arguments.k.clone(),
        frames: arguments.frames,
        baseline_frames: arguments.baseline_frames,
        costs: costs(&arguments.cycles)?,
    };
    settings.check(&scene)?;
    let model =
        scene_argument::model(arguments.model.as_deref(), &scene, &Progress::on_terminal())?;
    let result = gate::measure(&scene, &model, &settings)?;
    if common.json { print::json(&result) } else { page_of(&result).print() }
}

fn costs(cycles: &[f64]) -> Result<Option<Costs>> {
    match *cycles {
        [] => Ok(None),
        [row_cycles, resting_row_cycles, test_cycles]
            if cycles.iter().all(|c| c.is_finite() && *c > 0.0) =>
        {
            Ok(Some(Costs { row_cycles, resting_row_cycles, test_cycles }))
        }
        _ => Err(Error::Usage(format!(
            "--cycles {cycles:?}: give three positive numbers, ROW,REST,TEST, as `cargo xtask cycles` \
             measures them (docs/gating.md)"
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
    if result.costs.is_some() {
        frames_cost(&mut page, result);
    }
    page.line(
        "k: standard deviations of their noise within which a row's readings are, and their sum is, for it to\n\
         be at rest; tolerance: k × noise, what a device is configured with. skipped: rows of the scene that\n\
         are at rest, of all. woken: rows of the untouched sensor that are not; theory: at most\n\
         1 − (1 − 2Q(k'))^(n+1) for n readings a row, k' = k/√(1 + 1/B) for a baseline of B frames. missed: rows\n\
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

fn frames_cost(page: &mut print::Page, result: &GateResult) {
    page.line(
        "cycles of a frame, in parts of one without a gate: mean over the scene, and untouched",
    );
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

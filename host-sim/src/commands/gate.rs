//! Command `gate`: the work that skipping untouched rows saves, and the touches that it misses.

use std::path::PathBuf;

use super::progress::Terminal;
use clap::Args;
use host_sim::evaluate::gate::{self, BASELINE_FRAMES, GateResult, Line, MISSED_OVER_MM, Settings};
use host_sim::metrics::Errors;
use host_sim::{Error, Result};
use taxel_learn::Exponential;
use taxel_learn::cost::{Design, Frames, Prices};

use super::arguments::of_option;
use super::scene_argument::{self, NoiseArgument, SceneArgument};
use super::{Common, print};

/// Skip untouched rows: work saved, touches missed, and errors.
///
/// A row counts as untouched if every reading, and their sum, lies within k standard deviations of the
/// baseline. The baseline is the mean of frames of the untouched sensor with the same noise. An untouched
/// row takes the model's estimate for the baseline. Gate and model compute like on the device
/// (docs/gating.md).
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
    /// Cycles of a frame without a gate, of one with all rows untouched (REST), and of one with all rows
    /// touched (AWAKE). REST is below AWAKE. They replace those that are predicted of the model (docs/cycles.md).
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
    let options = [("k", "--k"), ("baseline-frames", "--baseline-frames")];
    gate::check_settings(&scene.world, &arguments.k, arguments.baseline_frames)
        .map_err(|bad| of_option(bad, &options))?;
    let given = given(&arguments.cycles)?;
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
    let (frame_cycles, flash_frame_cycles) = if let Some(frames) = given {
        (frames, None)
    } else {
        let frames = Prices::accepted()?.frames(&Design::of(&blob), Exponential::default())?;
        (frames.map(|cost| cost.cycles), Some(frames.map(|cost| cost.flash_cycles)))
    };
    let settings = Settings {
        k: arguments.k.clone(),
        frames: arguments.frames,
        baseline_frames: arguments.baseline_frames,
        frame_cycles,
        flash_frame_cycles,
    };
    let result = gate::measure(&scene, &model, &settings, &Terminal::new())?;
    if common.json { print::json(&result) } else { page_of(&result).print() }
}

/// The cycles that the user gives.
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
    frames_cost(&mut page, result);
    page.line(
        "k: a row counts as untouched if every reading, and their sum, lies within k standard deviations of\n\
         the baseline. tolerance: k × noise, for a device's configuration.\n\
         skipped: share of the scene's rows that count as untouched, and are not decoded.\n\
         woken: share of the untouched sensor's rows that do not. theory: its upper bound\n\
         1 − (1 − 2Q(k'))^(n+1), with n readings a row and k' = k/√(1 + 1/B) for a baseline of B frames. If one\n\
         network decodes the whole array, rows wake together: the bound is multiplied by their number.\n\
         missed: share of skipped rows among those with an electrode that moved by more than this, ‖Δ‖.\n\
         largest: the largest ‖Δ‖ in a skipped row.\n\
         RMSE: √mean(e²) over all rows of the scene, skipped or not.\n\
         × limit: relative to the least possible RMSE of any decoder of the whole frame.",
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
    let header = result.ungated_errors.iter();
    let header = header.map(|group| format!(" {:>10}    {:>12}", group.group, "× limit"));
    page.line(format_args!("{:<19}{}", "RMSE", header.collect::<String>()));
    let mut line = |what: String, errors: &[Errors]| {
        let cells = errors.iter().map(|group| {
            format!(" {:>10.4} {:<2} {:>12}", group.rmse, group.unit, print::ratio(group))
        });
        page.line(format_args!("{what:<19}{}", cells.collect::<String>().trim_end()));
    };
    line("without a gate".into(), &result.ungated_errors);
    for Line { k, errors, .. } in &result.lines {
        line(format!("k = {k}"), errors);
    }
    line("predicting the mean".into(), &result.mean_errors);
    page.line(result.limit.note());
    page.line("");
}

fn frames_cost(page: &mut print::Page, result: &GateResult) {
    let of_flash = result.flash_frame_cycles.map(|cycles| ("from flash", cycles));
    for (memory, cycles) in [("zero wait", result.frame_cycles)].into_iter().chain(of_flash) {
        page.line(format_args!(
            "cycles of a frame, {memory}: {} without a gate, {} with all rows untouched, {} with all touched",
            cycles.ungated, cycles.at_rest, cycles.awake
        ));
    }
    page.line(format_args!(
        "Mean cycles at zero wait, relative to no gate:\n{:>6} {:>10} {:>10}",
        "k", "scene", "untouched"
    ));
    for line in &result.lines {
        let part = |cost: f64| percent(cost, 1);
        let (scene, untouched) = (part(line.relative_cost), part(line.relative_cost_untouched));
        page.line(format_args!("{:>6} {scene:>10} {untouched:>10}", line.k));
    }
    page.line("");
}

fn percent(share: f64, decimals: usize) -> String {
    format!("{:.decimals$} %", 100.0 * share)
}

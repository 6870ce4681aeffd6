//! Command `gate`: the work that skipping untouched rows saves, and the touches that it misses.

use std::path::PathBuf;

use super::progress::Terminal;
use crate::evaluate::gate::{
    self, BASELINE_FRAMES, GateResult, Line, MISSED_OVER_MM, RECOMMENDED_K, Settings,
};
use crate::metrics::Errors;
use crate::subject::Subject;
use crate::verdict::{Verdict, Warning};
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_learn::cost::{Design, Frames, Prices};
use taxel_learn::{Exponential, PreparedModel};

use super::arguments::{of_option, refuse_given};
use super::subject_argument::{self, SubjectArgument};
use super::{Common, print, stderr};

/// Skip untouched rows: work saved, touches missed, and errors.
///
/// A row counts as untouched if every reading, and their sum, lies within k standard deviations of the
/// baseline. The baseline is the mean of frames of the untouched sensor with the same noise. An untouched
/// row takes the model's estimate for the baseline. Gate and model compute like on the device
/// (docs/gating.md).
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim gate press --k 3,3.5,4 --noise 0.01
  host-sim gate log.csv --inputs 'ch*' --outputs 'f?_n'")]
pub struct Arguments {
    /// Frames of a scene, and as many of the untouched sensor [default: 4000].
    #[arg(short = 'n', long, value_name = "N")]
    frames: Option<usize>,
    /// Weight blob for this scene or CSV file, instead of training one.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Tolerances, in standard deviations of a reading's noise.
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_values_t = [3.0, 3.5, 4.0, 5.0, 6.0], allow_negative_numbers = true)]
    k: Vec<f64>,
    /// Frames that a scene's baseline averages [default: 100].
    #[arg(long, value_name = "N")]
    baseline_frames: Option<usize>,
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
    #[command(flatten)]
    subject: SubjectArgument,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    arguments.subject.refuse_time("gate")?;
    let subject = arguments.subject.load(common)?;
    subject.require_inverse("gate")?;
    let frames = arguments.frames.unwrap_or(FRAMES);
    let baseline_frames = arguments.baseline_frames.unwrap_or(BASELINE_FRAMES);
    check(arguments, &subject, [frames, baseline_frames])?;
    let given = given(&arguments.cycles)?;
    let blob = subject_argument::model(arguments.model.as_deref(), &subject, &Terminal::new())?;
    let model = blob.prepare(Exponential::default());
    if let Subject::Scene(scene) = &subject {
        remark_on_noise(&model, scene.world.noise.total_level());
    }
    let (frame_cycles, flash_frame_cycles) = if let Some(frames) = given {
        (frames, None)
    } else {
        let frames = Prices::accepted()?.frames(&Design::new(&blob), Exponential::default())?;
        (frames.map(|cost| cost.cycles), Some(frames.map(|cost| cost.flash_cycles)))
    };
    let settings = Settings {
        k: arguments.k.clone(),
        frames,
        baseline_frames,
        frame_cycles,
        flash_frame_cycles,
    };
    let result = match &subject {
        Subject::Scene(scene) => gate::measure(scene, &model, &settings, &Terminal::new()),
        Subject::Measured(data) => gate::measure_data(data, &model, &settings),
    };
    let result = result.map_err(|bad| of_option(bad, &OPTIONS))?;
    let verdict = verdict(&result);
    let summary = Summary { result, verdict };
    print::result(common, &summary, || page_of(&summary))
}

#[derive(Serialize)]
struct Summary {
    #[serde(flatten)]
    result: GateResult,
    /// What the recommended gate saves, and costs in accuracy.
    verdict: Verdict,
}

/// Frames of a scene unless a user says otherwise.
const FRAMES: usize = 4000;

/// Options by the settings that they set.
const OPTIONS: [(&str, &str); 2] = [("k", "--k"), ("baseline-frames", "--baseline-frames")];

/// Checks what can be checked before a model is trained.
fn check(arguments: &Arguments, subject: &Subject, numbers: [usize; 2]) -> Result<()> {
    let [frames, baseline_frames] = numbers;
    match subject {
        Subject::Scene(scene) => {
            scene.world.check_frames("--frames", frames)?;
            scene.world.check_frames("--baseline-frames", baseline_frames)?;
            let settings = gate::check_settings(&scene.world, &arguments.k, baseline_frames);
            Ok(settings.map_err(|bad| of_option(bad, &OPTIONS))?)
        }
        Subject::Measured(data) => {
            let of_scenes = [
                ("--frames", arguments.frames.is_some()),
                ("--baseline-frames", arguments.baseline_frames.is_some()),
            ];
            refuse_given(of_scenes, |option| {
                format!("{option} is for a scene; a CSV file has its own frames: leave it out")
            })?;
            gate::GateRest::new(data, &arguments.k).map_err(|bad| of_option(bad, &OPTIONS))?;
            Ok(())
        }
    }
}

/// Remarks on stderr if the model was trained for other noise than the scene's `level`.
fn remark_on_noise(model: &PreparedModel<'_>, level: f64) {
    let own = f64::from(model.model().metadata().noise_level);
    if (own - level).abs() > 1e-3 * level {
        stderr::remark(format_args!(
            "note: the model was trained for noise of {}, and is judged at the scene's {}; see --noise",
            percent(own, 2),
            percent(level, 2)
        ));
    }
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

fn page_of(summary: &Summary) -> print::Page {
    let Summary { result, verdict } = summary;
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} frames of {} row{}, {} untouched; noise {}; baseline of {} frames; seed {}, model {}\n",
        result.subject,
        result.frames,
        result.rows,
        if result.rows == 1 { "" } else { "s" },
        result.untouched_frames,
        percent(result.noise_level, 2),
        result.baseline_frames,
        result.seed,
        result.model_crc
    ));
    rows(&mut page, result);
    errors(&mut page, result);
    frames_cost(&mut page, result);
    print::verdict(&mut page, None, verdict);
    page.line(
        "\nk: a row counts as untouched if every reading, and their sum, lies within k standard deviations of\n\
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

/// Shares of rows by tolerance; those that are missed where it is known how far the electrodes moved.
fn rows(page: &mut print::Page, result: &GateResult) {
    let sizes = result.lines.first().map_or(&[][..], |line| &line.missed);
    let sizes_are_known = !sizes.is_empty();
    let head = if sizes_are_known {
        let over = MISSED_OVER_MM.map(|mm| format!(" {:>9}", format!("> {mm} mm"))).concat();
        format!("   missed:{over} {:>9}", "largest")
    } else {
        String::new()
    };
    page.line(format_args!(
        "{:>6} {:>10} {:>9} {:>9} {:>9}{head}",
        "k", "tolerance", "skipped", "woken", "(theory)"
    ));
    for line in &result.lines {
        let missed = if sizes_are_known { missed(line) } else { String::new() };
        page.line(format_args!(
            "{:>6} {:>10} {:>9} {:>9} {:>9}{missed}",
            line.k,
            percent(line.rest_tolerance, 3),
            percent(line.skipped, 2),
            percent(line.woken, 3),
            format!("({})", percent(line.woken_by_theory, 3))
        ));
    }
    if sizes_are_known {
        let rows: Vec<String> = sizes.iter().map(|size| format!(" {:>9}", size.rows)).collect();
        page.line(format_args!("{:>47}   of rows:{}", "", rows.concat()));
    }
    page.line("");
}

/// Shares of touched rows that a tolerance misses, by how far they moved, and the largest of them.
fn missed(line: &Line) -> String {
    let shares = line.missed.iter().map(|missed| {
        format!(" {:>9}", missed.share().map_or("-".into(), |share| percent(share, 2)))
    });
    let largest = line.largest_missed_mm.map_or("-".into(), |mm| format!("{mm:.3} mm"));
    format!("          {} {largest:>9}", shares.collect::<Vec<_>>().concat())
}

/// What the gate with the tolerance nearest to the recommended one is worth.
fn verdict(result: &GateResult) -> Verdict {
    let near = |line: &&Line| (line.k - RECOMMENDED_K).abs();
    let Some(line) = result.lines.iter().min_by(|a, b| near(a).total_cmp(&near(b))) else {
        return Verdict { sentence: String::new(), warnings: vec![] };
    };
    let worse = line.errors.iter().zip(result.ungated_errors()).map(|(gated, ungated)| {
        format!("{} by {:.1} %", gated.group, 100.0 * (gated.rmse / ungated.rmse - 1.0))
    });
    let worse: Vec<String> = worse.collect();
    let sentence = format!(
        "With k = {} the gate skips {} of the rows, and a frame takes {} of the cycles. Errors change: {}.",
        line.k,
        percent(line.skipped, 0),
        percent(line.relative_cost, 0),
        worse.join(", ")
    );
    let cycles = result.frame_cycles.ungated as f64;
    let costly = Warning::costly_gate(line.relative_cost * cycles, cycles);
    Verdict { sentence, warnings: costly.into_iter().collect() }
}

fn errors(page: &mut print::Page, result: &GateResult) {
    let header = result.ungated_errors().iter();
    let header = header.map(|group| format!(" {:>10}    {:>12}", group.group, "× limit"));
    page.line(format_args!("{:<19}{}", "RMSE", header.collect::<String>()));
    let mut line = |what: String, errors: &[Errors]| {
        let cells = errors.iter().map(|group| {
            format!(" {:>10.4} {:<2} {:>12}", group.rmse, group.unit, print::ratio(group))
        });
        page.line(format_args!("{what:<19}{}", cells.collect::<String>().trim_end()));
    };
    line("without a gate".into(), result.ungated_errors());
    for Line { k, errors, .. } in &result.lines {
        line(format!("k = {k}"), errors);
    }
    line("predicting the mean".into(), result.mean_errors());
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

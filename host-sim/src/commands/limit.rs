//! Command `limit`: the least possible error of any decoder, and what the sensor shows at all.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::evaluate::limit::{self, Candidate, Figures, Level, LimitResult, Plan};
use crate::experiment::Experiment;
use crate::metrics::{DecoderErrors, Errors};
use crate::{Error, Result, report};
use clap::Args;
use serde::Serialize;
use taxel_data::output::{FileSet, Written};
use taxel_learn::ModelBlob;
use taxel_limit::identify::Observability;
use taxel_simulate::noise::NoiseKind;

use super::progress::Terminal;
use super::scene_argument::{DEFAULT_SCENE, SceneArgument, read_one_row};
use super::{Common, arguments, command_line, merged, print};

/// All files that `-o` writes.
const FILES: FileSet = FileSet {
    files: &["limit.json", "limit.html"],
    inner: report::figures_named(&["limit-by-noise", "directions*", "known*"]),
};
/// Singular values that are printed of each row.
const PRINTED_VALUES: usize = 6;

/// Compute the least possible error of any decoder, and which directions the sensor shows.
///
/// The least RMSE is that of the posterior mean E[Δ | readings]. It is sampled for a number of test frames, from the
/// scene's own prior and noise, for ideal readings: a drift of the gain, circuits and time are not modelled. A figure
/// that the sample does not carry is refused (docs/what-the-sensor-knows.md).
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim limit press --row 4 --noise 0.005,0.01 -o out/limit
  host-sim limit thin.toml thick.toml
  host-sim limit press --model m.bin -n 2000")]
pub struct Arguments {
    /// Built-in scenes (paper, press, contact, moving) or paths of scene files. One table compares several.
    #[arg(value_name = "SCENE", default_value = DEFAULT_SCENE)]
    scenes: Vec<String>,
    /// Levels of the white noise, instead of the scene's: fractions (0.01 is 1 %), or in ohm for absolute noise.
    #[arg(long, value_name = "LEVEL,…", value_delimiter = ',', allow_negative_numbers = true)]
    noise: Vec<f64>,
    /// Row-wire (from 1) that is read, instead of all that the scene reads.
    #[arg(long, value_name = "ROW", allow_negative_numbers = true)]
    row: Option<usize>,
    /// Test frames [default: 400, or 400 posteriors of rows where rows move independently].
    #[arg(short = 'n', long, value_name = "N", allow_negative_numbers = true)]
    frames: Option<usize>,
    /// Models of the scenes to judge on the same frames: their errors, and the ratios of these to the limit.
    #[arg(long, value_name = "FILE,…", value_delimiter = ',')]
    model: Vec<PathBuf>,
    /// Folder that receives limit.json, a page limit.html, and its figures/ by themselves; of several scenes, a folder
    /// there for each, by its name.
    #[arg(short, long, value_name = "DIR", value_parser = arguments::folder())]
    output: Option<PathBuf>,
}

/// Results of several scenes.
#[derive(Serialize)]
struct Scenes {
    scenes: Vec<LimitResult>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let scenes = arguments.scenes.iter().map(|scene| prepared(scene, arguments, common));
    let scenes: Vec<Prepared> = scenes.collect::<Result<_>>()?;
    let names: BTreeSet<&str> = scenes.iter().map(|it| it.scene.name.as_str()).collect();
    if names.len() < scenes.len() {
        return Err(Error::Usage("two scenes have the same name; give each its own".into()));
    }
    let folder_of = |scene: &Experiment| {
        let folder = arguments.output.as_ref()?;
        Some(if scenes.len() == 1 { folder.clone() } else { folder.join(&scene.name) })
    };
    let inputs: Vec<&Path> = arguments.scenes.iter().map(Path::new).collect();
    for folder in scenes.iter().filter_map(|it| folder_of(&it.scene)) {
        FILES.check(&folder, &inputs)?;
    }
    let mut results = Vec::new();
    for Prepared { scene, noise_levels, frames, models } in &scenes {
        let plan = Plan { noise_levels, frames: *frames, models };
        results.push(limit::compute(scene, &plan, &Terminal::new())?);
    }
    let written = scenes.iter().zip(&results).filter_map(|(it, result)| {
        folder_of(&it.scene).map(|folder| written_files(&folder, result))
    });
    Written::put_in_place(written.collect::<Result<_>>()?)?;
    let folder = arguments.output.as_deref();
    if let [result] = &results[..] {
        print::result(common, result, || page_of(result, folder))?;
        return refusal(result);
    }
    let several = Scenes { scenes: results };
    print::result(common, &several, || page_of_several(&several.scenes, folder))?;
    several.scenes.iter().try_for_each(refusal)
}

/// Scene with what is to be computed of it.
struct Prepared {
    scene: Experiment,
    noise_levels: Vec<f64>,
    frames: usize,
    models: Vec<Candidate>,
}

fn prepared(scene: &str, arguments: &Arguments, common: &Common) -> Result<Prepared> {
    let mut scene = SceneArgument::new(scene).load(common)?;
    arguments.row.map_or(Ok(()), |row| read_one_row(&mut scene, row))?;
    let world = &mut scene.world;
    let own = vec![world.noise.level];
    let noise_levels = if arguments.noise.is_empty() { own } else { arguments.noise.clone() };
    for level in &noise_levels {
        world.clone().set_noise_level(*level).map_err(|bad| of_noise(*level, &bad.rule))?;
        if *level == 0.0 {
            return Err(of_noise(
                0.0,
                "without noise there is no posterior; give a positive level",
            ));
        }
    }
    let frames = arguments.frames.unwrap_or_else(|| limit::usual_frames(world));
    if frames < 2 {
        return Err(Error::Usage(format!("--frames {frames}: give at least 2")));
    }
    world.check_frames("--frames", frames)?;
    let models = arguments.model.iter().map(|file| {
        let model = Candidate { file: file.clone(), blob: ModelBlob::read(file)? };
        model.check(world).map(|()| model)
    });
    let models: Vec<Candidate> = models.collect::<Result<_>>()?;
    Ok(Prepared { scene, noise_levels, frames, models })
}

fn of_noise(level: f64, rule: &str) -> Error {
    Error::Usage(format!("--noise {level}: {rule}"))
}

/// Failure if no figure could be given at all.
fn refusal(result: &LimitResult) -> Result<()> {
    let mut all = result.levels.iter().flat_map(|level| &level.limits);
    let first = all.clone().find_map(|figures| figures.refused.as_ref());
    match first {
        Some(refused) if all.all(|figures| figures.refused.is_some()) => {
            Err(Error::failed(format!("no limit can be given: {refused}")))
        }
        _ => Ok(()),
    }
}

fn written_files(folder: &Path, result: &LimitResult) -> Result<Written> {
    let json = print::json_text(result)?;
    let command = command_line::of_this_process("limit", &["-o", "--output"], Some(result.seed));
    let page = report::limit_html(result, &command);
    let mut files = vec![("limit.json", json.as_bytes()), ("limit.html", page.html.as_bytes())];
    files.extend(page.figures.iter().map(|(path, text)| (path.as_str(), text.as_bytes())));
    Ok(FILES.written(folder, &files)?)
}

fn page_of(result: &LimitResult, folder: Option<&Path>) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{}: {} noise, seed {}, {} test frames\n",
        result.subject,
        result.noise_kind.name(),
        result.seed,
        result.frames
    ));
    limits(&mut page, result);
    page.line(
        "\nDirections of the deformation. Observable ones move the readings by more than the noise for one standard\n\
         deviation of the prior: their signal-to-noise ratio is above 1. known: share of the prior's variance that\n\
         readings take away, and RMSE that is left, for a sensor linearised at the mean deformation.",
    );
    for level in &result.levels {
        directions(&mut page, level, result.noise_kind);
    }
    written(&mut page, folder, "");
    page
}

/// Says which files were written to the `folder`.
fn written(page: &mut print::Page, folder: Option<&Path>, place: &str) {
    if let Some(folder) = folder {
        page.line(format_args!(
            "\nwritten to {}{place}: {}",
            folder.display(),
            [FILES.files, &["figures/"]].concat().join(", ")
        ));
    }
}

/// Table of several scenes: what all readings of each one show.
fn page_of_several(results: &[LimitResult], folder: Option<&Path>) -> print::Page {
    let mut page = print::Page::default();
    let heads = ["scene", "noise", "outputs", "limit", "prior", "observable"].map(String::from);
    let models = results[0].levels.first().into_iter().flat_map(|level| &level.decoders);
    let models = models.map(|model| model.decoder.clone());
    let mut lines: Vec<Vec<String>> = vec![heads.into_iter().chain(models).collect()];
    let levels = || results.iter().flat_map(|it| it.levels.iter().map(move |level| (it, level)));
    for (result, level) in levels() {
        let noise = result.noise_kind.in_words(level.noise_level);
        let seen = &level.observability;
        for (place, group) in level.limits[0].groups.iter().enumerate() {
            let models = level.decoders.iter().map(|model| rmse_and_ratio(&model.errors[place]));
            let own = [
                result.subject.clone(),
                noise.clone(),
                group.group.clone(),
                format!("{:.4} ± {:.4}", group.limit, group.limit_standard_error),
                format!("{:.4}", group.prior_rmse),
                format!("{} of {}", seen.observable, seen.unknowns),
            ];
            lines.push(own.into_iter().chain(models).collect());
        }
    }
    merged::table(&mut page, &lines);
    for (result, level) in levels() {
        if let Some(refused) = &level.limits[0].refused {
            let noise = result.noise_kind.in_words(level.noise_level);
            page.line(format_args!("{}, {noise}: not given: {refused}", result.subject));
        }
    }
    page.line(
        "limit: least possible RMSE from all readings, ± its standard error over the frames. prior: always predicting\n\
         the mean. observable: directions of the deformation that move the readings by more than the noise. Of a model:\n\
         its RMSE, and the ratio to the limit ± its standard error.",
    );
    written(&mut page, folder, "/SCENE");
    page
}

fn limits(page: &mut print::Page, result: &LimitResult) {
    let mut all = result.levels.iter().flat_map(|level| &level.limits);
    let groups = all.find(|figures| figures.refused.is_none()).map(|figures| &figures.groups);
    let names = groups
        .into_iter()
        .flatten()
        .map(|g| format!(" {:^26}", format!("{}, {}", g.group, g.unit)));
    page.line(format_args!(
        "{:>7} {:<8}{} {:>12} {:>7}",
        "noise",
        "readings",
        names.collect::<String>(),
        "ESS",
        "MC"
    ));
    for level in &result.levels {
        for figures in &level.limits {
            page.line(limit_line(level, figures, result));
        }
        let noise = result.noise_kind.in_words(level.noise_level);
        level.decoders.iter().for_each(|model| page.line(model_line(&noise, model)));
    }
    let priors = groups.into_iter().flatten().map(|g| format!("{:>9.4}{:18}", g.prior_rmse, ""));
    page.line(format_args!("{:>7} {:<8}{}", "", "prior", priors.collect::<String>().trim_end()));
    page.line(
        "Least possible RMSE, ± its standard error over the frames: root of the posteriors' mean variance. In brackets:\n\
         RMSE of the posterior means on these frames. prior: always predicting the mean. ESS: effective samples of a\n\
         posterior, fewest and median. MC: largest share of the squared error that is the sample's own; it is subtracted.",
    );
    if result.levels.iter().any(|level| !level.decoders.is_empty()) {
        page.line(
            "Models: RMSE on these frames, and the ratio to the limit of all readings ± its standard error.",
        );
    }
}

fn model_line(noise: &str, model: &DecoderErrors) -> String {
    let cells = model.errors.iter().map(|errors| format!(" {}", rmse_and_ratio(errors)));
    let cells: String = cells.collect();
    format!("{noise:>7} {:<8}{cells}   {}", "model", model.decoder)
}

fn rmse_and_ratio(errors: &Errors) -> String {
    let ratio = match (errors.ratio_to_limit, errors.ratio_standard_error) {
        (Some(ratio), Some(error)) => format!("{ratio:.3} ± {error:.3} ×"),
        _ => "–".into(),
    };
    format!("{:>8.4} {ratio:>17}", errors.rmse)
}

fn limit_line(level: &Level, figures: &Figures, result: &LimitResult) -> String {
    let noise = result.noise_kind.in_words(level.noise_level);
    let start = format!("{noise:>7} {:<8}", name(figures, result));
    let Some(effective) = figures.effective_samples else {
        let refused = figures.refused.as_deref().unwrap_or_default();
        return format!("{start}  not given: {refused}");
    };
    let cells = figures
        .groups
        .iter()
        .map(|g| format!(" {:>8.4} ± {:.4} ({:.4})", g.limit, g.limit_standard_error, g.rmse));
    let sizes = format!("{:.0}, {:.0}", effective.least, effective.median);
    let own = figures.groups.iter().map(|g| g.monte_carlo_share).fold(0.0, f64::max);
    format!(
        "{start}{} {sizes:>12} {:>7}",
        cells.collect::<String>(),
        format!("{:.2} %", 100.0 * own)
    )
}

fn directions(page: &mut print::Page, level: &Level, kind: NoiseKind) {
    page.line(format_args!(
        "\n{:<8} {:>10} {:>9}   {:^18} {:^24}   signal-to-noise ratios of the first directions",
        kind.in_words(level.noise_level),
        "observable",
        "unknowns",
        "known: dx, dy, dz",
        "RMSE in mm"
    ));
    let all = std::iter::once(("all".to_owned(), &level.observability));
    let rows = level.by_row.iter().map(|row| (row_name(&row.row_wires), row));
    for (name, seen) in all.chain(rows) {
        page.line(line_of(&name, seen));
    }
}

fn line_of(name: &str, seen: &Observability) -> String {
    let ratios: Vec<String> = seen
        .signal_to_noise
        .iter()
        .take(PRINTED_VALUES)
        .map(|ratio| format!(" {ratio:>6.2}"))
        .collect();
    format!(
        "{name:<8} {:>10} {:>9}   {}  {}",
        seen.observable,
        seen.unknowns,
        known_by_axis(seen),
        ratios.concat()
    )
}

/// Share of the variance that is known along each axis, and the RMSE that is left.
fn known_by_axis(seen: &Observability) -> String {
    let known = seen.axes.iter().map(|axis| format!("{:>4.0} %", 100.0 * axis.known));
    let rmse: Vec<String> = seen.axes.iter().map(|axis| format!("{:.4}", axis.rmse_mm)).collect();
    format!("{} {:>24}", known.collect::<String>(), rmse.join(" "))
}

/// Name of the readings that figures are from.
fn name(figures: &Figures, result: &LimitResult) -> String {
    if figures.row_wires.len() == result.row_wires && result.row_wires > 1 {
        "array".into()
    } else {
        row_name(&figures.row_wires)
    }
}

fn row_name(row_wires: &[usize]) -> String {
    match row_wires {
        [row] => format!("row {row}"),
        rows => format!("{} rows", rows.len()),
    }
}

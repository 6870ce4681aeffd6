//! Command `limit`: the least possible error of any decoder, and what the sensor shows at all.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::evaluate::limit::{self, Candidate, LimitResult, Plan};
use crate::experiment::Experiment;
use crate::{Error, Result, report};
use clap::Args;
use taxel_data::output::{FileSet, Written};
use taxel_learn::ModelBlob;

use super::progress::Terminal;
use super::scene_argument::{DEFAULT_SCENE, SceneArgument, read_one_row};
use super::{Common, arguments, command_line, print};

/// All files that `-o` writes.
const FILES: FileSet = FileSet {
    files: &["limit.json", "limit.html"],
    inner: report::figures_named(&["limit-by-noise", "directions*", "known*"]),
};

/// Compute the least possible error of any decoder, and which directions of deformation the readings show.
///
/// The least RMSE is that of the posterior mean E[Δ | readings], sampled for a number of test frames from the scene's
/// own prior and noise. Readings are ideal: drift of the gain, circuits and time are not modelled. A figure for
/// which the sample is too small is refused (docs/what-the-sensor-knows.md).
///
/// -o writes limit.json, a page limit.html, and its figures/; for several scenes, to a folder for each, named after the
/// scene.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel limit press --row 4 --noise 0.005,0.01 -o out/limit
  taxel limit thin.toml thick.toml
  taxel limit press --model m.bin -n 2000")]
pub struct Arguments {
    /// Built-in scenes (paper, press, contact, moving, shear) or paths of scene files. One table compares several.
    #[arg(value_name = "SCENE", default_value = DEFAULT_SCENE)]
    scenes: Vec<String>,
    /// Levels of the white noise, instead of the scene's: fractions (0.01 is 1 %), or in ohm for absolute noise.
    #[arg(long, value_name = "LEVEL,…", value_delimiter = ',')]
    noise: Vec<f64>,
    /// Row-wire (from 1) that is read, instead of all that the scene reads.
    #[arg(long, value_name = "ROW")]
    row: Option<usize>,
    /// Test frames [default: 400, or 400 posteriors of rows where rows move independently].
    #[arg(short = 'n', long, value_name = "N")]
    frames: Option<usize>,
    /// Models of the scenes to evaluate on the same frames: their errors, and the ratios of these to the limit.
    #[arg(long, value_name = "FILE,…", value_delimiter = ',')]
    model: Vec<PathBuf>,
    #[command(flatten)]
    to: arguments::OutputFolder,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let scenes = arguments.scenes.iter().map(|scene| prepared(scene, arguments, common));
    let scenes: Vec<Prepared> = scenes.collect::<Result<_>>()?;
    let names: BTreeSet<&str> = scenes.iter().map(|it| it.scene.name.as_str()).collect();
    if names.len() < scenes.len() {
        return Err(Error::Usage("two scenes have the same name; give each its own".into()));
    }
    let folder_of = |scene: &Experiment| {
        let folder = arguments.to.output.as_ref()?;
        Some(if scenes.len() == 1 { folder.clone() } else { folder.join(&scene.name) })
    };
    let inputs: Vec<&Path> = arguments.scenes.iter().map(Path::new).collect();
    for folder in scenes.iter().filter_map(|it| folder_of(&it.scene)) {
        FILES.check(&folder, &inputs)?;
    }
    let mut results = Vec::new();
    for Prepared { scene, noise_levels, frames, models } in &scenes {
        let plan = Plan { noise_levels, frames: *frames, models };
        results.push(limit::compute(scene, &plan, &Terminal::new(common))?);
    }
    let written = scenes.iter().zip(&results).filter_map(|(it, result)| {
        folder_of(&it.scene).map(|folder| written_files(&folder, result, common))
    });
    Written::put_in_place(written.collect::<Result<_>>()?)?;
    let folder = arguments.to.output.as_deref();
    let (sections, place) = match &results[..] {
        [result] => (report::of_limit(result), ""),
        results => (report::of_limits(results), "/SCENE"),
    };
    let names = [FILES.files, &["figures/"]].concat().join(", ");
    let written = folder.map(|it| format!("\nwritten to {}{place}: {names}", it.display()));
    let outcome = print::sections_above(common, &sections, &Vec::from_iter(written));
    Ok(outcome.and(refusal(&results)))
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
fn refusal(results: &[LimitResult]) -> Result<()> {
    let levels = results.iter().flat_map(|result| &result.levels);
    let mut all = levels.flat_map(|level| &level.limits);
    let first = all.clone().find_map(|figures| figures.refused.as_ref());
    match first {
        Some(refused) if all.all(|figures| figures.refused.is_some()) => {
            Err(Error::failed(format!("no limit can be given: {refused}")))
        }
        _ => Ok(()),
    }
}

fn written_files(folder: &Path, result: &LimitResult, common: &Common) -> Result<Written> {
    let command = command_line::of_this_process("limit", &["-o", "--output"], Some(result.seed));
    let sections = report::of_limit(result);
    let (json, page) = (print::file_of(common, &sections), sections.page(&command));
    let mut files = vec![("limit.json", json.as_bytes())];
    files.extend(page.files("limit.html"));
    Ok(FILES.written(folder, &files)?)
}

//! Exported models in C and Rust: compiled in many ways, and compared with taxel-core bit for bit (docs/c.md).

mod models;
mod frames;
mod build;
mod count;
mod rust;

use std::fs;
use std::path::{Path, PathBuf};

use taxel_core::health::Limits;
use taxel_learn::export::c::{Name, library};

use crate::process::{Outcome, first_line, target_dir, two_at_a_time};
use build::Build;
use models::Model;

/// Frames that each model is tried with: in full, and in the short form.
const FRAMES: [usize; 2] = [10_000, 300];

/// What to try.
#[derive(clap::Args)]
pub struct Options {
    /// Try few frames with few compilers, as CI does.
    #[arg(long)]
    short: bool,
}

/// Exports models, compiles them in many ways, runs each, and prints what is equal and what instructions it takes.
pub fn run(options: &Options) -> Outcome {
    let folder = target_dir().join("c");
    let frames = FRAMES[usize::from(options.short)];
    let models = models::all(frames)?;
    for model in &models {
        export(model, &folder.join(model.name()), frames)?;
    }
    let builds = Build::all(options.short);
    let missing = missing(&builds);
    let is_there = |build: &&Build| build.needs().iter().all(|it| !missing.contains(it));
    let present: Vec<&Build> = builds.iter().filter(is_there).collect();
    let mut failed = compare(&present, &models, &folder, frames)?;
    failed.extend(rust::compare(&models, &folder).err());
    if let Some(build) = present.iter().find(|build| build.needs().contains(&build::ARM)) {
        failed.extend(count::print(&models, &folder, build).err());
    }
    if !missing.is_empty() {
        let missing = missing.join(", ");
        failed.push(format!("not installed: {missing}; `bash firmware/setup.sh` installs all"));
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

/// Tries all models in all these ways, prints a table, and returns what differs and should not.
fn compare(
    builds: &[&Build],
    models: &[Model],
    folder: &Path,
    frames: usize,
) -> Outcome<Vec<String>> {
    let jobs: Vec<(&Build, &Model)> =
        builds.iter().flat_map(|build| models.iter().map(move |model| (*build, model))).collect();
    let outcomes =
        two_at_a_time(&jobs, |(build, model)| build.compare(&folder.join(model.name())))?;
    let names: Vec<String> = models.iter().map(Model::name).collect();
    println!("{frames} frames of each model, all bits:\n");
    println!("| compiler | {} |\n|---|{}", names.join(" | "), "---|".repeat(names.len()));
    let mut failed = Vec::new();
    for (build, outcomes) in builds.iter().zip(outcomes.chunks(models.len())) {
        let differs = |cause: &String| cause.starts_with("frame ");
        let cell = |outcome: &Outcome| match outcome {
            Ok(()) => "equal",
            Err(cause) if differs(cause) => "differs",
            Err(_) => "fails",
        };
        let cells: Vec<&str> = outcomes.iter().map(cell).collect();
        println!("| {} | {} |", build.name(), cells.join(" | "));
        let differences: Vec<String> = outcomes
            .iter()
            .zip(&names)
            .filter_map(|(outcome, name)| {
                Some(format!("{}, {name}: {}", build.name(), outcome.as_ref().err()?))
            })
            .collect();
        let any_differs = outcomes.iter().filter_map(|it| it.as_ref().err()).any(differs);
        if !build.is_spoilt() {
            failed.extend(differences);
        } else if !any_differs {
            failed.push(format!(
                "{}: no model differs, so that the pragma is not tried",
                build.name()
            ));
        }
    }
    Ok(failed)
}

/// Programs that builds need and that are not there.
fn missing(builds: &[Build]) -> Vec<&'static str> {
    let mut needed: Vec<&str> = builds.iter().flat_map(Build::needs).copied().collect();
    needed.sort_unstable();
    needed.dedup();
    needed.retain(|program| first_line(program, &["--version"]).is_none());
    needed
}

/// Writes the library of `model`, and frames for it, to `folder`.
fn export(model: &Model, folder: &Path, frames: usize) -> Outcome {
    let failed = |path: &Path, cause: std::io::Error| format!("{}: {cause}", path.display());
    let name = Name::new("model").map_err(|cause| cause.to_string())?;
    for (path, text) in
        library(&model.blob, &name, Some(Limits::USUAL)).map_err(|cause| cause.to_string())?
    {
        let path: PathBuf = folder.join(path);
        let around = path.parent().unwrap_or(folder);
        fs::create_dir_all(around).map_err(|cause| failed(around, cause))?;
        fs::write(&path, text).map_err(|cause| failed(&path, cause))?;
    }
    frames::write(model, frames, true, &folder.join(build::FRAMES))
}

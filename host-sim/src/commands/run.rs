//! Command `run`: the main job, from scene to blob to report.

use std::path::Path;

use super::progress::Terminal;
use crate::Result;
use crate::report::{self, Sections};
use crate::run::{self, RunResult};

use clap::Args;
use taxel_data::output::FileSet;
use taxel_evaluate::table1;
use taxel_learn::ModelBlob;

use super::decoder_arguments::LimitArgument;
use super::format_note::note_format;
use super::subject_argument::SubjectArgument;
use super::{Common, arguments, command_line, print, refused_readings};

/// All files that a run may write.
const FILES: FileSet = FileSet {
    files: &["model.bin", "metrics.json", "table1.csv", "report.html"],
    inner: report::figures_named(&[
        "decoded-against-true",
        "sizes-of-errors",
        "errors-by-electrode",
        "errors-over-time",
        "readings-at-rest",
        "trajectory",
        "readings",
        "frames",
        "arrows",
        "places",
        "sensor",
        "error-by-noise",
    ]),
};

/// Do the whole job for a scene or a CSV file: train, write the blob, evaluate, report.
///
/// Writes model.bin, metrics.json, table1.csv, report.html and its figures/ to `out/<name>/` (-o: `DIR/<name>/`), all
/// together at the end, and removes those of an earlier run. The frames of a scene are synthesised. The last fifth of a
/// CSV file is held out for evaluation.
#[derive(Args, Default)]
#[command(after_help = "Examples:
  taxel run press --noise 0.01 -o out/noise-1
  taxel run measured.csv --inputs 'ch*' --outputs 'f?_n' --fold-column fold")]
pub struct Arguments {
    #[command(flatten)]
    to: arguments::OutputFolder,
    #[command(flatten)]
    limit: LimitArgument,
    #[command(flatten)]
    subject: SubjectArgument,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let subject = arguments.subject.load(common)?;
    let options = subject.options();
    let folder = arguments.to.in_out().join(subject.name());
    FILES.check(&folder, &arguments.subject.paths())?;
    refused_readings::note_scene(&subject, common);
    let started = std::time::Instant::now();
    let progress = Terminal::new(common);
    let outcome = run::run(&subject, &options, arguments.limit.frames(), &progress);
    let (mut result, blob) =
        outcome.map_err(|error| arguments::blamed(error, arguments.subject.training()))?;
    if let Some(scene) = subject.scene().filter(|scene| scene.table1.is_some()) {
        result.table1 = Some(table1::compute(scene, &progress)?);
    }
    let command = command_line::of_this_process("run", &["-o", "--output"], Some(result.seed));
    note_format(&blob.parse(), &options, result.device_cost.cycles, common);
    let mut sections = report::of_run(&result);
    let files = write_files(&folder, &result, &blob, (&mut sections, &command), common)?;
    let mut more = vec![
        format!("written to {}: {}", folder.display(), files.join(", ")),
        format!("Next: open {}", folder.join("report.html").display()),
    ];
    if result.scene.is_some() && result.subject == "press" {
        more.push("The paper's own scene is `run paper`, and its Table 1 `table1`.".into());
    }
    common.remark(format_args!("done in {:.1} s", started.elapsed().as_secs_f64()));
    Ok(print::sections_above(common, &sections, &more))
}

fn write_files(
    folder: &Path,
    result: &RunResult,
    blob: &ModelBlob,
    (sections, command): (&mut Sections, &str),
    common: &Common,
) -> Result<Vec<&'static str>> {
    let metrics = print::file_of(common, sections);
    let table = result.table1.as_ref().map(report::table1_csv);
    let mut files = vec![("model.bin", blob.bytes()), ("metrics.json", metrics.as_bytes())];
    files.extend(table.as_ref().map(|table| ("table1.csv", table.as_bytes())));
    let mut names: Vec<&'static str> = files.iter().map(|(name, _)| *name).collect();
    sections.files = names.iter().map(|name| (*name).to_owned()).collect();
    let page = sections.page(command);
    let files = files.into_iter().chain(page.files("report.html"));
    FILES.write(folder, &files.collect::<Vec<_>>())?;
    names.extend(["report.html", "figures/"]);
    Ok(names)
}

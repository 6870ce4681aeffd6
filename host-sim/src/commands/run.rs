//! Command `run`: the main job, from scene to blob to report.

use std::path::{Path, PathBuf};

use super::progress::Terminal;
use crate::Result;
use crate::evaluate::moving_contacts::MovingContacts;
use crate::evaluate::table1::Table1;
use crate::report::{self, Made};
use crate::run::{self, RunResult};
use crate::subject::Subject;
use clap::Args;
use taxel_data::output::FileSet;
use taxel_learn::{ModelBlob, Options};

use super::model_argument::{ModelArguments, NetworkArguments, note_format};
use super::subject_argument::SubjectArgument;
use super::{Common, arguments, command_line, print, refused_readings, stderr};

const DEFAULT_OUTPUT: &str = "out";
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
/// Writes model.bin, metrics.json, table1.csv, report.html and its figures/ to `out/<name>/`, all together at the end;
/// those of an earlier run go. Frames of a scene are synthesised. Of a CSV file, the last fifth is held out to judge by.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim run press --noise 0.01 -o out/noise-1
  host-sim run measured.csv --inputs 'ch*' --outputs 'f?_n' --fold-column fold")]
pub struct Arguments {
    #[command(flatten)]
    network: NetworkArguments,
    #[command(flatten)]
    model: ModelArguments,
    /// Folder that receives a folder named after the scene.
    #[arg(short, long, value_name = "DIR", value_parser = arguments::folder(), default_value = DEFAULT_OUTPUT)]
    output: PathBuf,
    #[command(flatten)]
    subject: SubjectArgument,
}

impl Default for Arguments {
    fn default() -> Self {
        Self {
            subject: SubjectArgument::default(),
            network: NetworkArguments::default(),
            model: ModelArguments::default(),
            output: DEFAULT_OUTPUT.into(),
        }
    }
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let centres = arguments.network.centres.iter().min().copied();
    let mut subject = arguments.subject.load_with(common, centres)?;
    let mut options = arguments.model.over(&mut subject);
    arguments.network.apply(&mut options)?;
    options.check(subject.training_frames())?;
    let folder = arguments.output.join(subject.name());
    FILES.check(&folder, &arguments.subject.paths())?;
    refused_readings::note_scene(&subject);
    run_into(&folder, &subject, &options, common)
}

fn run_into(folder: &Path, subject: &Subject, options: &Options, common: &Common) -> Result<()> {
    let started = std::time::Instant::now();
    let (result, blob) = run::run(subject, options, &Terminal::new())?;
    let command = command_line::of_this_process("run", &["-o", "--output"], Some(result.seed));
    note_format(&blob.parse(), options, result.device_cost.cycles);
    let files = write_files(folder, &result, &blob, command)?;
    if common.json {
        return print::json(&result);
    }
    page_of(&result, folder, &files).print()?;
    stderr::remark(format_args!("done in {:.1} s", started.elapsed().as_secs_f64()));
    Ok(())
}

fn write_files(
    folder: &Path,
    result: &RunResult,
    blob: &ModelBlob,
    command: String,
) -> Result<Vec<&'static str>> {
    let metrics = print::json_text(result)?;
    let table = result.table1.as_ref().map(Table1::to_csv);
    let mut files = vec![("model.bin", blob.bytes()), ("metrics.json", metrics.as_bytes())];
    files.extend(table.as_ref().map(|table| ("table1.csv", table.as_bytes())));
    let mut names: Vec<&'static str> = files.iter().map(|(name, _)| *name).collect();
    let made = Made { command, files: names.iter().map(|name| (*name).to_owned()).collect() };
    let page = report::html(result, &made);
    let figures = page.figures.iter().map(|(path, text)| (path.as_str(), text.as_bytes()));
    let page = [("report.html", page.html.as_bytes())];
    FILES.write(folder, &files.into_iter().chain(page).chain(figures).collect::<Vec<_>>())?;
    names.extend(["report.html", "figures/"]);
    Ok(names)
}

/// Adds the errors on contacts that move.
fn moving_page(page: &mut print::Page, moving: &MovingContacts) {
    let Some(times) = moving.ways.first().map(|way| way.times) else { return };
    page.line("");
    print::wrapped(
        page,
        &format!(
            "As a robot meets it, on {}: newest finished estimate against the truth at that moment. The board finishes an \
             estimate {:.2} ms after the start of its scan, so that it is {:.2} ms old when it is used, on average.",
            moving.path.in_words(),
            times.frame_ms,
            times.age_ms.unwrap_or_default()
        ),
    );
    let ways = moving.ways.iter();
    let ways = ways
        .map(|way| (if way.filter.is_some() { "filtered" } else { "network" }, &way.errors[..]));
    let decoders = moving.decoders.iter().map(|it| (it.decoder.as_str(), &it.errors[..]));
    print::errors(page, &ways.chain(decoders).collect::<Vec<_>>());
    for filter in moving.ways.iter().filter_map(|way| way.filter) {
        page.line(format_args!(
            "the filter: host-sim link PORT configure --filter-ms {} --lead-ms {} (docs/filter.md)",
            filter.time_constant_ms, filter.lead_ms
        ));
    }
}

fn page_of(result: &RunResult, folder: &Path, files: &[&str]) -> print::Page {
    let mut page = print::Page::default();
    let model = &result.model;
    let from = match (&result.scene, &result.data) {
        (Some(scene), _) => format!(
            "{} noise {}{}, {} training and {} test frames",
            scene.noise_kind.name(),
            scene.noise_kind.in_words(scene.noise_level),
            match scene.gain_drift {
                0.0 => String::new(),
                gain => format!(", gain drift ±{} %", gain * 100.0),
            },
            model.training_frames,
            model.test_frames
        ),
        (None, data) => format!(
            "{} training frames, {} test frames: {}",
            model.training_frames,
            model.test_frames,
            data.as_ref().map_or("", |data| data.test_choice.as_str())
        ),
    };
    page.line(format_args!("{}: {from}, seed {}", result.subject, result.seed));
    let [inputs, outputs] = model.ends("->");
    page.line(format_args!(
        "model: {} network{}, {inputs} -> K = {} -> {outputs}, spread {}{}, {} bytes, CRC-32 {}",
        model.networks,
        if model.networks == 1 { "" } else { "s" },
        model.centres,
        model.spread,
        if model.refined { " (refined)" } else { "" },
        model.blob_bytes,
        model.model_crc
    ));
    page.line(format_args!(
        "a frame on a Cortex-M4F: {} instructions, {} cycles",
        model.frame_cost.instructions, model.frame_cost.cycles
    ));
    if let Some(choice) = &result.features {
        print::wrapped(&mut page, &choice.to_string());
    }
    page.line("");
    let decoders: Vec<_> =
        result.decoders.iter().map(|d| (d.decoder.as_str(), d.errors.as_slice())).collect();
    print::errors(&mut page, &decoders);
    print::errors_legend(&mut page);
    print::wrapped(&mut page, &result.limit.note());
    if let Some(moving) = &result.moving {
        moving_page(&mut page, moving);
    }
    print::by_load(&mut page, &result.by_load);
    if let Some(others) = &result.others {
        print::others(&mut page, others, &result.decoders);
    }
    if !result.by_row.is_empty() {
        let wires = result.by_row.iter().map(|row| row.row_wire.to_string());
        let wires: Vec<String> = wires.collect();
        page.line(format_args!("\nnetwork RMSE by row-wire ({}):", wires.join(", ")));
    }
    for group in result.by_row.first().map_or(&[][..], |row| &row.errors) {
        let of_row = |errors: &run::RowErrors| {
            let found = errors.errors.iter().find(|e| e.group == group.group);
            found.map_or(String::new(), |e| format!(" {:.4}", e.rmse))
        };
        let rows: String = result.by_row.iter().map(of_row).collect();
        page.line(format_args!("  {:<7}{rows} {}", group.group, group.unit));
    }
    page.line(format_args!("\nwritten to {}: {}", folder.display(), files.join(", ")));
    print::verdict(&mut page, None, &result.verdict);
    page.line(format_args!("\nNext: open {}", folder.join("report.html").display()));
    if result.scene.is_some() && result.subject == "press" {
        page.line("The paper's own scene is `run paper`, and its Table 1 `table1`.");
    }
    page
}

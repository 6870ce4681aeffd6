//! Command `run`: the main job, from scene to blob to report.

use std::path::{Path, PathBuf};

use super::progress::Terminal;
use clap::Args;
use host_sim::experiment::Experiment;
use host_sim::run::{self, RunResult};
use host_sim::{Error, Result, report};
use taxel_data::output;
use taxel_learn::ModelBlob;

use super::subject_argument::SubjectArgument;
use super::{Common, print};

const DEFAULT_OUTPUT: &str = "out";
/// Names of all files that a run may write.
const FILES: [&str; 4] = ["model.bin", "metrics.json", "table1.csv", "report.html"];

/// Run a scene: synthesise, train, write the blob, evaluate, report.
///
/// Writes model.bin, metrics.json, table1.csv and report.html to out/<scene>/.
#[derive(Args)]
#[command(after_help = "Example: host-sim run press --noise 0.01 -o out/noise-1")]
pub struct Arguments {
    #[command(flatten)]
    subject: SubjectArgument,
    /// Folder that receives a folder named after the scene.
    #[arg(short, long, value_name = "DIR", default_value = DEFAULT_OUTPUT)]
    output: PathBuf,
}

impl Default for Arguments {
    fn default() -> Self {
        Self { subject: SubjectArgument::default(), output: DEFAULT_OUTPUT.into() }
    }
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let subject = arguments.subject.load(common)?;
    let Some(scene) = subject.scene() else {
        let message = format!("run {}: give a scene, and train on a CSV file", subject.name());
        return Err(Error::Usage(message));
    };
    let folder = arguments.output.join(&scene.name);
    output::in_folder(&folder, || run_into(&folder, scene, &arguments.subject.paths(), common))
}

fn run_into(folder: &Path, scene: &Experiment, inputs: &[&Path], common: &Common) -> Result<()> {
    for file in FILES {
        output::check_writable(&folder.join(file), inputs)?;
    }
    let started = std::time::Instant::now();
    let (result, blob) = run::run(scene, &Terminal::new())?;
    let files = write_files(folder, &result, &blob)?;
    if common.json {
        return print::json(&result);
    }
    page_of(&result, folder, &files).print()?;
    eprintln!("done in {:.1} s", started.elapsed().as_secs_f64());
    Ok(())
}

fn write_files(folder: &Path, result: &RunResult, blob: &ModelBlob) -> Result<Vec<&'static str>> {
    let mut files = vec!["model.bin", "metrics.json"];
    output::write_bytes(&folder.join("model.bin"), blob.bytes())?;
    let metrics = serde_json::to_vec_pretty(result)
        .map_err(|cause| Error::Failed(format!("cannot write JSON: {cause}")))?;
    output::write_bytes(&folder.join("metrics.json"), &metrics)?;
    if let Some(table) = &result.table1 {
        table.write_csv(&folder.join("table1.csv"))?;
        files.push("table1.csv");
    }
    output::write_bytes(&folder.join("report.html"), report::html(result).as_bytes())?;
    files.push("report.html");
    Ok(files)
}

fn page_of(result: &RunResult, folder: &Path, files: &[&str]) -> print::Page {
    let mut page = print::Page::default();
    let (scene, model) = (&result.scene, &result.model);
    page.line(format_args!(
        "{}: {} noise {} %{}, seed {}, {} training and {} test frames",
        scene.name,
        scene.noise_kind,
        scene.noise_level * 100.0,
        match scene.gain_drift {
            0.0 => String::new(),
            gain => format!(", gain drift ±{} %", gain * 100.0),
        },
        scene.seed,
        model.training_frames,
        model.test_frames
    ));
    page.line(format_args!(
        "model: {} network{}, {} -> K = {} -> {}, spread {}{}, {} bytes, CRC-32 {}",
        model.networks,
        if model.networks == 1 { "" } else { "s" },
        {
            let readings = if model.relative_inputs { "relative readings" } else { "readings" };
            match model.projected_readings {
                0 => format!("{} {readings}", model.inputs),
                count => format!("{count} {readings} -> {} features", model.inputs),
            }
        },
        model.centres,
        match model.expanded_outputs {
            0 => format!("{} outputs", model.outputs),
            all => format!("{} components -> {all} outputs", model.outputs),
        },
        model.spread,
        if model.refined { " (refined)" } else { "" },
        model.blob_bytes,
        model.blob_crc
    ));
    page.line(format_args!(
        "a frame on a Cortex-M4F: {} instructions, {} cycles at zero wait, {} from flash",
        model.frame.instructions, model.frame.cycles, model.frame.flash_cycles
    ));
    page.line("");
    let decoders: Vec<_> =
        result.decoders.iter().map(|d| (d.decoder.as_str(), d.errors.as_slice())).collect();
    print::errors(&mut page, &decoders);
    print::errors_legend(&mut page);
    page.line(result.limit.note());
    print::by_depth(&mut page, &result.by_depth);
    if !result.rows.is_empty() {
        let wires = result.rows.iter().map(|row| row.row_wire.to_string());
        let wires: Vec<String> = wires.collect();
        page.line(format_args!("\nnetwork RMSE by row-wire ({}):", wires.join(", ")));
    }
    for group in result.rows.first().map_or(&[][..], |row| &row.errors) {
        let of_row = |errors: &run::RowErrors| {
            let found = errors.errors.iter().find(|e| e.group == group.group);
            found.map_or(String::new(), |e| format!(" {:.4}", e.rmse))
        };
        let rows: String = result.rows.iter().map(of_row).collect();
        page.line(format_args!("  {:<7}{rows} {}", group.group, group.unit));
    }
    if let Some(table) = &result.table1 {
        for group in table.groups() {
            let ratio = table.worst_ratio_to_mean(group).unwrap_or(f64::NAN);
            page.line(format_args!(
                "table 1, {group}: worst cell {ratio:.3} × the RMSE of the mean"
            ));
        }
    }
    page.line(format_args!("\nwritten to {}: {}", folder.display(), files.join(", ")));
    page
}

//! Command `decode`: readings to estimates, with a trained model.

use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::{Error, Result};
use serde::Serialize;
use taxel_data::csv_file;
use taxel_data::data_file::DataFile;
use taxel_data::output;
use taxel_data::table::Table;
use taxel_learn::infer::is_missing;
use taxel_learn::{Exponential, ModelBlob, PreparedModel};

use super::arguments::exponential;
use super::readings::{BaselineArgument, model_inputs};
use super::{Common, print};

/// Decode readings from a CSV file, one line of estimates a line.
///
/// Where a reading is missing, the outputs of its row-wire are left empty. If one network decodes the whole
/// array, all outputs of the line are.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim decode press.bin readings.csv -o estimate.csv
  host-sim decode press.bin readings.csv --confidence -o estimate.csv
  host-sim decode relative.bin readings.csv --baseline rest.csv -o estimate.csv")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file with the model's reading columns, in any order, among others.
    readings: PathBuf,
    /// CSV file to write, with the model's output columns.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Also write a column NAME_deviation for each output NAME, and novelty_nats, of a model with a confidence: 68 % of
    /// errors are within one deviation, and above 0 a frame is novel (docs/confidence.md).
    #[arg(long)]
    confidence: bool,
    #[command(flatten)]
    baseline: BaselineArgument,
    /// Exponential of the activations.
    #[arg(long, alias = "kernel", value_parser = exponential(), default_value = "polynomial")]
    exponential: Exponential,
}

#[derive(Serialize)]
struct Summary {
    frames: usize,
    frames_with_missing_readings: usize,
    /// Number of novel frames, if confidence was asked for.
    novel_frames: Option<usize>,
    exponential: Exponential,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let baseline = arguments.baseline.baseline.as_ref().unwrap_or(&arguments.readings);
    output::check_writable(&arguments.output, &[&arguments.model, &arguments.readings, baseline])?;
    let blob = ModelBlob::read(&arguments.model)?;
    let model = arguments.baseline.apply(blob.prepare(arguments.exponential), &arguments.model)?;
    let file = DataFile::read(&arguments.readings)?;
    let readings = model_inputs(&model, &file)?;
    remark_on_range(&model, &readings);
    let estimate = model.decode_table(&readings);
    let assessed = arguments.confidence.then(|| model.assess(&readings.values));
    let assessed = match assessed {
        Some(None) => {
            let message = "it has no confidence: train it with --confidence".into();
            return Err(Error::Unfit { path: arguments.model.clone(), message });
        }
        Some(assessed) => assessed,
        None => None,
    };
    write(&arguments.output, &estimate, assessed.as_ref())?;
    let inputs = model.model_inputs(&readings.values);
    let frames = inputs.chunks_exact(readings.names.len());
    let incomplete = frames.filter(|frame| frame.iter().any(|v| is_missing(*v))).count();
    let summary = Summary {
        frames: estimate.len(),
        frames_with_missing_readings: incomplete,
        novel_frames: assessed.map(|(_, novelty)| novelty.iter().filter(|n| **n > 0.0).count()),
        exponential: arguments.exponential,
        file: arguments.output.clone(),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!("{} frames decoded into {}", summary.frames, summary.file.display()));
    if let Some(novel) = summary.novel_frames {
        page.line(format_args!("{novel} of them are novel: unlike the frames of training"));
    }
    if incomplete > 0 {
        let lost = if model.model().projection().is_some() {
            "all outputs are empty there"
        } else {
            "the outputs of its row-wire are empty"
        };
        page.line(format_args!("{incomplete} of them miss a reading: {lost}"));
    }
    page.print()
}

/// Writes the estimates, and what was `assessed` of them: deviations and the novelty of each frame.
fn write(path: &Path, estimate: &Table, assessed: Option<&(Vec<f64>, Vec<f64>)>) -> Result<()> {
    let names = estimate.names.iter().cloned();
    let Some((deviations, novelty)) = assessed else {
        let lines = estimate.lines().map(|line| line.iter().copied());
        return Ok(csv_file::write(path, estimate.names.iter().map(String::as_str), lines)?);
    };
    let of_deviations = estimate.names.iter().map(|name| format!("{name}_deviation"));
    let names: Vec<String> = names.chain(of_deviations).chain(["novelty_nats".into()]).collect();
    let lines = estimate.lines().zip(deviations.chunks_exact(estimate.names.len())).zip(novelty);
    let lines = lines.map(|((values, deviations), novelty)| {
        values.iter().chain(deviations).chain([novelty]).copied()
    });
    Ok(csv_file::write(path, names.iter().map(String::as_str), lines)?)
}

/// Share of clamped readings above which the model probably belongs to another sensor.
const SUSPICIOUS: f64 = 0.01;

/// Remarks on stderr if many readings lie outside the range that the model was trained on.
pub fn remark_on_range(model: &PreparedModel<'_>, readings: &Table) {
    let share = model.share_out_of_range(&readings.values);
    if share > SUSPICIOUS {
        eprintln!(
            "note: {:.1} % of the readings lie outside the range that the model was trained on, and \
             are clamped; is it the right model for this sensor?",
            100.0 * share
        );
    }
}

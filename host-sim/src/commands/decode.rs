//! Command `decode`: readings to estimates, with a trained model.

use std::path::PathBuf;

use clap::Args;
use host_sim::Result;
use serde::Serialize;
use taxel_data::csv_file::{self, CsvFile};
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
  host-sim decode relative.bin readings.csv --baseline rest.csv -o estimate.csv")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file with the model's reading columns, in any order, among others.
    readings: PathBuf,
    /// CSV file to write, with the model's output columns.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
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
    exponential: Exponential,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let baseline = arguments.baseline.baseline.as_ref().unwrap_or(&arguments.readings);
    output::check_writable(&arguments.output, &[&arguments.model, &arguments.readings, baseline])?;
    let blob = ModelBlob::read(&arguments.model)?;
    let model = arguments.baseline.apply(blob.prepare(arguments.exponential), &arguments.model)?;
    let file = CsvFile::read(&arguments.readings)?;
    let readings = model_inputs(&model, &file)?;
    remark_on_range(&model, &readings);
    let estimate = model.decode_table(&readings);
    let names = estimate.names.iter().map(String::as_str);
    csv_file::write(&arguments.output, names, estimate.lines().map(|l| l.iter().copied()))?;
    let inputs = model.model_inputs(&readings.values);
    let frames = inputs.chunks_exact(readings.names.len());
    let incomplete = frames.filter(|frame| frame.iter().any(|v| is_missing(*v))).count();
    let summary = Summary {
        frames: estimate.len(),
        frames_with_missing_readings: incomplete,
        exponential: arguments.exponential,
        file: arguments.output.clone(),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!("{} frames decoded into {}", summary.frames, summary.file.display()));
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

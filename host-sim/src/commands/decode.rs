//! `decode`: readings to estimates, with a trained model.

use std::path::PathBuf;

use clap::Args;
use host_sim::data_file::{self, DataFile};
use host_sim::dataset::Table;
use host_sim::infer::{Kernel, is_missing};
use host_sim::model::LoadedModel;
use host_sim::{Result, output};
use serde::Serialize;

use super::{Common, print};

/// Decode readings from a CSV file; one line of estimates for every line of readings.
///
/// Where a reading is missing, the outputs of its row-wire are left empty; those of all, if one network decodes
/// the whole array.
#[derive(Args)]
#[command(after_help = "Example: host-sim decode press.bin readings.csv -o estimate.csv")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file with the model's reading columns, in any order, among others.
    readings: PathBuf,
    /// CSV file to write, with the model's output columns.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Exponential of the activations.
    #[arg(long, value_enum, default_value_t)]
    kernel: Kernel,
}

#[derive(Serialize)]
struct Summary {
    frames: usize,
    frames_with_missing_readings: usize,
    kernel: Kernel,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let loaded = LoadedModel::read(&arguments.model)?;
    let file = DataFile::read(&arguments.readings)?;
    output::check_writable(&arguments.output, &[&arguments.model, &arguments.readings])?;
    let readings = model_inputs(&loaded, &file)?;
    remark_on_range(&loaded, &readings);
    let estimate = loaded.decode(arguments.kernel, &readings);
    let names = estimate.names.iter().map(String::as_str);
    data_file::write(&arguments.output, names, estimate.lines().map(|l| l.iter().copied()))?;
    let incomplete = readings.lines().filter(|line| line.iter().any(|v| is_missing(*v))).count();
    let summary = Summary {
        frames: estimate.len(),
        frames_with_missing_readings: incomplete,
        kernel: arguments.kernel,
        file: arguments.output.clone(),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!("{} frames decoded into {}", summary.frames, summary.file.display()));
    if incomplete > 0 {
        let lost = if loaded.model().projection().is_some() {
            "all outputs are empty there"
        } else {
            "the outputs of its row-wire are empty"
        };
        page.line(format_args!("{incomplete} of them miss a reading: {lost}"));
    }
    page.print()
}

/// Share of clamped readings above which the model is likely to be another sensor's.
const SUSPICIOUS: f64 = 0.01;

/// Says on stderr if many readings lie outside what the model was trained on.
pub fn remark_on_range(loaded: &LoadedModel, readings: &Table) {
    let share = loaded.share_out_of_range(readings);
    if share > SUSPICIOUS {
        eprintln!(
            "note: {:.1} % of the readings lie outside the range that the model was trained on, and \
             are clamped; is it the right model for this sensor?",
            100.0 * share
        );
    }
}

/// The model's reading columns of `file`.
pub fn model_inputs(loaded: &LoadedModel, file: &DataFile) -> Result<Table> {
    let model = loaded.model();
    table_of(file, model.metadata().input_names.iter())
}

/// The columns of `file` called `names`.
pub fn table_of<'n>(file: &DataFile, names: impl Iterator<Item = &'n str>) -> Result<Table> {
    let names: Vec<&str> = names.collect();
    let columns = file.columns(names.iter().copied())?;
    let lines = 0..file.lines();
    let values = lines.flat_map(|line| columns.iter().map(move |c| file.value(line, *c)));
    Ok(Table { values: values.collect(), names: names.into_iter().map(String::from).collect() })
}

//! `eval`: a model's errors on data whose outputs are known.

use std::path::PathBuf;

use clap::Args;
use host_sim::Result;
use host_sim::data_file::DataFile;
use host_sim::evaluate::metrics::{self, Errors, Measure};
use host_sim::infer::Kernel;
use host_sim::model::LoadedModel;
use serde::Serialize;

use super::{Common, decode, print};

/// Evaluate a model on a CSV file that holds readings and true outputs.
#[derive(Args)]
#[command(after_help = "Example: host-sim eval press.bin press.csv")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file with the model's reading and output columns.
    data: PathBuf,
    /// Exponential of the activations.
    #[arg(long, value_enum, default_value_t)]
    kernel: Kernel,
}

#[derive(Serialize)]
struct Summary {
    frames: usize,
    kernel: Kernel,
    errors: Vec<Errors>,
    /// Errors of answering the mean of these very outputs.
    mean_errors: Vec<Errors>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let loaded = LoadedModel::read(&arguments.model)?;
    let file = DataFile::read(&arguments.data)?;
    let readings = decode::model_inputs(&loaded, &file)?;
    let model = loaded.model();
    let metadata = model.metadata();
    let truth = decode::table_of(&file, metadata.output_names.iter())?;
    let estimate = loaded.decode(arguments.kernel, &readings);
    let thickness_mm = f64::from(metadata.thickness_mm);
    let measure = Measure {
        full_scale: metadata.full_scale.iter().map(f64::from).collect(),
        thickness_mm: (thickness_mm > 0.0).then_some(thickness_mm),
    };
    let summary = Summary {
        frames: readings.len(),
        kernel: arguments.kernel,
        errors: metrics::by_group(&truth, &estimate.values, &measure),
        mean_errors: metrics::by_group(&truth, &truth.column_means(), &measure),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!("{} frames of {}", summary.frames, arguments.data.display()));
    print::errors(&mut page, &[("model", &summary.errors), ("mean", &summary.mean_errors)]);
    print::errors_legend(&mut page);
    page.print()
}

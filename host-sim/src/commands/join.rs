//! Command `join`: two logs as one table.

use std::path::PathBuf;

use crate::Result;
use clap::Args;
use serde::Serialize;
use taxel_data::csv_file;

use super::data_file::{FieldArguments, JoinArguments};
use super::{Common, print};

/// Join two logs by time: each line of one with the line of the other whose time stamp is nearest.
///
/// Both may be CSV files, with a header or without, or numpy's .npy or .npz. Columns of the second that the first has
/// too are called b.NAME. Time stamps may repeat, but not decrease.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim join sensor.csv robot.csv --on time_s --tolerance 0.01 -o joined.csv
  host-sim join sensor.csv robot.csv --on time_s,stamp_s --tolerance 0.01 --lag -0.25 -o joined.csv
  host-sim join sensor.npy scale.csv --on c1 --tolerance 0.01 --missing -1 -o joined.csv")]
pub struct Arguments {
    /// First log: its lines are kept, in their order.
    first: PathBuf,
    /// Second log: each line of the first takes one of its lines.
    second: PathBuf,
    #[command(flatten)]
    how: JoinArguments,
    #[command(flatten)]
    fields: FieldArguments,
    /// CSV file to write: columns of the first log, then those of the second.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    frames: usize,
    columns: usize,
    /// Frames of the first log without a partner in the second.
    frames_without_partner: usize,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    print::check_output(&arguments.output, &[&arguments.first, &arguments.second])?;
    let first = arguments.fields.read(&arguments.first)?;
    let second = arguments.fields.read(&arguments.second)?;
    let joined = arguments.how.join(&first, &second)?;
    let lines = joined.rows().map(|row| row.iter().copied());
    csv_file::write(&arguments.output, joined.header.iter().map(String::as_str), lines)?;
    let summary = Summary {
        frames: joined.lines(),
        columns: joined.header.len(),
        frames_without_partner: first.lines() - joined.lines(),
        file: arguments.output.clone(),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!(
        "{} lines of {} columns in {}",
        summary.frames,
        summary.columns,
        summary.file.display()
    ));
    page.print()
}

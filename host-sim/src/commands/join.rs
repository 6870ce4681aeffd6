//! Command `join`: two logs as one table.

use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_data::csv_file::{self, Column};
use taxel_data::join::{Join, Joined, Time};
use taxel_data::{DataFile, columns};

use super::arguments::of_option;
use super::data_file::FieldArguments;
use super::{Common, print, stderr};

/// Join two logs by time: each line of one with the line of the other whose time stamp is nearest.
///
/// Both may be text of any dialect, with a header or without, or numpy's .npy or .npz. Columns of the second that the
/// first has too are called b.NAME. Time stamps may repeat, but not decrease. Fields are written as they are; whole numbers
/// of any length, such as nanoseconds since 1970, are compared exactly. Time stamps by ISO 8601 count in seconds.
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

/// Which lines of two logs belong together.
#[derive(Args)]
struct JoinArguments {
    /// Column with the time stamps of both files, or two names: of the first, and of the second.
    #[arg(long, value_name = "NAME[,NAME]")]
    on: String,
    /// Largest distance of two time stamps that belong together, in their unit. Lines without a partner are left out.
    #[arg(long, value_name = "TIME", allow_negative_numbers = true)]
    tolerance: Time,
    /// Time to add to the second file's time stamps.
    #[arg(long, value_name = "TIME", default_value = "0", allow_negative_numbers = true)]
    lag: Time,
    /// Factor from the unit of the second file's time stamps to the first one's, such as 0.001 where they count ms and
    /// s. 1 says that both count in one unit, however few lines have a partner.
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    time_factor: Option<f64>,
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
    let first = arguments.fields.read_with_text(&arguments.first)?;
    let second = arguments.fields.read_with_text(&arguments.second)?;
    let joined = arguments.how.join(&first, &second)?;
    write(&arguments.output, &joined, [&first, &second])?;
    let frames = joined.pairs.len();
    let summary = Summary {
        frames,
        columns: joined.header.len(),
        frames_without_partner: first.lines() - frames,
        file: arguments.output.clone(),
    };
    print::result(common, &summary, || {
        print::Page::of(format_args!(
            "{} lines of {} columns in {}",
            summary.frames,
            summary.columns,
            summary.file.display()
        ))
    })
}

/// Writes the lines of both logs that belong together, with their fields as they are written.
fn write(path: &Path, joined: &Joined, logs: [&DataFile; 2]) -> Result<()> {
    let lines = [0, 1].map(|log| joined.pairs.iter().map(|pair| pair[log]).collect::<Vec<_>>());
    let mut names = joined.header.iter();
    let mut columns = vec![];
    for (log, lines) in logs.iter().zip(&lines) {
        for (column, name) in (0..log.header.len()).zip(&mut names) {
            columns.push(Column::texts(name, log.texts(column)?, Some(lines)));
        }
    }
    let no_numbers = joined.pairs.iter().map(|_| []);
    Ok(csv_file::write_columns(path, columns, no_numbers)?)
}

impl JoinArguments {
    /// Joins each line of `first` with one of `second`, and says on stderr what came of it.
    fn join(&self, first: &DataFile, second: &DataFile) -> Result<Joined> {
        let names: Vec<&str> = self.on.split(',').map(str::trim).collect();
        let on = match names[..] {
            [name] => [name, name],
            [of_first, of_second] => [of_first, of_second],
            _ => {
                let message = format!(
                    "--on {}: give the column with the time stamps, or one for each file, as in time,stamp",
                    self.on
                );
                return Err(Error::Usage(message));
            }
        };
        for (file, name) in [first, second].into_iter().zip(on) {
            if let Err(taxel_data::Error::File { path, problem }) = file.column(name) {
                return Err(Error::Unfit { path, message: format!("{problem} (--on)") });
            }
        }
        let (on, tolerance, lag) = (on.map(str::to_owned), self.tolerance, self.lag);
        let join = Join { on, tolerance, lag, time_factor: self.time_factor };
        let options =
            [("tolerance", "--tolerance"), ("lag", "--lag"), ("time_factor", "--time-factor")];
        join.check().map_err(|bad| of_option(bad, &options))?;
        let joined = join.join(first, second)?;
        let pairs = joined.pairs.len();
        stderr::remark(format_args!(
            "note: {pairs} of {} lines of {} have a partner in {}, at most {} away;\n      {} are left out; the partner's columns are {}",
            first.lines(),
            first.path.display(),
            second.path.display(),
            significant(joined.largest_distance),
            first.lines() - pairs,
            columns::some_names(&joined.header[first.header.len()..])
        ));
        if joined.repeated > 0 {
            stderr::remark(format_args!(
                "note: {} lines of {} repeat the time stamp before them and are not used",
                joined.repeated,
                second.path.display()
            ));
        }
        Ok(joined)
    }
}

/// Three digits of a positive number.
fn significant(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

//! Command `noise`: whether noise at rest is white, and how far averaging pays.

use std::path::PathBuf;

use crate::verdict::sentences;
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_data::spectrum::Spectrum;
use taxel_data::{Clock, Table, columns};

use super::data_file::{DATA_FILES, DataFileArguments};
use super::{Common, print};

/// Judge a recording of the untouched sensor: white noise or with a memory, and how far averaging pays.
///
/// The noise is told by all readings together (docs/noise.md). Columns that never change, such as a force of zero, do not
/// count.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim synth press -n 5000 --untouched --frame-rate 150 -o rest.csv && host-sim noise rest.csv
  host-sim noise log.csv --inputs 'ch*' --time t_ms --first-share 0.1")]
pub struct Arguments {
    /// CSV file, .npy or .npz of frames at which nothing touches the sensor, in the order of time.
    data: PathBuf,
    /// Columns of readings, with * and ? [default: all but the time].
    #[arg(long, value_name = "GLOB", help_heading = DATA_FILES)]
    inputs: Option<String>,
    /// Column with the time of each line [default: one called time, t, timestamp, …; without one lines are counted].
    #[arg(long, value_name = "NAME", help_heading = DATA_FILES)]
    time: Option<String>,
    #[command(flatten)]
    file: DataFileArguments,
}

#[derive(Serialize)]
struct Summary {
    file: PathBuf,
    noise: Spectrum,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let file = arguments.file.read(&arguments.data)?;
    let clock = Clock::of(&file, arguments.time.as_deref())?;
    let chosen = match &arguments.inputs {
        Some(pattern) => {
            if let Some(pattern) = columns::unmatched(&file.header, pattern) {
                let known = columns::some_names(&file.header);
                return Err(Error::Usage(format!(
                    "--inputs {pattern:?} matches no column: {known}"
                )));
            }
            columns::select(&file.header, pattern)
        }
        None => (0..file.header.len())
            .filter(|at| Some(&file.header[*at]) != clock.column.as_ref())
            .collect(),
    };
    file.check_numbers(&chosen, None)?;
    let lines = 0..file.lines();
    let readings = Table {
        names: chosen.iter().map(|column| file.header[*column].clone()).collect(),
        values: lines
            .clone()
            .flat_map(|line| chosen.iter().map(move |it| (line, *it)))
            .map(|(line, column)| file.value(line, column))
            .collect(),
    };
    let times_s = (clock.unit == "s").then_some(&clock.at[..]);
    let Some(noise) = Spectrum::new(&readings, &lines.collect::<Vec<_>>(), times_s) else {
        return Err(Error::Unfit {
            path: arguments.data.clone(),
            message: "it takes 40 lines without a gap, and readings that change: give a longer recording, or --inputs".into(),
        });
    };
    let summary = Summary { file: arguments.data.clone(), noise };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    let noise = &summary.noise;
    page.line(format_args!(
        "{} frames of {} readings{}",
        noise.frames,
        noise.readings,
        noise.interval_s.map_or(String::new(), |s| format!(", one every {:.3} ms", 1000.0 * s))
    ));
    sentences(noise).into_iter().for_each(|sentence| page.line(sentence));
    page.line(format_args!(
        "{:>8} {:>15} {:>14} {:>14}",
        "averaged", "Allan deviation", "error of mean", "white noise"
    ));
    for it in &noise.averaging {
        page.line(format_args!(
            "{:>8} {:>15.3} {:>14.3} {:>14.3}",
            it.frames, it.allan, it.error, it.white
        ));
    }
    page.print()
}

//! Action `recalibrate`: the device mends its model from reference presses.

use std::io::{BufRead, Write as _};
use std::path::PathBuf;

use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_data::data_file::DataFile;
use taxel_data::table::Table;
use taxel_learn::ModelBlob;
use taxel_rig::device::recalibrate::{Outcome, recalibrate, recalibrate_from_readings};
use taxel_rig::device::{Device, Wire};

use super::super::progress::Terminal;
use super::super::readings::table_of;
use super::super::{Common, print};
use super::scan::{Confidence, ScanArguments, Wanted, configure, patience};

#[derive(Args)]
pub struct Arguments {
    /// Weight blob that is active on the device, recalibrated or not: it names the outputs.
    model: PathBuf,
    /// CSV file with a line for each press: columns of the model's outputs, and of its readings if they are known.
    presses: PathBuf,
    #[command(flatten)]
    scan: ScanArguments,
}

#[derive(Serialize)]
struct Summary {
    presses: u16,
    presses_unusable: usize,
    networks: u8,
    /// Root mean square errors on the last presses, in training errors of each output.
    error_before: f32,
    error_after: f32,
    /// CRC-32 of the model that is active now, in hexadecimal.
    model_crc: String,
}

pub fn execute<W: Wire>(
    device: &mut Device<W>,
    arguments: &Arguments,
    common: &Common,
) -> Result<()> {
    let blob = ModelBlob::read(&arguments.model)?;
    let model = blob.parse();
    let metadata = model.metadata();
    let file = DataFile::read(&arguments.presses)?;
    let outputs = table_of(&file, metadata.output_names.iter())?;
    let unfit = |message: String| Error::Unfit { path: arguments.presses.clone(), message };
    if outputs.is_empty() {
        return Err(unfit("it has no line; give one for each press".into()));
    }
    if let Some(place) = outputs.values.iter().position(|value| value.is_nan()) {
        let (line, column) = (place / outputs.names.len(), place % outputs.names.len());
        return Err(unfit(format!(
            "line {}: {} is missing; every press needs all outputs",
            file.line_number(line),
            outputs.names[column]
        )));
    }
    let identity = device.identify()?;
    if !identity.is_made_of(&model) {
        return Err(Error::Usage(
            "MODEL: the device has another model; `upload` this one, or name that one".into(),
        ));
    }
    let has_readings = metadata.input_names.iter().any(|name| file.column(name).is_ok());
    let outcome = if has_readings {
        let readings = table_of(&file, metadata.input_names.iter())?;
        recalibrate_from_readings(device, &readings, &outputs, &Terminal::new())?
    } else {
        let patience = patience(&arguments.scan, &identity);
        device.while_paused(|device| -> Result<_> {
            configure(device, &arguments.scan, Wanted::Nothing, 0.0, Confidence::Nothing)?;
            let show = |_: &mut Device<W>, number: usize| ask_for_press(number, &outputs);
            let frames = arguments.scan.frames;
            recalibrate(device, &outputs, frames, patience, show, &Terminal::new())
        })?
    };
    conclude(device, outcome, common)
}

fn conclude<W: Wire>(device: &mut Device<W>, outcome: Outcome, common: &Common) -> Result<()> {
    let Outcome { report, unusable } = outcome;
    let model_crc = format!("{:08x}", device.identify()?.model.map_or(0, |model| model.crc_32));
    let summary = Summary {
        presses: report.presses,
        presses_unusable: unusable,
        networks: report.networks,
        error_before: report.error_before,
        error_after: report.error_after,
        model_crc: model_crc.clone(),
    };
    if common.json {
        return print::json(&summary);
    }
    let mut page = print::Page::default();
    page.line(format_args!(
        "The device has mended its model: {model_crc} is active, also after a restart. `undo` returns to the previous one."
    ));
    page.line(format_args!(
        "{:<17} {} used, {unusable} unusable (a reading missing, or far out of range)",
        "presses", summary.presses
    ));
    page.line(format_args!(
        "{:<17} {:.2} times that of training before, {:.2} times after, on the last presses",
        "error", summary.error_before, summary.error_after
    ));
    page.print()
}

/// Asks for the press with this number, and waits for a line on stdin.
fn ask_for_press(number: usize, outputs: &Table) -> Result<()> {
    let line = outputs.lines().nth(number).unwrap_or_default();
    let largest = line.iter().zip(&outputs.names).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let what = match largest {
        Some((value, name)) if *value != 0.0 => format!("{name} is {value}, its largest output"),
        _ => "all outputs are 0".into(),
    };
    let mut stderr = std::io::stderr();
    // Without stderr there is nobody to be asked, and stdin decides.
    let _ = write!(stderr, "press {} of {}: {what}; then press Enter: ", number + 1, outputs.len());
    let _ = stderr.flush();
    let mut text = String::new();
    match std::io::stdin().lock().read_line(&mut text) {
        Ok(1..) => Ok(()),
        _ => Err(Error::Failed("stdin ended before all presses were made".into())),
    }
}

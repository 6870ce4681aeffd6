//! Action `recalibrate`: the model is mended from reference presses, and uploaded.

use std::io::{BufRead, Write as _};
use std::path::PathBuf;

use crate::report::Sections;
use crate::{Error, Result};
use clap::Args;
use taxel_core::blob::Model;
use taxel_core::health::Limits;
use taxel_data::{DataFile, Table, columns};
use taxel_firmware::link::message::Refusal;
use taxel_learn::ModelBlob;
use taxel_learn::health::judge;
use taxel_learn::recalibration::{self, Recalibrated};
use taxel_rig::device::{Device, DeviceIdentity, upload};

use super::super::data_file::FieldArguments;
use super::super::readings::{BaselineArgument, table_of};
use super::super::{Common, arguments, print};
use super::activate;
use super::frames::{self, hear_scans};
use super::scan::{ScanArguments, Wanted, configure, patience_for_next, reading_names};

#[derive(Args)]
pub struct Arguments {
    /// Weight blob that is active on the device.
    model: PathBuf,
    /// CSV file with a line for each press: columns of the model's outputs, and of its readings if they are known.
    presses: PathBuf,
    #[command(flatten)]
    to: arguments::WantedFile,
    #[command(flatten)]
    baseline: BaselineArgument,
    #[command(flatten)]
    scan: ScanArguments,
}

pub fn execute(
    device: &mut Device,
    arguments: &Arguments,
    common: &Common,
) -> Result<print::Outcome> {
    arguments.scan.timing.period.check()?;
    let read = [&arguments.model, &arguments.presses].map(PathBuf::as_path);
    let baseline = arguments.baseline.baseline.as_deref();
    arguments.to.check(&read.into_iter().chain(baseline).collect::<Vec<_>>())?;
    let blob = ModelBlob::read(&arguments.model)?;
    let (fields, limits) = (FieldArguments::default(), Some(Limits::USUAL));
    let model = blob.prepare();
    let model = arguments.baseline.apply(model, &arguments.model, (&fields, limits), common)?;
    recalibration::check(model.model())?;
    let metadata = model.model().metadata();
    let file = DataFile::read(&arguments.presses)?;
    let outputs = table_of(&file, metadata.output_names.iter())?;
    check_stated(&file, &outputs)?;
    let identity = device.identify()?;
    if !identity.has_in_force(model.model().crc()) {
        return Err(Error::Usage(
            "MODEL: the device has another model; `upload` this one, or name that one".into(),
        ));
    }
    if identity.model.is_some_and(|model| model.on_trial) {
        return Err(taxel_rig::Error::Refused(Refusal::OnTrial).into());
    }
    let has_readings = metadata.input_names.iter().any(|name| file.column(name).is_ok());
    let readings = if has_readings {
        let mut readings = table_of(&file, metadata.input_names.iter())?;
        judge(&mut readings, limits);
        readings
    } else {
        record_presses(device, &identity, (model.model(), &outputs), &arguments.scan, common)?
    };
    let found = recalibration::recalibrate(&model, &readings, &outputs)?;
    arguments.to.write(found.blob.bytes())?;
    activate(device, &found.blob, common)?;
    upload::confirm(device)?;
    Ok(conclude(&found, outputs.len(), common))
}

/// Checks that every press of a `file` states all `outputs`; a place may be empty, as where nothing touches.
fn check_stated(file: &DataFile, outputs: &Table) -> Result<()> {
    let width = outputs.names.len();
    let is_missing = |place: &usize| {
        outputs.values[*place].is_nan() && !columns::is_place(&outputs.names[place % width])
    };
    let message = match (0..outputs.values.len()).find(is_missing) {
        Some(place) => format!(
            "line {}: {} is missing; every press needs all outputs",
            file.line_number(place / width),
            outputs.names[place % width]
        ),
        None if outputs.is_empty() => "it has no line; give one for each press".into(),
        None => return Ok(()),
    };
    Err(Error::Unfit { path: file.path.clone(), message })
}

/// Asks for one press after the other, and lets the device scan each: mean readings, NaN where one was faulty.
fn record_presses(
    device: &mut Device,
    identity: &DeviceIdentity,
    (model, outputs): (&Model<'_>, &Table),
    scan: &ScanArguments,
    common: &Common,
) -> Result<Table> {
    let names = reading_names(identity, Some(model))?;
    let configuration = scan.configuration(device)?;
    let patience = patience_for_next(&configuration, identity);
    let mut values = Vec::new();
    for number in 0..outputs.len() {
        ask_for_press(number, outputs)?;
        // Paused first, so that no frame is from before the press.
        let scans = device.while_paused(|device| -> Result<_> {
            configure(device, Wanted::Readings, configuration)?;
            hear_scans(
                device,
                scan.frames.into(),
                patience,
                Wanted::Readings,
                names.len(),
                common,
                |_| Ok(()),
            )
        })?;
        let scanned = scans.iter().flat_map(frames::values).collect();
        let mut scanned = Table { names: names.clone(), values: scanned };
        judge(&mut scanned, Some(Limits::USUAL));
        let mean = |reading: usize| {
            scanned.lines().map(|line| line[reading]).sum::<f64>() / scanned.len() as f64
        };
        values.extend((0..names.len()).map(mean));
    }
    Ok(Table { names, values: values.into() })
}

fn conclude(found: &Recalibrated, given: usize, common: &Common) -> print::Outcome {
    let mut result = Sections::new("Recalibration");
    result.fact("presses", "presses that were used", "", found.presses);
    result.fact("presses_unusable", "presses with a missing reading", "", given - found.presses);
    let unit = "× that of training";
    result.fact("error_before", "error of held-out presses before", unit, found.error_before);
    result.fact("error_after", "error of held-out presses after", unit, found.error_after);
    result.value("model_crc", &format!("{:08x}", found.blob.parse().crc()));
    result.lead = format!(
        "The model is recalibrated: {:08x} is active, also after a restart. `undo` returns to the previous one.",
        found.blob.parse().crc()
    );
    print::sections(common, &result)
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
        _ => Err(Error::failed("stdin ended before all presses were made")),
    }
}

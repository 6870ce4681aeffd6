//! Command `link`: a device on a serial port.

use std::path::PathBuf;

use crate::Result;
use clap::{Args, Subcommand};
use taxel_firmware::timing::NUCLEO_BAUD;
use taxel_learn::ModelBlob;
use taxel_rig::device::check::check;
use taxel_rig::device::{Device, DeviceIdentity, serial, upload};

use super::check_arguments::{CheckArguments, Checked, conclude};
use super::device_arguments::BaudArgument;
use super::progress::Terminal;
use super::{Common, interruption};
use crate::live::device::Protocol;

/// Talk to a device on a serial port: identify, upload, record, configure, recalibrate.
#[derive(Args)]
#[command(after_help = "Example: taxel link /dev/ttyACM0 upload press.bin")]
pub struct Arguments {
    /// Serial port, such as /dev/ttyACM0 or COM3.
    port: String,
    #[command(flatten)]
    line: BaudArgument,
    #[command(subcommand)]
    action: Action,
}

// From the ground up: a module imports only what is declared before it.
mod status;
mod scan;
mod frames;
mod record;
mod record_lines;
mod settings;
mod constants;
mod recalibrate;

#[derive(Subcommand)]
enum Action {
    /// Show the device's identity, active model, use of memory, and counters.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 identify")]
    Identify,
    /// Upload a model and activate it; if it is refused, the previous one stays active.
    ///
    /// The model is on trial until the device is seen to decode and scan with it. Until then a restart returns to the
    /// previous one, whatever caused it.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 upload press.bin")]
    Upload(UploadArguments),
    /// Confirm the model that `upload --trial` left on trial: it stays active over restarts.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 confirm")]
    Confirm,
    /// Save readings or estimates of the device as CSV, or both as a recording (.mcap).
    ///
    /// A recording is written while frames come, and survives a kill (docs/live.md). With --protocol, another sensor is
    /// recorded, and MODEL decodes on this computer.
    #[command(
        after_help = "Example: taxel link /dev/ttyACM0 record press.bin -n 1000 -o estimates.csv"
    )]
    Record(record::RecordArguments),
    /// Capture the untouched sensor, keep its baseline over restarts, and save the mean readings as CSV.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 baseline -o rest.csv")]
    Baseline(record::BaselineArguments),
    /// Change the configuration, and keep it over restarts.
    #[command(
        after_help = "Example: taxel link /dev/ttyACM0 configure --period-us 20000 --send both"
    )]
    Configure(settings::ConfigureArguments),
    /// Set the constants of the device's circuit, and keep them over restarts.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 constants circuit.toml")]
    Constants(constants::Arguments),
    /// Recalibrate the device's model by reference presses after the sensor has changed, and upload it.
    ///
    /// Each line of PRESSES has the true outputs of a press. If it also has columns of the readings, these are used;
    /// otherwise the device scans, and you are asked for one press after another. -o saves the recalibrated model, which
    /// `record` and the next recalibration need. docs/drift.md has more.
    #[command(
        after_help = "Example: taxel link /dev/ttyACM0 recalibrate press.bin presses.csv -o recalibrated.bin"
    )]
    Recalibrate(recalibrate::Arguments),
    /// Return to the model that was active before the last recalibration or upload, or before the trial.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 undo")]
    Undo,
    /// Show configuration, constants and baseline, and which of them are kept over restarts.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 settings")]
    Settings(settings::SettingsArguments),
    /// Decode a scene's frames on the device, and compare with the host bit for bit.
    ///
    /// The model of the check replaces the active one.
    #[command(after_help = "Example: taxel link /dev/ttyACM0 check press --model press.bin")]
    Check(CheckArguments),
}

impl Arguments {
    /// Name of the action, as it is typed.
    pub fn action_name(&self) -> &'static str {
        match self.action {
            Action::Identify => "identify",
            Action::Upload(_) => "upload",
            Action::Confirm => "confirm",
            Action::Record(_) => "record",
            Action::Baseline(_) => "baseline",
            Action::Configure(_) => "configure",
            Action::Constants(_) => "constants",
            Action::Recalibrate(_) => "recalibrate",
            Action::Undo => "undo",
            Action::Settings(_) => "settings",
            Action::Check(_) => "check",
        }
    }
}

#[derive(Args)]
struct UploadArguments {
    /// Weight blob.
    model: PathBuf,
    /// Leave the model on trial, until `confirm`. Without it, the device returns to the previous model after so many
    /// minutes, or at the next restart.
    #[arg(
        long,
        value_name = "MINUTES",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "10",
        value_parser = clap::value_parser!(u32).range(1..=30)
    )]
    trial: Option<u32>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<crate::commands::print::Outcome> {
    let open = || -> Result<_> {
        let mut device = Device::new(serial::open(
            &arguments.port,
            arguments.line.baud.unwrap_or(NUCLEO_BAUD),
        )?)?;
        device.stop = Some(interruption::flag());
        Ok(device)
    };
    match &arguments.action {
        Action::Identify => {
            let mut device = open()?;
            status::show(&mut device, common)
        }
        Action::Upload(action) => {
            let model = ModelBlob::read(&action.model)?;
            let mut device = open()?;
            let before = device.identify()?;
            let after = activate(&mut device, &model, common)?;
            note_another_sensor(&before, &after, common);
            match action.trial {
                Some(minutes) => upload::prolong_trial(&mut device, minutes)?,
                None => drop(upload::confirm(&mut device)?),
            }
            status::show(&mut device, common)
        }
        Action::Confirm => {
            let mut device = open()?;
            upload::confirm(&mut device)?;
            status::show(&mut device, common)
        }
        Action::Record(action) => {
            let line = action.sensor.line(arguments.port.clone(), &arguments.line)?;
            action.check(line.protocol)?;
            match line.protocol {
                Protocol::Taxel => record::record(&mut open()?, action, common),
                _ => record_lines::record(line, action, common),
            }
        }
        Action::Baseline(action) => record::baseline(&mut open()?, action, common),
        Action::Configure(action) => settings::configure(&mut open()?, action, common),
        Action::Constants(action) => constants::execute(&mut open()?, action, common),
        Action::Recalibrate(action) => recalibrate::execute(&mut open()?, action, common),
        Action::Undo => {
            let mut device = open()?;
            upload::undo(&mut device)?;
            status::show(&mut device, common)
        }
        Action::Settings(action) => settings::settings(&mut open()?, action, common),
        Action::Check(action) => {
            let Checked { frames, model, .. } = action.load(common)?;
            let mut device = open()?;
            let plan = action.plan(1);
            let findings = check(&mut device, &frames, &model, &plan, &Terminal::new(common))?;
            Ok(conclude(&findings, common))
        }
    }
}

/// Uploads `model` while the device goes on, puts it on trial, and waits until the device has decoded frames with it.
fn activate(device: &mut Device, model: &ModelBlob, common: &Common) -> Result<DeviceIdentity> {
    let identity = upload::start_trial(device, model.bytes(), &Terminal::new(common))?;
    upload::see_frames(device)?;
    Ok(identity)
}

/// Notes on stderr whatever tells that the new model may be one of another sensor.
fn note_another_sensor(before: &DeviceIdentity, after: &DeviceIdentity, common: &Common) {
    let (Some(old), Some(new)) = (&before.model, &after.model) else { return };
    let mut differences = Vec::new();
    if old.inputs_crc_32 != new.inputs_crc_32 {
        differences.push("its readings had other names or units");
    }
    if old.outputs_crc_32 != new.outputs_crc_32 {
        differences.push("its outputs had other names or units");
    }
    if old.scene_digest != new.scene_digest {
        differences.push("it was trained on another scene or data set");
    }
    if !differences.is_empty() {
        common.remark(format_args!(
            "note: the previous model was {:?}, this one is {:?}: {}",
            before.model_name,
            after.model_name,
            differences.join("; ")
        ));
    }
}

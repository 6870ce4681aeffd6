//! Command `link`: a device on a serial port.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::progress::Terminal;
use clap::{Args, Subcommand, value_parser};
use firmware::link::message::{
    Configuration, EstimateReport, Report, Request, Setting, Statistics,
};
use firmware::timing::ScanPlan;
use host_sim::{Error, Result};
use model_core::Wires;
use serde::Serialize;
use taxel_data::progress::Progress;
use taxel_data::{csv_file, output};
use taxel_learn::ModelBlob;
use taxel_rig::device::check::check;
use taxel_rig::device::{Device, DeviceIdentity, Wire, serial, upload};

use super::check_arguments::{CheckArguments, Checked, conclude, memory_lines};
use super::{Common, print};

/// Talk to a device on a serial port: identify, upload, record, calibrate.
#[derive(Args)]
#[command(after_help = "Example: host-sim link /dev/ttyACM0 upload press.bin")]
pub struct Arguments {
    /// Serial port, such as /dev/ttyACM0 or COM3.
    port: String,
    /// Speed of the line in bits a second.
    #[arg(long, value_name = "BAUD", default_value_t = 921_600, value_parser = value_parser!(u32).range(1..))]
    baud: u32,
    #[command(subcommand)]
    action: Action,
}

// From the ground up: a module imports only what is declared before it.
mod settings;
mod calibrate;

#[derive(Subcommand)]
enum Action {
    /// Show the device's identity, active model, use of memory, and counters.
    #[command(after_help = "Example: host-sim link /dev/ttyACM0 identify")]
    Identify,
    /// Upload a model and activate it; if refused, the previous one stays.
    #[command(after_help = "Example: host-sim link /dev/ttyACM0 upload press.bin")]
    Upload(UploadArguments),
    /// Let the device scan, and save readings or estimates as CSV.
    #[command(
        after_help = "Example: host-sim link /dev/ttyACM0 record press.bin -n 1000 -o estimates.csv"
    )]
    Record(RecordArguments),
    /// Capture the untouched sensor, and save the mean readings as CSV.
    #[command(after_help = "Example: host-sim link /dev/ttyACM0 baseline -o rest.csv")]
    Baseline(BaselineArguments),
    /// Change the configuration, and keep it over restarts.
    #[command(
        after_help = "Example: host-sim link /dev/ttyACM0 configure --period-us 20000 --send both"
    )]
    Configure(settings::ConfigureArguments),
    /// Find the constants of the device's circuit with known resistors.
    ///
    /// Asks for one arrangement of resistors after the other. docs/readout.md says which ones tell the constants.
    #[command(after_help = "Example: host-sim link /dev/ttyACM0 calibrate known.csv --store")]
    Calibrate(calibrate::Arguments),
    /// Show configuration, constants and baseline, and what of them is kept over restarts.
    #[command(after_help = "Example: host-sim link /dev/ttyACM0 settings")]
    Settings(settings::SettingsArguments),
    /// Let the device decode a scene's frames, and compare with the host bit for bit.
    ///
    /// The model that is checked with replaces the active one.
    #[command(after_help = "Example: host-sim link /dev/ttyACM0 check press --model press.bin")]
    Check(CheckArguments),
}

#[derive(Args)]
struct UploadArguments {
    /// Weight blob.
    model: PathBuf,
}

#[derive(Args)]
struct RecordArguments {
    /// Weight blob that is active on the device: its estimates are saved. Without it, readings are.
    model: Option<PathBuf>,
    #[command(flatten)]
    scan: ScanArguments,
    /// Relative change within which a row counts as untouched and is not decoded, once the device has a
    /// `baseline`; 0 decodes all rows (docs/gating.md).
    #[arg(long, value_name = "SHARE", default_value_t = Configuration::DEFAULT.rest_tolerance, value_parser = tolerance, allow_negative_numbers = true)]
    rest_tolerance: f32,
    /// CSV file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Args)]
struct BaselineArguments {
    #[command(flatten)]
    scan: ScanArguments,
    /// Keep the baseline over restarts; otherwise it is active until the next one.
    #[arg(long)]
    store: bool,
    /// CSV file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Args)]
struct ScanArguments {
    /// Frames to scan.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 100, value_parser = value_parser!(u16).range(1..), allow_negative_numbers = true)]
    frames: u16,
    /// Time from one scan to the next.
    #[arg(long, value_name = "US", default_value_t = Configuration::DEFAULT.frame_period_us, value_parser = value_parser!(u32).range(100..=1_000_000_000), allow_negative_numbers = true)]
    period_us: u32,
    /// Wait after a row is driven.
    #[arg(long, value_name = "US", default_value_t = Configuration::DEFAULT.scan.settling_us, value_parser = value_parser!(u32).range(..=10_000), allow_negative_numbers = true)]
    settling_us: u32,
    /// Samples averaged for a reading.
    #[arg(long, value_name = "N", default_value_t = Configuration::DEFAULT.scan.oversampling, value_parser = value_parser!(u16).range(1..=256), allow_negative_numbers = true)]
    oversampling: u16,
}

#[derive(Serialize)]
struct Status {
    device: DeviceIdentity,
    statistics: Statistics,
}

#[derive(Serialize)]
struct Saved {
    frames: usize,
    /// Frame numbers missing between the first frame and the last: lost on the line.
    frames_lost: u32,
    /// Readings or outputs that are empty.
    values_missing: usize,
    /// Rows that were untouched, and so were not decoded.
    rows_at_rest: usize,
    file: PathBuf,
}

/// Tolerance within the range that a device accepts.
fn tolerance(text: &str) -> std::result::Result<f32, String> {
    let share = text.parse().ok().filter(|share| (0.0..1.0).contains(share));
    share.ok_or_else(|| "give a share from 0 and below 1, such as 0.0175 for 3.5 × 0.5 %".into())
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let open = || Device::new(serial::open(&arguments.port, arguments.baud)?);
    match &arguments.action {
        Action::Identify => {
            let mut device = open()?;
            status(&Status { device: device.identify()?, statistics: device.statistics()? }, common)
        }
        Action::Upload(action) => {
            let model = ModelBlob::read(&action.model)?;
            let mut device = open()?;
            let progress = Terminal::new();
            device.while_paused(|device| upload::replace(device, model.bytes(), &progress))?;
            status(&Status { device: device.identify()?, statistics: device.statistics()? }, common)
        }
        Action::Record(action) => record(&mut open()?, action, common),
        Action::Baseline(action) => baseline(&mut open()?, action, common),
        Action::Configure(action) => settings::configure(&mut open()?, action, common),
        Action::Calibrate(action) => calibrate::execute(&mut open()?, action, common),
        Action::Settings(action) => settings::settings(&mut open()?, action, common),
        Action::Check(action) => {
            let Checked { frames, model, .. } = action.load(common)?;
            let mut device = open()?;
            let plan = action.plan(1, common);
            let progress = Terminal::new();
            let findings = check(&mut device, &frames, &model, &plan, &progress)?;
            conclude(&findings, &action.limits, common)
        }
    }
}

fn status(status: &Status, common: &Common) -> Result<()> {
    if common.json {
        return print::json(status);
    }
    let (d, s) = (&status.device, &status.statistics);
    let mut page = print::Page::default();
    page.line(format_args!("{:<17} {}, firmware {}", "device", d.board, d.firmware));
    page.line(format_args!(
        "{:<17} {} rows, {} columns, {} outputs a row; {} exponential",
        "room for", d.rows, d.columns, d.outputs, d.kernel
    ));
    if let Some(m) = &d.model {
        page.line(format_args!(
            "{:<17} CRC-32 {:08x}, slot {}, generation {}, weights in {}",
            "model",
            m.crc_32,
            m.slot,
            m.generation,
            if m.in_ram { "RAM" } else { "flash" }
        ));
        page.line(format_args!(
            "{:<17} {} × {} readings to {} × {} outputs",
            "shape", m.rows, m.inputs, m.rows, m.outputs
        ));
    } else {
        page.line(format_args!("{:<17} none: upload one", "model"));
    }
    page.line(format_args!(
        "{:<17} {} scanned, {} decoded (except {} untouched rows), {} missed, {} samples failed",
        "frames",
        s.frames_scanned,
        s.frames_decoded,
        s.rows_at_rest,
        s.frames_missed,
        s.failed_samples
    ));
    page.line(format_args!(
        "{:<17} scan {} µs, decoding {} µs",
        "longest", s.longest_scan_us, s.longest_decode_us
    ));
    if s.longest_decode_cycles > 0 {
        page.line(format_args!(
            "{:<17} decoding {} to {} of the processor",
            "cycles", s.shortest_decode_cycles, s.longest_decode_cycles
        ));
    }
    page.line(format_args!(
        "{:<17} {} requests, {} bad packets, {} lost reports, {} bad loops",
        "link", s.requests, s.bad_packets, s.lost_reports, s.bad_loops
    ));
    memory_lines(&mut page, &d.memory);
    page.print()
}

/// Content that a device is to send of each scan.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Nothing,
    Readings,
    Estimates,
}

/// Activates a configuration for scanning.
fn configure<W: Wire>(
    device: &mut Device<W>,
    scan: &ScanArguments,
    wanted: Wanted,
    rest_tolerance: f32,
) -> taxel_rig::Result<()> {
    let mut configuration = Configuration {
        frame_period_us: scan.period_us,
        send_readings: wanted == Wanted::Readings,
        send_estimates: wanted == Wanted::Estimates,
        rest_tolerance,
        ..Configuration::DEFAULT
    };
    configuration.scan.settling_us = scan.settling_us;
    configuration.scan.oversampling = scan.oversampling;
    device.configure(configuration)
}

/// Longest time of a sample, with any converter that the readout is written for.
const SLOWEST_SAMPLE_NS: u32 = 100_000;

/// Time within which so many frames must have come.
fn patience(scan: &ScanArguments, identity: &DeviceIdentity) -> Duration {
    let wires = identity.wires();
    let plan = ScanPlan {
        rows: wires.rows as u16,
        columns: wires.columns as u16,
        idle_samples: true,
        settling_us: scan.settling_us,
        oversampling: scan.oversampling,
        sample_ns: SLOWEST_SAMPLE_NS,
    };
    let period = Duration::from_micros(scan.period_us.max(plan.scan_us()).into());
    Duration::from_secs(2) + 4 * u32::from(scan.frames) * period
}

fn record<W: Wire>(
    device: &mut Device<W>,
    action: &RecordArguments,
    common: &Common,
) -> Result<()> {
    let model = action.model.as_ref().map(|path| ModelBlob::read(path)).transpose()?;
    let inputs: Vec<&Path> = action.model.iter().map(PathBuf::as_path).collect();
    output::check_writable(&action.output, &inputs)?;
    let identity = device.identify()?;
    let (wanted, names) = match &model {
        Some(model) => (Wanted::Estimates, output_names(model, &identity)?),
        None => (Wanted::Readings, reading_names(&identity)),
    };
    let patience = patience(&action.scan, &identity);
    let (frames, rows_at_rest) = device.while_paused(|device| -> Result<_> {
        configure(device, &action.scan, wanted, action.rest_tolerance)?;
        hear_frames(device, action.scan.frames.into(), patience, wanted)
    })?;
    let missing = missing(frames.iter().flat_map(|(_, line)| line), wanted)?;
    let lines = frames.iter().map(|(_, line)| line.iter().copied());
    csv_file::write(&action.output, names.iter().map(String::as_str), lines)?;
    let span = frames.last().zip(frames.first()).map_or(0, |(last, first)| last.0 - first.0 + 1);
    let frames_lost = span.saturating_sub(frames.len() as u32);
    let file = action.output.clone();
    let (frames, values_missing) = (frames.len(), missing);
    saved(&Saved { frames, frames_lost, values_missing, rows_at_rest, file }, common)
}

/// Number of missing values; if all are missing, that is a failure.
fn missing<'v>(values: impl Iterator<Item = &'v f64> + Clone, wanted: Wanted) -> Result<usize> {
    let missing = values.clone().filter(|value| value.is_nan()).count();
    if missing < values.count() {
        return Ok(missing);
    }
    let what = if wanted == Wanted::Estimates { "estimate" } else { "reading" };
    Err(Error::Failed(format!(
        "the device sent not a single {what}; `identify` shows failed samples: check the wiring of \
         converters and rows (docs/board.md)"
    )))
}

/// Names of the model's outputs, if it is the active one.
fn output_names(model: &ModelBlob, identity: &DeviceIdentity) -> Result<Vec<String>> {
    let model = model.parse();
    if !identity.has_in_force(model.crc()) {
        return Err(Error::Usage(format!(
            "MODEL {:08x}: {} is active on the device; `upload` this one, or name that one",
            model.crc(),
            identity.model.map_or("none".into(), |found| format!("{:08x}", found.crc_32))
        )));
    }
    Ok(model.metadata().output_names.iter().map(String::from).collect())
}

fn reading_names(identity: &DeviceIdentity) -> Vec<String> {
    let Wires { rows, columns } = identity.wires();
    (1..=rows).flat_map(|m| (1..=columns).map(move |k| format!("r{m}c{k}_ohm"))).collect()
}

/// Number of a frame, and its readings or outputs.
type NumberedFrame = (u32, Vec<f64>);

/// Receives the frames that the device sends, with their numbers, and counts the untouched rows in all of
/// them.
fn hear_frames<W: Wire>(
    device: &mut Device<W>,
    count: usize,
    patience: Duration,
    wanted: Wanted,
) -> Result<(Vec<NumberedFrame>, usize)> {
    let progress = Terminal::new();
    progress.stage("recording", count);
    let mut frames: Vec<NumberedFrame> = Vec::new();
    let mut rows_at_rest = 0;
    let enough = device.hear(Instant::now() + patience, |_, report| {
        let (frame, values, status) = match report {
            Report::Readings { frame, readings_ohm, .. } if wanted == Wanted::Readings => {
                (*frame, *readings_ohm, &[][..])
            }
            Report::Estimate(estimate) if wanted == Wanted::Estimates => {
                (estimate.frame, estimate.outputs, estimate.row_status)
            }
            _ => return None,
        };
        if frames.last().is_some_and(|(last, _)| *last >= frame) {
            return Some(Err(Error::Failed("the device has restarted meanwhile".into())));
        }
        frames.push((frame, values.iter().map(f64::from).collect()));
        let at_rest = status.iter().filter(|status| **status == EstimateReport::ROW_AT_REST);
        rows_at_rest += at_rest.count();
        progress.step();
        (frames.len() == count).then_some(Ok(()))
    })?;
    match enough {
        Some(outcome) => outcome.map(|()| (frames, rows_at_rest)),
        None => Err(Error::Failed(format!("only {} of {count} frames came in time", frames.len()))),
    }
}

fn baseline<W: Wire>(
    device: &mut Device<W>,
    action: &BaselineArguments,
    common: &Common,
) -> Result<()> {
    output::check_writable(&action.output, &[])?;
    let identity = device.identify()?;
    let frames = action.scan.frames;
    let request = Request::CaptureBaseline { frames };
    let patience = patience(&action.scan, &identity);
    let answer = device.while_paused(|device| {
        configure(device, &action.scan, Wanted::Nothing, 0.0)?;
        device.ask(&request, patience, |report| match report {
            Report::Baseline { readings_ohm } => {
                Some(readings_ohm.iter().map(f64::from).collect::<Vec<_>>())
            }
            _ => None,
        })
    })?;
    let readings = answer.map_err(taxel_rig::Error::Refused)?;
    let names = reading_names(&identity);
    let values_missing = missing(readings.iter(), Wanted::Readings)?;
    if action.store {
        device.keep(Setting::Baseline)?;
    }
    let lines = std::iter::once(readings.iter().copied());
    csv_file::write(&action.output, names.iter().map(String::as_str), lines)?;
    let file = action.output.clone();
    let (frames, frames_lost, rows_at_rest) = (frames.into(), 0, 0);
    saved(&Saved { frames, frames_lost, values_missing, rows_at_rest, file }, common)
}

fn saved(saved: &Saved, common: &Common) -> Result<()> {
    if common.json {
        return print::json(saved);
    }
    let mut page = print::Page::default();
    page.line(format_args!(
        "{} frames in {}, {} lost on the line, {} values missing",
        saved.frames,
        saved.file.display(),
        saved.frames_lost,
        saved.values_missing
    ));
    if saved.rows_at_rest > 0 {
        page.line(format_args!("{} rows were untouched, and not decoded", saved.rows_at_rest));
    }
    page.print()
}

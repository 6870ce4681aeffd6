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
use taxel_rig::device::{ActiveConfiguration, Device, DeviceIdentity, LEASE, Wire, serial, upload};

use super::check_arguments::{CheckArguments, Checked, conclude, memory_lines};
use super::{Common, interruption, print};

/// Talk to a device on a serial port: identify, upload, record, calibrate.
#[derive(Args)]
#[command(after_help = "Example: host-sim link /dev/ttyACM0 upload press.bin")]
pub struct Arguments {
    /// Serial port, such as /dev/ttyACM0 or COM3.
    port: String,
    /// Speed of the line in bits a second.
    #[arg(long, value_name = "BAUD", default_value_t = 921_600, value_parser = value_parser!(u32).range(1..))]
    baud: u32,
    /// Time without requests after which the device returns to its own configuration, if this program is killed.
    #[arg(long, value_name = "MS", default_value_t = LEASE.as_millis() as u32, value_parser = value_parser!(u32).range(100..=600_000))]
    lease_ms: u32,
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
    #[serde(flatten)]
    active: ActiveConfiguration,
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
    let open = || -> Result<_> {
        let mut device = Device::new(serial::open(&arguments.port, arguments.baud)?)?;
        device.lease = Duration::from_millis(arguments.lease_ms.into());
        device.stop = Some(interruption::flag()?);
        Ok(device)
    };
    match &arguments.action {
        Action::Identify => {
            let mut device = open()?;
            status(&mut device, common)
        }
        Action::Upload(action) => {
            let model = ModelBlob::read(&action.model)?;
            let mut device = open()?;
            let before = device.identify()?;
            let progress = Terminal::new();
            let after =
                device.while_paused(|device| upload::replace(device, model.bytes(), &progress))?;
            note_another_sensor(&before, &after);
            status(&mut device, common)
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

/// Notes on stderr whatever tells that the new model may be one of another sensor.
fn note_another_sensor(before: &DeviceIdentity, after: &DeviceIdentity) {
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
        eprintln!(
            "note: the previous model was {:?}, this one is {:?}: {}",
            before.model_name,
            after.model_name,
            differences.join("; ")
        );
    }
}

/// What the device is doing, by its active configuration.
fn scanning(active: &ActiveConfiguration) -> String {
    let ActiveConfiguration { configuration, lease_left_ms } = active;
    let left_s = f64::from(*lease_left_ms) / 1e3;
    match (configuration.frame_period_us, lease_left_ms) {
        (0, 0) => "not scanning: its own configuration has no frame period".into(),
        (0, _) => {
            format!("not scanning: paused by a host, for {left_s:.1} s more without requests")
        }
        (us, 0) => format!("a frame every {} ms", f64::from(us) / 1e3),
        (us, _) => format!(
            "a frame every {} ms, set by a host, for {left_s:.1} s more without requests",
            f64::from(us) / 1e3
        ),
    }
}

fn status<W: Wire>(device: &mut Device<W>, common: &Common) -> Result<()> {
    let status = Status {
        device: device.identify()?,
        active: device.configuration()?,
        statistics: device.statistics()?,
    };
    if common.json {
        return print::json(&status);
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
            "{:<17} {:?}, CRC-32 {:08x}, slot {}, generation {}, weights in {}",
            "model",
            d.model_name,
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
    page.line(format_args!("{:<17} {}", "scanning", scanning(&status.active)));
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
    if s.frames_clamped > 0 {
        page.line(format_args!(
            "{:<17} {} frames had readings far beyond the model's training range",
            "clamped", s.frames_clamped
        ));
    }
    page.line(format_args!(
        "{:<17} {} requests, {} bad packets, {} lost reports, {} bad loops",
        "link", s.requests, s.bad_packets, s.lost_reports, s.bad_loops
    ));
    page.line(format_args!("{:<17} {} since the start", "slots erased", s.slot_erases));
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
        hear_frames(device, action.scan.frames.into(), patience, wanted, names.len())
    })?;
    let missing = missing(frames.iter().flat_map(|frame| &frame.values), wanted)?;
    let lines = frames.iter().map(|frame| frame.values.iter().copied());
    csv_file::write(&action.output, names.iter().map(String::as_str), lines)?;
    let ends = frames.last().zip(frames.first());
    let span = ends.map_or(0, |(last, first)| last.number.wrapping_sub(first.number) + 1);
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

/// Frame that the device scanned.
struct Frame {
    /// Number, which wraps around to 0.
    number: u32,
    /// Time at which its scan began.
    start_us: u64,
    /// Readings or outputs.
    values: Vec<f64>,
}

impl Frame {
    /// Whether the device has started anew between this frame and `next`.
    fn is_from_before(&self, next: &Self) -> bool {
        let frames = next.number.wrapping_sub(self.number).cast_signed();
        frames <= 0 || next.start_us <= self.start_us
    }
}

/// Receives the frames that the device sends, of `width` values each, and counts the untouched rows in all of them.
fn hear_frames<W: Wire>(
    device: &mut Device<W>,
    count: usize,
    patience: Duration,
    wanted: Wanted,
    width: usize,
) -> Result<(Vec<Frame>, usize)> {
    let progress = Terminal::new();
    progress.stage("recording", count);
    let mut frames: Vec<Frame> = Vec::new();
    let mut rows_at_rest = 0;
    let enough = device.hear(Instant::now() + patience, |_, report| {
        let (number, start_us, values, status) = match report {
            Report::Readings { frame, start_us, readings_ohm } if wanted == Wanted::Readings => {
                (*frame, *start_us, *readings_ohm, &[][..])
            }
            Report::Estimate(estimate) if wanted == Wanted::Estimates => {
                (estimate.frame, estimate.start_us, estimate.outputs, estimate.row_status)
            }
            _ => return None,
        };
        let values: Vec<f64> = values.iter().map(f64::from).collect();
        if let Err(error) = check_length(number, &values, width) {
            return Some(Err(error));
        }
        let frame = Frame { number, start_us, values };
        if frames.last().is_some_and(|last| last.is_from_before(&frame)) {
            return Some(Err(Error::Failed("the device has restarted meanwhile".into())));
        }
        frames.push(frame);
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

/// Checks the number of values in a frame.
fn check_length(frame: u32, values: &[f64], expected: usize) -> Result<()> {
    let found = values.len();
    if found == expected {
        return Ok(());
    }
    Err(taxel_rig::Error::ReportLength { frame, expected, found }.into())
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
    check_length(0, &readings, names.len())?;
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

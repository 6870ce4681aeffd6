//! Command `view`: a sensor in the browser, live.

use std::io::{ErrorKind, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::{self, Stdio};
use std::sync::mpsc::Receiver;

use clap::Args;
use serde::Serialize;
use taxel_data::Clock;
use taxel_learn::ModelBlob;
use taxel_rig::device::serial;
use taxel_view::{Command, View};

use super::arguments::refuse;
use super::data_file::{DataFileArguments, TimeArgument, for_data};
use super::device_arguments::{BaudArgument, ScanPeriodArgument, SensorArguments};
use super::scene_argument::{DEFAULT_SCENE, FrameRateArgument, ModelArgument};
use super::{Common, interruption, print, recordings};
use crate::experiment::{Experiment, names_a_scene};
use crate::live::device::{DeviceFeed, Line};
use crate::live::feed::Feed;
use crate::live::replay::{ReplayFeed, USUAL_RATE};
use crate::live::simulation::{self, SimulationFeed};
use crate::live::watch::{Watched, watch};
use crate::report::Sections;
use crate::{Error, Result};

/// Frames a second that can be shown of a simulation or a data file.
const SHOWN_RATES: RangeInclusive<f64> = 0.01..=10_000.0;
/// Frames a second of a simulation.
const SIMULATED_RATE: f64 = 100.0;

/// Watch a sensor in the browser, live: a device, a simulation, or a recording.
///
/// The page is served to this computer only, at 127.0.0.1, and loads nothing from elsewhere. It shows the sheet and the
/// readings on fixed scales, the contact over time, faults, and the age of the picture. It can zero, pause, record and
/// take screenshots. docs/live.md has more.
#[derive(Args)]
#[command(mut_arg("model", |it| it.help("Weight blob: it names the outputs of a device, and decodes frames that are not decoded \
                                         yet; without one, a model is trained on a scene")))]
#[command(after_help = "Examples:
  taxel view                          # the device that is plugged in, or else a simulation
  taxel view /dev/ttyACM0 --model press.bin
  taxel view recording-1.mcap
  taxel view mat.csv --model mat.bin
  taxel view /dev/ttyUSB0 --protocol csv --model mat.bin")]
pub struct Arguments {
    /// A serial port, a scene (press, contact, moving, or a scene file), a recording (.mcap), or a data file of readings
    /// [default: the only USB port, or else the scene press].
    source: Option<String>,
    #[command(flatten)]
    of: ModelArgument,
    #[command(flatten)]
    port: PortArguments,
    #[command(flatten)]
    rate: FrameRateArgument,
    /// Port of the page [default: a free one].
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    http_port: u16,
    /// Token in the page's address, of 16 letters and digits or more: with --http-port, an open page reconnects to the
    /// next view [default: a new one each time].
    #[arg(long, value_name = "TOKEN")]
    token: Option<String>,
    /// Open no browser: print the page's address alone.
    #[arg(long)]
    no_browser: bool,
    #[command(flatten)]
    clock: TimeArgument,
    #[command(flatten)]
    file: DataFileArguments,
}

/// How a sensor on a serial port is read.
#[derive(Args, Serialize)]
struct PortArguments {
    #[command(flatten)]
    #[serde(flatten)]
    sensor: SensorArguments,
    #[command(flatten)]
    #[serde(flatten)]
    line: BaudArgument,
    #[command(flatten)]
    #[serde(flatten)]
    period: ScanPeriodArgument,
}

/// What is watched.
enum Source {
    Port(String),
    Scene(String),
    Recording(PathBuf),
    Data(PathBuf),
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let blob = arguments.of.model.as_ref().map(|path| ModelBlob::read(path)).transpose()?;
    let source = source(arguments, common)?;
    check_options(arguments, &source)?;
    let view = View::start(arguments.http_port, arguments.token.as_deref());
    let (view, commands) = view.map_err(|cause| {
        let (port, token) = (arguments.http_port, arguments.token.as_deref().unwrap_or_default());
        Error::Usage(match cause.kind() {
            ErrorKind::InvalidInput => format!("--token {token}: {cause}"),
            _ => format!("--http-port {port}: {cause}; give another, or leave it out"),
        })
    })?;
    let view = (&view, &commands);
    match source {
        Source::Port(port) => {
            let PortArguments { sensor, line, period } = &arguments.port;
            let line = Line { period_us: period.period_us, ..sensor.line(port, line)? };
            let mut feed = DeviceFeed::open(line, blob.as_ref())?;
            show(&mut feed, &Watched { blob: blob.as_ref(), scene: None }, view, arguments, common)
        }
        Source::Scene(name) => {
            let mut scene = Experiment::load(&name)?;
            scene.world.seed = common.seed.unwrap_or(scene.world.seed);
            let blob = if let Some(blob) = blob {
                blob
            } else {
                common.remark("training a small model; give a better one with --model …");
                simulation::small_model(&scene)?
            };
            let rate = arguments.rate.frame_rate.unwrap_or(SIMULATED_RATE);
            let mut feed = SimulationFeed::new(&scene, &blob, rate)?;
            show(
                &mut feed,
                &Watched { blob: Some(&blob), scene: Some(scene.text.clone()) },
                view,
                arguments,
                common,
            )
        }
        Source::Recording(path) => {
            let reader = recordings::open(&path, common)?;
            let mut feed = ReplayFeed::of_recording(reader, &path, blob.as_ref())?;
            show(&mut feed, &Watched { blob: blob.as_ref(), scene: None }, view, arguments, common)
        }
        Source::Data(path) => {
            let file = arguments.file.read(&path, common)?;
            let clock = Clock::of(&file, arguments.clock.time.as_deref())?;
            let has_no_unit = clock.column.as_ref().filter(|_| clock.unit.is_empty());
            let why = has_no_unit.map(|name| {
                format!("the unit of {name} is not known (a name such as {name}_ms gives it)")
            });
            if let Some(why) = why.or_else(|| clock.why_counted(&file)) {
                common.remark(format_args!(
                    "note: {why}; {USUAL_RATE} frames a second are shown (--frame-rate)"
                ));
            }
            let mut feed =
                ReplayFeed::of_data(file, blob.as_ref(), &clock, arguments.rate.frame_rate)?;
            show(&mut feed, &Watched { blob: blob.as_ref(), scene: None }, view, arguments, common)
        }
    }
}

/// Error for an option that has no effect on such a source.
fn check_options(arguments: &Arguments, source: &Source) -> Result<()> {
    arguments.port.period.check()?;
    if !matches!(source, Source::Port(_)) {
        refuse(
            &arguments.port,
            |_| true,
            |option| format!("{option} is for a sensor on a serial port: leave it out"),
        )?;
    }
    let has_rate = matches!(source, Source::Scene(_) | Source::Data(_));
    if arguments.rate.frame_rate.is_some() && !has_rate {
        let message = "--frame-rate is for a simulation or a data file: leave it out";
        return Err(Error::Usage(message.into()));
    }
    if let Some(rate) = arguments.rate.frame_rate.filter(|rate| !SHOWN_RATES.contains(rate)) {
        let message = format!("--frame-rate {rate}: give frames a second from 0.01 to 10000");
        return Err(Error::Usage(message));
    }
    if matches!(source, Source::Data(_)) {
        return Ok(());
    }
    refuse(&arguments.clock, |_| true, for_data)?;
    arguments.file.refuse()
}

/// What the argument names, or what there is without one.
fn source(arguments: &Arguments, common: &Common) -> Result<Source> {
    let Some(text) = &arguments.source else {
        if let Some(port) = serial::only_usb()? {
            return Ok(Source::Port(port));
        }
        common.remark("no device is plugged in: this is a simulation");
        return Ok(Source::Scene(DEFAULT_SCENE.into()));
    };
    let path = Path::new(text);
    if is_port(text) {
        return Ok(Source::Port(text.clone()));
    }
    if recordings::is_recording(path) {
        return Ok(Source::Recording(path.into()));
    }
    if names_a_scene(text) {
        return Ok(Source::Scene(text.clone()));
    }
    if path.is_file() {
        return Ok(Source::Data(path.into()));
    }
    let ports = serial::names();
    let ports =
        if ports.is_empty() { "no port".into() } else { format!("ports {}", ports.join(", ")) };
    Err(Error::Usage(format!(
        "SOURCE {text}: there is no such file, scene or port; there are {ports}, and the scenes paper, press, contact, moving, shear"
    )))
}

/// Whether a text names a serial port.
fn is_port(text: &str) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let is_device = |found: std::fs::Metadata| found.file_type().is_char_device();
        text.starts_with("/dev/") || std::fs::metadata(text).is_ok_and(is_device)
    }
    #[cfg(not(unix))]
    {
        text.to_ascii_uppercase().starts_with("COM")
    }
}

/// Serves the page of what `feed` brings, until the program is told to end.
fn show(
    feed: &mut dyn Feed,
    watched: &Watched<'_>,
    (view, commands): (&View, &Receiver<Command>),
    arguments: &Arguments,
    common: &Common,
) -> Result<print::Outcome> {
    let address = view.address();
    let mut sections = Sections::new(&address);
    sections.value("address", &address);
    print::sections(common, &sections).print()?;
    // Whoever reads the address waits for it.
    let _ = std::io::stdout().flush();
    if !arguments.no_browser && !open_browser(&address) {
        common.remark("no browser was found: open the address yourself");
    }
    common.remark("Ctrl-C ends it");
    watch(feed, view, commands, watched, &interruption::flag())?;
    Ok(print::Outcome::default())
}

/// Opens `address` in the user's browser. Returns whether a program took it.
fn open_browser(address: &str) -> bool {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        "xdg-open"
    };
    let mut command = process::Command::new(program);
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().is_ok()
}

//! The board's image on an emulated board: `proof/board-emulator`.

mod emulator;

use std::num::NonZeroU32;
use std::path::PathBuf;

use crate::emulate::qemu::decoded;
use crate::images::{NUCLEO, NUCLEO_IMAGE, build_image, build_wide};
use crate::process::Outcome;
use crate::toolchain::{Toolchain, elf};
pub use emulator::Emulator;

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// Frames that `check` decodes.
    #[arg(long, value_name = "N", default_value = "30")]
    frames: NonZeroU32,
    /// Seconds for which the scenario `stream` counts estimates.
    #[arg(long, value_name = "S", default_value = "1")]
    seconds: NonZeroU32,
    /// Blob to upload, of the scene `press`, instead of a small one.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Scenarios to run; all if there are none.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
}

impl Options {
    /// No names, and a small model.
    pub fn plain() -> Self {
        Self { frames: NonZeroU32::MIN, seconds: NonZeroU32::MIN, model: None, names: Vec::new() }
    }
}

/// Scenario of an image with room for a larger sensor.
const WIDE: &str = "wide";

/// Texts that the log of a scenario must contain.
const LOGGED: [(&str, &str); 6] = [
    ("session", "slot 0 holds a model that was flashed, not uploaded"),
    ("silent-sensor", "started by: Watchdog"),
    ("no-clock", "no 8 MHz from the ST-LINK"),
    ("clock-stops", "started by: Fault(Clock)"),
    ("fault-restarts", "started by: Fault(Exception)"),
    ("panic-restarts", "started by: Fault(Panic("),
];

/// Builds what is needed, and runs the scenarios that are named, or all.
pub fn run(options: &Options) -> Outcome {
    let emulator = Emulator::prepare(options)?;
    let toolchain = Toolchain::find()?;
    let run = |scenario: &str| {
        options.names.is_empty() || options.names.iter().any(|name| name == scenario)
    };
    if run(WIDE) {
        build_wide(&toolchain)?;
    }
    build_image(&toolchain, NUCLEO)?;
    let image = elf(NUCLEO_IMAGE);
    emulator.run(&image, &options.names)?;
    for (scenario, text) in LOGGED.iter().filter(|(scenario, _)| run(scenario)) {
        let log = decoded(&emulator::log(scenario), &image)?;
        if !log.contains(text) {
            return Err(format!("{scenario} does not log {text:?}, but\n{log}"));
        }
    }
    Ok(())
}

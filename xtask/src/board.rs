//! The board's image on an emulated board: `proof/board-emulator`. Scenarios, and mutants of the image that must
//! fail them.

mod mutants;
mod copy;
mod emulator;

use std::fs;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::time::Instant;

use crate::emulate::qemu::decoded;
use crate::images::{
    NUCLEO, NUCLEO_FIXED16, NUCLEO_SPI, SEAL, build_image, build_other, build_variant,
};
use crate::process::{Outcome, Said};
use crate::toolchain::{Toolchain, elf};
use copy::Copy;
pub use emulator::Emulator;

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// Build images with one fault each instead, these or all of proof/board-emulator/mutants.toml; the scenarios must fail.
    #[arg(long)]
    mutants: bool,
    /// Frames that `check` decodes.
    #[arg(long, value_name = "N", default_value = "30")]
    frames: NonZeroU32,
    /// Seconds for which the scenario `onchip-stream` counts estimates.
    #[arg(long, value_name = "S", default_value = "1")]
    seconds: NonZeroU32,
    /// Blob to upload, of the scene `press`, instead of a small one.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Scenarios or mutants to run; all if there are none.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
}

impl Options {
    /// No names, and a small model.
    pub fn plain() -> Self {
        Self {
            mutants: false,
            frames: NonZeroU32::MIN,
            seconds: NonZeroU32::MIN,
            model: None,
            names: Vec::new(),
        }
    }

    /// A name that no mutant has, if mutants are to run. A list that is wrong is for [`run`] to tell.
    pub fn unknown(&self) -> Option<&String> {
        let mutants = self.mutants.then(|| mutants::load(&[]).ok()).flatten()?;
        self.names.iter().find(|name| !mutants.iter().any(|mutant| mutant.name == **name))
    }
}

/// Scenario of the image that reads the sensor by the board's own converters.
const ONCHIP: &str = "onchip";

/// Scenario of an image with room for a larger sensor.
const WIDE: &str = "wide";

/// Scenario of an image with one feature alone.
const FEW_FEATURES: &str = "few-features";

/// Texts that the log of a scenario must contain.
const LOGGED: [(&str, &str); 7] = [
    ("session", "slot 0 holds a model that was flashed, not uploaded"),
    ("silent-sensor", "started by: Watchdog"),
    ("no-clock", "no 8 MHz from the ST-LINK"),
    ("clock-stops", "started by: Fault(Clock)"),
    ("fault-restarts", "started by: Fault(Exception)"),
    ("panic-restarts", "started by: Fault(Panic("),
    ("brown-out", "brown-out level 3 is set"),
];

/// Builds what is needed, and runs the scenarios or the mutants that are named, or all.
pub fn run(options: &Options) -> Outcome {
    let emulator = Emulator::prepare(options)?;
    let toolchain = Toolchain::find()?;
    if options.mutants {
        return run_mutants(&emulator, &toolchain, &options.names);
    }
    let run = |scenario: &str| {
        options.names.is_empty() || options.names.iter().any(|name| name == scenario)
    };
    if run(FEW_FEATURES) {
        build_variant(&toolchain, &["fixed16"], NUCLEO_FIXED16)?;
    }
    // The scenario has the feature's name.
    if run(SEAL) {
        build_other(&toolchain, SEAL)?;
    }
    build_image(&toolchain, NUCLEO)?;
    if run(WIDE) {
        Copy::make()?.build_wide(&toolchain)?;
    }
    let image = elf(NUCLEO_SPI);
    emulator.run(&image, &options.names)?;
    for (scenario, text) in LOGGED.iter().filter(|(scenario, _)| run(scenario)) {
        let log = decoded(&emulator::log(scenario), &image)?;
        if !log.contains(text) {
            return Err(format!("{scenario} does not log {text:?}, but\n{log}"));
        }
    }
    Ok(())
}

fn run_mutants(emulator: &Emulator, toolchain: &Toolchain, names: &[String]) -> Outcome {
    let copy = Copy::make()?;
    let mut survived = Vec::new();
    for mutant in mutants::load(names)? {
        let start = Instant::now();
        let image = copy.build_mutant(toolchain, &mutant)?;
        let Said { out, err, outcome } = emulator.capture(&image, &mutant.scenario);
        fs::remove_file(&image).map_err(|cause| format!("{}: {cause}", image.display()))?;
        let seconds = start.elapsed().as_secs_f64();
        let red = outcome.is_err() && out.contains(&mutant.shown_by);
        if red {
            let (name, scenario) = (&mutant.name, &mutant.scenario);
            println!("red     {name:20} in {scenario}: {} ({seconds:.0} s)", mutant.shown_by);
        } else {
            print!("{err}{out}");
            println!("GREEN   {:20} {:?} is not shown", mutant.name, mutant.shown_by);
            survived.push(mutant.name);
        }
    }
    if survived.is_empty() {
        Ok(())
    } else {
        Err(format!("the emulated board does not notice {}", survived.join(", ")))
    }
}

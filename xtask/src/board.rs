//! The board's image on an emulated board: `proof/board-emulator`. Scenarios, and mutants of the image that must
//! fail them.

mod options;
mod mutants;
mod copy;
mod emulator;

use std::fs;
use std::time::Instant;

use crate::emulate::qemu::decoded;
use crate::firmware::{NUCLEO, build_image};
use crate::process::{Outcome, Said};
use crate::toolchain::{Toolchain, elf};
use copy::Copy;
use emulator::Emulator;
use mutants::{MUTANTS, Mutant};
pub use options::Options;

/// Name of the image.
const IMAGE: &str = "nucleo-f446re";

/// Scenario of an image with room for a larger sensor.
const WIDE: &str = "wide";

/// Texts that the log of a scenario must contain.
const LOGGED: [(&str, &str); 3] = [
    ("session", "slot 0 holds a model that was flashed, not uploaded"),
    ("silent-sensor", "started by: Watchdog"),
    ("no-clock", "no 8 MHz from the ST-LINK"),
];

/// Builds what is needed, and runs the scenarios or the mutants that are named, or all.
pub fn run(options: &Options<'_>) -> Outcome {
    let emulator = Emulator::prepare(options)?;
    let toolchain = Toolchain::find()?;
    if options.mutants {
        return run_mutants(&emulator, &toolchain, &options.names);
    }
    let run = |scenario: &str| options.names.is_empty() || options.names.contains(&scenario);
    build_image(&toolchain, NUCLEO)?;
    if run(WIDE) {
        Copy::make()?.build_wide(&toolchain)?;
    }
    let image = elf(IMAGE);
    emulator.run(&image, &options.names)?;
    for (scenario, text) in LOGGED.iter().filter(|(scenario, _)| run(scenario)) {
        let log = decoded(&emulator::log(scenario), &image)?;
        if !log.contains(text) {
            return Err(format!("{scenario} does not log {text:?}, but\n{log}"));
        }
    }
    Ok(())
}

fn run_mutants(emulator: &Emulator, toolchain: &Toolchain, names: &[&str]) -> Outcome {
    let chosen = choose(names)?;
    let copy = Copy::make()?;
    let mut survived = Vec::new();
    for mutant in chosen {
        let start = Instant::now();
        let image = copy.build_mutant(toolchain, mutant)?;
        let Said { out, err, outcome } = emulator.capture(&image, mutant.scenario);
        fs::remove_file(&image).map_err(|cause| format!("{}: {cause}", image.display()))?;
        let seconds = start.elapsed().as_secs_f64();
        let red = outcome.is_err() && out.contains(mutant.shown_by);
        if red {
            let (name, scenario) = (mutant.name, mutant.scenario);
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

/// The mutants of these names; all if no name is given.
fn choose(names: &[&str]) -> Outcome<Vec<&'static Mutant>> {
    let find = |name: &&str| {
        MUTANTS.iter().find(|mutant| mutant.name == *name).ok_or_else(|| {
            let all: Vec<_> = MUTANTS.iter().map(|mutant| mutant.name).collect();
            format!("there is no mutant `{name}`, but {}", all.join(", "))
        })
    };
    if names.is_empty() { Ok(MUTANTS.iter().collect()) } else { names.iter().map(find).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mutants_are_chosen_by_name() {
        assert_eq!(choose(&[]).unwrap().len(), MUTANTS.len());
        assert_eq!(choose(&["sck-slow"]).unwrap()[0].name, "sck-slow");
        assert!(choose(&["sck-slo"]).is_err_and(|error| error.contains("sck-slow")));
    }
}

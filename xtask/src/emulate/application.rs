//! The application in the emulator, held to the host by `host-sim emulate`.

use std::fs;
use std::process::Command;

use crate::process::{Outcome, cargo, run, target_dir};
use crate::toolchain::elf;

/// The application's image.
pub const IMAGE: &str = "qemu-app";

/// Flash that it may take without a model, and RAM with the stack at its deepest, in bytes.
const LIMITS: [&str; 2] = ["--flash-limit=49152", "--ram-limit=8192"];

/// All that must hold of it with a network a row; some minutes, most of them for bytes on the serial line.
const CHECKS: [&str; 8] = [
    "-n",
    "10000",
    "--scans",
    "20",
    "--damaged-uploads",
    "1000",
    "--interruptions",
    "--garbage=100000",
];

/// What must hold with one network for the whole array: decoding is what differs, and takes more stack.
const CHECKS_OF_ARRAY: [&str; 4] = ["-n", "1000", "--scans", "20"];

/// The networks' format and number of centres for the whole array: the fastest.
const ARRAY: [&str; 5] = ["--whole-array", "--format", "fixed16", "--centres", "64"];

/// Checks the application, and leaves its log beside the image.
pub fn check() -> Outcome {
    let log = target_dir().join("qemu-app.defmt");
    // That of the run before, if there was one.
    let _ = fs::remove_file(&log);
    run(emulate(&CHECKS).arg("--log").arg(&log))?;
    let model = target_dir().join("qemu-array.bin");
    run(host_sim(&["train", "press"]).args(ARRAY).arg("--output").arg(&model))?;
    run(emulate(&CHECKS_OF_ARRAY).arg("--model").arg(&model))?;
    println!("its log: cargo xtask log {}", log.display());
    Ok(())
}

fn emulate(checks: &[&str]) -> Command {
    let mut command = host_sim(&["emulate", "press"]);
    command.args(checks).args(LIMITS).arg("--image").arg(elf(IMAGE));
    command
}

fn host_sim(arguments: &[&str]) -> Command {
    let mut command = cargo(&["run", "--quiet", "--package", "host-sim", "--"]);
    command.args(arguments);
    command
}

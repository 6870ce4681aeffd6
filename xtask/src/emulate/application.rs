//! The application in the emulator, held to the host by `host-sim emulate`.

use std::fs;

use crate::process::{Outcome, cargo, run, target_dir};
use crate::toolchain::elf;

/// The application's image.
pub const IMAGE: &str = "qemu-app";

/// Flash that it may take without a model, and RAM with the stack at its deepest, in bytes.
const LIMITS: [&str; 2] = ["--flash-limit=49152", "--ram-limit=8192"];

/// All that must hold of it; some minutes, most of them for bytes on the serial line.
const CHECKS: [&str; 10] = [
    "press",
    "-n",
    "10000",
    "--scans",
    "20",
    "--damaged-uploads",
    "1000",
    "--interruptions",
    "--garbage",
    "100000",
];

/// Checks the application, and leaves its log beside the image.
pub fn check() -> Outcome {
    let log = target_dir().join("qemu-app.defmt");
    let mut command = cargo(&["run", "--quiet", "--package", "host-sim", "--", "emulate"]);
    command.args(CHECKS).args(LIMITS).arg("--image").arg(elf(IMAGE)).arg("--log").arg(&log);
    // That of the run before, if there was one.
    let _ = fs::remove_file(&log);
    run(&mut command)?;
    println!("its log: cargo xtask log {}", log.display());
    Ok(())
}

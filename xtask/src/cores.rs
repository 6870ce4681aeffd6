//! Compiling the libraries for cores besides the images' own.

use crate::images::PROFILE;
use crate::process::{Outcome, run as run_command};
use crate::toolchain::{TARGET, Toolchain};

/// Targets, and the packages that are checked for each. `firmware/setup.sh` installs them.
const CORES: [(&str, &[&str]); 6] = [
    ("thumbv6m-none-eabi", &DEVICE),
    ("thumbv7m-none-eabi", &DEVICE),
    (TARGET, &DEVICE),
    ("thumbv8m.main-none-eabihf", &DEVICE),
    ("riscv32imac-unknown-none-elf", &DEVICE),
    ("wasm32-unknown-unknown", &DECODER),
];

/// What runs on a device, with an oldest Rust of its own.
pub const DEVICE: [&str; 4] = ["--package", "taxel-core", "--package", "taxel-firmware"];
/// What a page in a browser needs of it.
const DECODER: [&str; 2] = ["--package", "taxel-core"];

/// Checks taxel-core, and the firmware where there are pins, for every core; prints one line each.
pub fn run() -> Outcome {
    for (target, packages) in CORES {
        let toolchain = Toolchain::new(target)?;
        // Nothing is linked, so that code for it need not be made.
        run_command(toolchain.check().arg("--quiet").args(PROFILE).args(packages))?;
        let names: Vec<&str> = packages.iter().copied().filter(|it| !it.starts_with('-')).collect();
        println!("ok      {target:30} {}", names.join(", "));
    }
    Ok(())
}

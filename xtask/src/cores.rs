//! Building the libraries for cores besides the images' own.

use crate::images::PROFILE;
use crate::process::{Outcome, run as run_command};
use crate::toolchain::{TARGET, Toolchain};

/// Targets, and the packages that are built for each. `firmware/setup.sh` installs them.
const CORES: [(&str, &[&str]); 6] = [
    ("thumbv6m-none-eabi", &DEVICE),
    ("thumbv7m-none-eabi", &DEVICE),
    (TARGET, &DEVICE),
    ("thumbv8m.main-none-eabihf", &DEVICE),
    ("riscv32imac-unknown-none-elf", &DEVICE),
    ("wasm32-unknown-unknown", &DECODER),
];

/// What runs on a device.
const DEVICE: [&str; 4] = ["--package", "model-core", "--package", "firmware"];
/// What a page in a browser needs of it.
const DECODER: [&str; 2] = ["--package", "model-core"];

/// Builds model-core, and firmware where there are pins, for every core; prints one line each.
pub fn run() -> Outcome {
    for (target, packages) in CORES {
        let toolchain = Toolchain::new(target)?;
        let mut build = toolchain.build();
        if target != TARGET {
            // Nothing runs: the compiler need not optimise `core`.
            build.env("CARGO_PROFILE_FIRMWARE_OPT_LEVEL", "0");
        }
        run_command(build.arg("--quiet").args(PROFILE).args(packages))?;
        let built: Vec<&str> = packages.iter().copied().filter(|it| !it.starts_with('-')).collect();
        println!("ok      {target:30} {}", built.join(", "));
    }
    Ok(())
}

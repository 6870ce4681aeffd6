//! What is published to crates.io (docs/c.md): packed and built as `cargo publish` does, and published by nobody.

use std::process::Command;

use crate::cores::DEVICE;
use crate::process::{Outcome, cargo, first_line, root, run as run_command, target_dir};
use crate::structure::metadata;

/// What to try.
#[derive(clap::Args)]
pub struct Options {
    /// Build only the crates of a device from their packages: the others take minutes.
    #[arg(long)]
    short: bool,
}

/// Packs all crates from the ground up, and builds each from its package; and those of a device with their oldest Rust.
pub fn run(options: &Options) -> Outcome {
    // The packages are the files as they are: a change that is not committed is no fault here.
    let publish = ["publish", "--dry-run", "--allow-dirty", "--quiet"];
    if options.short {
        run_command(cargo(&publish).args(["--workspace", "--no-verify"]))?;
        run_command(cargo(&publish).args(DEVICE))?;
    } else {
        run_command(cargo(&publish).arg("--workspace"))?;
    }
    with_oldest_rust()
}

/// Checks the crates of a device with the Rust that their manifests name, if `rustup` has it.
fn with_oldest_rust() -> Outcome {
    let metadata = metadata()?;
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let mut of_device =
        packages.filter(|package| DEVICE.contains(&package["name"].as_str().unwrap_or_default()));
    let oldest = of_device.clone().next().and_then(|package| package["rust_version"].as_str());
    let oldest = oldest.ok_or("no rust-version in the manifests of the device's crates")?;
    if of_device.any(|package| package["rust_version"] != oldest) {
        return Err("the device's crates name different versions of Rust".into());
    }
    if first_line("rustup", &["run", oldest, "rustc", "--version"]).is_none() {
        println!(
            "Rust {oldest} is not installed, and was not tried: rustup toolchain install {oldest} --profile minimal"
        );
        return Ok(());
    }
    let mut check = Command::new("rustup");
    check.args(["run", oldest, "cargo", "check", "--quiet", "--all-features"]).args(DEVICE);
    check.arg("--target-dir").arg(target_dir().join("oldest-rust")).current_dir(root());
    run_command(&mut check)?;
    println!("taxel-core and taxel-firmware build with Rust {oldest}");
    Ok(())
}

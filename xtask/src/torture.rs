//! Builds what the torture needs, and runs it.

use crate::emulate::qemu;
use crate::firmware::{QEMU, build_image};
use crate::process::{Outcome, cargo, run as run_command, target_dir};
use crate::toolchain::{Toolchain, elf};

/// Builds host-sim, the emulator's images and the torture, and runs the torture with `options`. Without an emulator,
/// what needs one is not tested.
pub fn run(options: &[&str]) -> Outcome {
    let mut torture = cargo(&["run", "--package", "torture", "--"]);
    torture.args(options);
    if options.iter().any(|option| ["--help", "-h", "--list"].contains(option)) {
        return run_command(&mut torture);
    }
    run_command(&mut cargo(&["build", "--package", "host-sim", "--package", "torture"]))?;
    torture.arg("--program").arg(target_dir().join("debug/host-sim"));
    match qemu::present().and_then(|()| build_image(&Toolchain::find()?, QEMU)) {
        Ok(()) => drop(torture.arg("--images").arg(elf(""))),
        Err(cause) => eprintln!("note: promises of a device in QEMU stay untested: {cause}"),
    }
    run_command(&mut torture)
}

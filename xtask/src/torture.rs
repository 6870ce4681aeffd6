//! Builds what the torture needs, and runs it.

use crate::emulate::qemu;
use crate::firmware::{QEMU, build_image};
use crate::process::{Outcome, cargo, run as run_command, target_dir};
use crate::toolchain::{Toolchain, elf};

/// Builds host-sim, the emulator's images and the torture, and runs the torture with `options`.
pub fn run(options: &[&str]) -> Outcome {
    run_command(&mut cargo(&["build", "--package", "host-sim", "--package", "torture"]))?;
    let mut torture = cargo(&["run", "--quiet", "--package", "torture", "--"]);
    torture.args(options).arg("--program").arg(target_dir().join("debug/host-sim"));
    if !options.iter().any(|option| ["--help", "-h", "--list"].contains(option)) {
        qemu::present()?;
        build_image(&Toolchain::find()?, QEMU)?;
    }
    torture.arg("--images").arg(elf(""));
    run_command(&mut torture)
}

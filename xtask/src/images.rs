//! Building and linting the firmware for its target, and proving that it cannot panic.

use std::fs;

use crate::panics;
use crate::process::{Outcome, Watched, run as run_command, watch};
use crate::toolchain::{Toolchain, elf};

/// Function that the panic handler of [`NO_PANIC`] calls, and that is defined nowhere.
const SYMBOL: &str = "taxel_reachable_panic";

/// Profile of everything that is built for a device.
pub const PROFILE: [&str; 2] = ["--profile", "firmware"];

/// Packages that are built together. Others are built separately, since a feature that one package enables in a
/// dependency would hold for all.
type Packages = &'static [&'static str];

/// Packages of the emulator's programs.
pub const QEMU: Packages = &["--package", "qemu-image", "--features", "programs"];

/// The application among the emulator's programs.
pub const APPLICATION: &str = "qemu-app";

/// The image that `cargo xtask cycles` measures: one of the emulator's programs, built as the others are.
pub const BENCH: Packages =
    &["--package", "qemu-image", "--features", "programs", "--bin", "qemu-bench"];

/// The image that it measures of trackers.
pub const BENCH_TRACK: Packages =
    &["--package", "qemu-image", "--features", "programs", "--bin", "qemu-bench-track"];

/// The board's image.
pub const NUCLEO: Packages = &["--package", "nucleo-f446re"];

/// Name of the board's image.
pub const NUCLEO_IMAGE: &str = "nucleo-f446re";

/// Name of the board's image with room for a larger sensor, and that room: more rows than pins drive without a decoder.
pub const NUCLEO_WIDE: &str = "nucleo-f446re-wide";
const WIDE: &str = "16x18x18";

/// Libraries of the images.
const LIBRARIES: Packages = &["--package", "taxel-core", "--package", "taxel-firmware"];

/// Programs that link only if no panic can be reached in them: the application, and the example, which scans by pins.
const NO_PANIC: Packages =
    &["--package", "qemu-image", "--bin", APPLICATION, "--bin", "minimal", "--features"];

/// Builds one `image` for people. Without one, builds and lints everything that runs on a device. Links the emulator's
/// application without a panic handler, and once more with a panic in it, which must fail. The board's image may hold panics
/// of others alone, as they are listed.
pub fn run(image: Option<&str>) -> Outcome {
    let toolchain = Toolchain::find()?;
    println!("toolchain: {toolchain}");
    if let Some(image) = image {
        let package = if image == APPLICATION { QEMU } else { NUCLEO };
        let package = package.iter().copied().chain(["--bin", image]);
        run_command(toolchain.build().args(PROFILE).args(package))?;
        println!("{}", elf(image).display());
        return Ok(());
    }
    prove_no_panic(&toolchain)?;
    build_image(&toolchain, QEMU)?;
    build_image(&toolchain, NUCLEO)?;
    panics::check(&elf(NUCLEO_IMAGE))?;
    [LIBRARIES, QEMU, NUCLEO].iter().try_for_each(|packages| lint(&toolchain, packages))
}

/// Builds an image.
pub fn build_image(toolchain: &Toolchain, packages: Packages) -> Outcome {
    run_command(toolchain.build().args(PROFILE).args(packages))
}

/// Builds the board's image with room for a larger sensor. The image of the usual name must be built again afterwards.
pub fn build_wide(toolchain: &Toolchain) -> Outcome {
    let mut command = toolchain.build();
    command.env("TAXEL_CAPACITY", WIDE).args(PROFILE).args(NUCLEO);
    run_command(&mut command)?;
    let [built, kept] = [NUCLEO_IMAGE, NUCLEO_WIDE].map(elf);
    fs::copy(&built, &kept).map_err(|cause| format!("{}: {cause}", kept.display()))?;
    Ok(())
}

fn lint(toolchain: &Toolchain, packages: Packages) -> Outcome {
    let mut command = toolchain.clippy()?;
    run_command(command.args(PROFILE).args(packages).args(["--", "-D", "warnings"]))
}

fn prove_no_panic(toolchain: &Toolchain) -> Outcome {
    let link =
        |feature, echo| watch(toolchain.build().args(PROFILE).args(NO_PANIC).arg(feature), echo);
    let Watched { messages, success } = link("no-panic", true)?;
    if names_symbol(&messages) {
        return Err("a panic is reachable on the device; firmware/qemu/src/no_panic.rs describes \
                    how to find it"
            .into());
    }
    if !success {
        return Err("the firmware does not build".into());
    }
    let Watched { messages, success } = link("must-fail", false)?;
    if success {
        return Err("the proof shows nothing: it links with a reachable panic too".into());
    }
    if !names_symbol(&messages) {
        eprint!("{messages}");
        return Err("the program with a panic failed for another reason than that".into());
    }
    println!("no panic is reachable on the device; with one put in, the program does not link");
    Ok(())
}

/// Whether `messages` contain a linker's complaint that [`SYMBOL`] is undefined.
fn names_symbol(messages: &str) -> bool {
    messages.lines().any(|line| line.contains("undefined") && line.contains(SYMBOL))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_complaint_of_each_linker_is_recognised() {
        assert!(names_symbol(
            "  = note: rust-lld: error: undefined symbol: taxel_reachable_panic\n  >>> referenced by"
        ));
        assert!(names_symbol("a.o: undefined reference to `taxel_reachable_panic'"));
    }

    #[test]
    fn another_failure_is_not_taken_for_a_panic() {
        assert!(!names_symbol("error: undefined symbol: memcpy"));
        assert!(!names_symbol("warning: function `taxel_reachable_panic` is never used"));
    }
}

//! Commands for everything that people and CI run; `cargo xtask help` lists them.

mod process;
mod structure;
mod toolchain;

mod panics;
mod images;
mod cores;
mod size;

mod emulate;

mod board;

mod cycles;

mod c;

mod accept;

mod python;

mod publish;

mod docs;

mod ci;

mod release;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Everything that people and CI run. `bash firmware/setup.sh` installs on Debian what the commands need.
#[derive(Parser)]
#[command(
    bin_name = "cargo xtask",
    after_help = "Exit status: 0 success, 1 failure, 2 wrong usage."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run everything that CI runs, and go on after a failure. A summary at the end has each step's time and the number
    /// of tests that passed.
    Ci,
    /// Check that no crate depends on one above it or on one that it does not use, that all tests run, and that no name is
    /// too long.
    Structure,
    /// Build and lint all code for a device (thumbv7em-none-eabihf), and prove by linking that it cannot panic.
    Firmware {
        /// Build this image alone: the emulator's `qemu-app`, or the board's `nucleo-f446re`.
        #[arg(value_parser = [images::APPLICATION, images::NUCLEO_IMAGE])]
        image: Option<String>,
    },
    /// Check taxel-core and firmware for other cores: thumbv6m, thumbv7m, thumbv8m.main-hf, riscv32imac; taxel-core for
    /// wasm32 too.
    Cores,
    /// Run the programs in firmware/qemu/src/bin in QEMU, compare log and exit status with the .out file beside each,
    /// and the application with the host.
    Emulate(emulate::Options),
    /// Run the board's image on an emulated STM32F446 (proof/board-emulator). The name `serve` lets it run until Ctrl-C,
    /// at a serial port that it names.
    Board(board::Options),
    /// Flash a board, let it test itself, and write what it does beside what is predicted to one JSON file. docs/board.md
    /// tells what it takes.
    Accept(accept::Options),
    /// Print a log that `taxel emulate --log FILE` saved.
    Log {
        log: String,
        /// The image that wrote it, if it is not that command's own.
        elf: Option<String>,
    },
    /// Print the flash and RAM of the images; fail if one takes more than firmware/budget.txt allows.
    Size,
    /// Count in QEMU what decoding costs a Cortex-M4, and compare with firmware/cycles.csv and with what `taxel`
    /// predicts.
    Cycles(cycles::Options),
    /// Export models as C and Rust, compile them with gcc, clang, arm-none-eabi-gcc and rustc in many ways, and compare all bits
    /// with taxel-core's, on this machine and in QEMU. Then count what a frame costs a Cortex-M4F. docs/c.md has the tables.
    C(c::Options),
    /// Build the wheel of the Python module, install it in an environment of its own, and run its tests (docs/python.md).
    Python,
    /// Check links and words of README and docs, and make their figures and pictures again (docs/made.toml).
    Docs(docs::Options),
    /// Build the docs as a site with search, into target/site; needs mdBook (`cargo install mdbook`).
    Site,
    /// Run what takes too long for CI (crates from their packages, the wheel of Python, exported models in all compilers, all of
    /// the emulated board), then build a release into target/release-files: crates, a static program, a wheel of Python and
    /// its sources, images, the site, licences and an SBOM of what they hold, and checksums.
    Release {
        /// Run the checks alone.
        #[arg(long)]
        checks: bool,
    },
    /// Pack every crate that is published, and build it from its package; those of a device with their oldest Rust, too.
    /// Nothing is published (docs/c.md).
    Publish(publish::Options),
}

fn main() -> ExitCode {
    let success = |()| ExitCode::SUCCESS;
    let arguments = Arguments::parse();
    let outcome = match arguments.command {
        Command::Ci => ci::run().map(success),
        Command::Structure => structure::run().map(success),
        Command::Firmware { image } => images::run(image.as_deref()).map(success),
        Command::Cores => cores::run().map(success),
        Command::Emulate(options) => emulate::run(&options).map(success),
        Command::Board(options) => board::run(&options).map(success),
        Command::Accept(options) => accept::run(&options).map(success),
        Command::Log { log, elf } => emulate::print_log(&log, elf.as_deref()).map(success),
        Command::Size => size::run().map(success),
        Command::Cycles(options) => cycles::run(&options).map(success),
        Command::C(options) => c::run(&options).map(success),
        Command::Publish(options) => publish::run(&options).map(success),
        Command::Python => python::test().map(success),
        Command::Docs(options) => docs::run(&options).map(success),
        Command::Site => docs::site::build(&process::target_dir().join("site")).map(success),
        Command::Release { checks } => release::run(checks).map(success),
    };
    outcome.unwrap_or_else(|cause| {
        eprintln!("error: {cause}");
        ExitCode::FAILURE
    })
}

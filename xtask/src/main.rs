//! Commands for everything that people and CI run; `cargo xtask help` lists them.

mod process;
mod structure;
mod lines;
mod toolchain;
mod queue;
mod copy;

mod panics;
mod images;
mod cores;
mod size;

mod emulate;

mod board;

mod cycles;

mod c;

mod accept;

mod torture;

mod mutants;

mod python;

mod publish;

mod docs;

mod release;

mod ci;

use std::env::args_os;
use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

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
    /// Check that no crate depends on one above it or on one that it does not use, and none for a device on one for a desk.
    Structure,
    /// Print the lines of Rust of each crate: all, source code (no comments, blank lines and tests), test code.
    Lines,
    /// Build and lint all code for a device (thumbv7em-none-eabihf), and prove by linking that it cannot panic.
    Firmware {
        /// Build this image alone: the emulator's `qemu-app`, or the board's `nucleo-f446re` or `nucleo-f446re-onchip`.
        #[arg(value_parser = [images::APPLICATION, images::NUCLEO_SPI, images::NUCLEO_ONCHIP])]
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
    /// Print a log that `host-sim emulate --log FILE` saved.
    Log {
        log: String,
        /// The image that wrote it, if it is not that command's own.
        elf: Option<String>,
    },
    /// Print the flash and RAM of the images; fail if one takes more than firmware/budget.txt allows.
    Size,
    /// Count in QEMU what decoding costs a Cortex-M4, for K = 16 to 256 and every kernel (a number format with an
    /// exponential, or its portable Rust version), and compare with budgets and firmware/cycles.csv. Then judge what
    /// firmware/prices.csv predicts by 40 random models.
    Cycles(cycles::Options),
    /// Export models as C, compile them with gcc, clang and arm-none-eabi-gcc in many ways, and compare all bits with
    /// taxel-core's, on this machine and in QEMU. Then count what a frame costs a Cortex-M4F. docs/c.md has the tables.
    C(c::Options),
    /// Build the wheel of the Python module, install it in an environment of its own, and run its tests (docs/python.md).
    Python,
    /// Check links and words of README and docs, and make their figures and pictures again (docs/made.toml).
    Docs(docs::Options),
    /// Build the docs as a site with search, into target/site; needs mdBook (`cargo install mdbook`).
    Site,
    /// Build a release into target/release-files: crates, a static program, a wheel of Python and its sources, images, the site,
    /// licences and an SBOM of what they hold, and checksums.
    Release,
    /// Pack every crate that is published, and build it from its package; those of a device with their oldest Rust, too.
    /// Nothing is published (docs/crates.md).
    Publish(publish::Options),
    /// Put every promise of reliability to the test, and print a table: `torture --help`. As the first option, --self-test
    /// builds a copy of the product with planted faults instead, and fails unless each line sees those that proof/mutants
    /// names it for.
    #[command(disable_help_flag = true)]
    Torture(Rest),
    /// Plant faults in a copy of the product, those of these names or all of proof/mutants, and tell which test and which
    /// line of torture sees each. Fails if none sees a fault that was seen before. The tests that proof/mutants/score.csv
    /// names come first.
    Mutants(mutants::Options),
}

/// Arguments that are passed on.
#[derive(clap::Args)]
struct Rest {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl Rest {
    fn all(&self) -> Vec<&str> {
        self.arguments.iter().map(String::as_str).collect()
    }
}

/// The arguments, with names that exist.
fn parsed(arguments: impl Iterator<Item = OsString>) -> Result<Arguments, clap::Error> {
    let arguments = Arguments::try_parse_from(arguments)?;
    let unknown = match &arguments.command {
        Command::Mutants(options) => options.unknown(),
        _ => None,
    };
    unknown.map_or(Ok(()), |name| {
        let cause = format!("nothing to plant is called `{name}`\n");
        Err(Arguments::command().error(ErrorKind::InvalidValue, cause))
    })?;
    Ok(arguments)
}

fn main() -> ExitCode {
    let success = |()| ExitCode::SUCCESS;
    let arguments = parsed(args_os()).unwrap_or_else(|error| error.exit());
    let outcome = match arguments.command {
        Command::Ci => ci::run().map(success),
        Command::Structure => structure::run().map(success),
        Command::Lines => lines::run().map(success),
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
        Command::Release => release::run().map(success),
        Command::Torture(rest) => torture::run(&rest.all()),
        Command::Mutants(options) => mutants::run(&options).map(success),
    };
    outcome.unwrap_or_else(|cause| {
        eprintln!("error: {cause}");
        ExitCode::FAILURE
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_or_mutant_that_does_not_exist_is_wrong_usage() {
        let exit = |line: &str| {
            let arguments = ["cargo-xtask"].into_iter().chain(line.split(' ')).map(OsString::from);
            parsed(arguments).map_or_else(|error| error.exit_code(), |_| 0)
        };
        for (line, code) in [
            ("mutants no-feed-before-erase", 0),
            ("mutants no-feed-before-eras", 2),
            ("mutants --second no-feed-before-erase", 2),
        ] {
            assert_eq!(exit(line), code, "{line}");
        }
    }
}

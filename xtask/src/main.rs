//! Commands for everything that people and CI run; `cargo xtask help` lists them.

mod process;
mod structure;
mod lines;
mod toolchain;

mod firmware;
mod cores;
mod size;

mod emulate;

mod board;

mod cycles;

mod sensors;

mod torture;

mod mutants;

mod ci;

use std::env;
use std::process::ExitCode;

use emulate::Differences;
use process::{Outcome, PROOF, cargo, status};

const HELP: &str = "\
Usage: cargo xtask COMMAND

  ci                          runs everything that CI runs: format, structure, tests, clippy, fuzz targets and docs, and
                              at the same time firmware, cores, size and cycles; then emulate, board, some of its
                              mutants, and torture. Goes on after a failure. Ends with a summary, which shows each
                              step's time and the number of tests that passed
  structure                   checks that no crate depends on one above it, and none for a device on one for a desk
  lines                       prints the lines of Rust of each crate: all, source code (no comments, blank lines and
                              tests), test code; and the sums, in all and of the product
  firmware                    builds and lints all code for a device (thumbv7em-none-eabihf), and proves by
                              linking that it cannot panic
  cores                       builds model-core and firmware for other cores as well: thumbv6m, thumbv7m,
                              thumbv8m.main-hf, riscv32imac, and model-core for wasm32
  emulate [--accept] [NAME…]  runs the programs in firmware/qemu/src/bin in QEMU, two at a time: those of these
                              names, or all. Compares log and exit status of each with the .out file beside it.
                              Prints the logs of programs that are named. The name `application`, or no name,
                              also compares the application with the host, in less than a minute
      --accept                writes the .out files instead
  board [OPTION…] [NAME…]     runs the board's image on an emulated STM32F446 (proof/board-emulator): the scenarios
                              of these names, or all. The name `serve` lets the board run until Ctrl-C, at a serial
                              port that it names. Needs Python with Unicorn, which firmware/setup.sh installs
      --frames N              lets `check` decode N frames (30)
      --model FILE            uploads this model of the scene `press`, instead of a small one
      --mutants               instead, builds images with one fault each, of these names or all; the scenarios must
                              fail. Takes some minutes
  log FILE [ELF]              prints a log that `host-sim emulate --log FILE` saved. ELF is the image that wrote
                              it, if it is not that command's own
  size                        prints the flash and RAM of the images; fails if an image takes more than
                              firmware/budget.txt allows
  cycles [OPTION…]            measures in QEMU what decoding costs a Cortex-M4: instructions, cycles (by a model
                              of the processor) and microseconds, with memory that never waits and with code in
                              flash, for K = 16 to 256 and every kernel: a number format with an exponential, or
                              its portable Rust version. Fails if a figure exceeds its budget or differs from
                              firmware/cycles.csv. With another compiler than named there, up to 2 % more cycles
                              are allowed, and 16 % from flash. Then judges what firmware/prices.csv predicts by 40
                              random models
      --json                  prints a list of objects to stdout, and nothing else
      --accept                writes firmware/cycles.csv and the tables of docs/cycles.md instead of comparing
      --fit                   fits firmware/prices.csv anew, from which `host-sim` predicts any model's cost, to 750
                              random models. Two minutes
      --kernel NAME           shows this kernel only, and compares it with its budget only
      --model FILE            measures frames of this model, of any shape, such as the chosen.bin of `host-sim trade`,
                              and prints what is predicted beside
  sensors [--accept]          trains models of other sensors than the paper's (z only, one row, 4 × 4, 16 × 32, a CSV
                              file and more), compares 1000 frames on the device with the host's, and prints what each
                              model takes. Two minutes
      --accept                writes the table into docs/sensors.md
  study QUESTION [OPTION…]    answers a question about the sensor, the paper's method or a part of Taxel: `study --help`
  torture [OPTION…] [NAME…]   puts every promise of reliability to the test, or those of these names, and prints a
                              table: promise, cases, worst found, bound, verdict, seed. `torture --help` has all options
      --minutes N             takes so long (20); some promises take longer
      --short                 tests the least number of cases, in at most two minutes
      --seed S                starts from this seed: that of the table repeats the worst case of a promise
      --accept                writes proof/torture/bounds.csv instead: the worst of ten runs of each promise
      --self-test             as the first option: builds a copy of the product with planted faults, and fails unless
                              each line sees those that proof/mutants has it named for. Minutes, behind a build
  mutants [OPTION…] [NAME…]   plants faults in a copy of the product, those of these names or all of proof/mutants, and
                              tells which test and which line of torture sees each. Fails if one is missed that
                              proof/mutants/score.csv has as found. An hour; what was found is kept in target/mutants
      --accept                writes proof/mutants/score.csv instead of comparing
      --second                runs the second list instead of the others
      --all                   tells every unit test that fails, not the first one only
      --package=NAME          runs only the unit tests of this crate, or with `torture` the lines of torture
      --no-torture            runs only unit tests
      --check-list            checks only that each fault's text stands once in its file, and shows the accepted score
  help                        prints this text

`bash firmware/setup.sh` installs the tools for these commands on Debian.
Exit status: 0 success, 1 failure, 2 wrong usage.
Example: cargo xtask emulate hello decode
";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments[..] {
        ["torture", ref options @ ..] => match torture::run(options) {
            Ok(code) => return code,
            Err(cause) => Err(cause),
        },
        ["study", ref options @ ..] => match study(options) {
            Ok(code) => return code,
            Err(cause) => Err(cause),
        },
        ["help" | "--help" | "-h"] | [_, "--help" | "-h"] => {
            print!("{HELP}");
            Ok(())
        }
        ["ci"] => ci::run(),
        ["mutants", ref arguments @ ..] => mutants::run(arguments),
        ["firmware"] => firmware::run(),
        ["emulate", "--accept", ref names @ ..] if are_names(names) => {
            emulate::run(names, Differences::Accept)
        }
        ["emulate", ref names @ ..] if are_names(names) => emulate::run(names, Differences::Fail),
        ["log", log] => emulate::print_log(log, None),
        ["log", log, image] => emulate::print_log(log, Some(image)),
        ["cores"] => cores::run(),
        ["board", ref options @ ..] => match board::Options::parse(options) {
            Ok(options) => board::run(&options),
            Err(cause) => return wrong_usage(&format!("board: {cause}")),
        },
        ["size"] => size::run(),
        ["sensors"] => sensors::run(false),
        ["sensors", "--accept"] => sensors::run(true),
        ["structure"] => structure::run(),
        ["lines"] => lines::run(),
        ["cycles", ref options @ ..] => match cycles::Options::parse(options) {
            Ok(options) => cycles::run(&options),
            Err(cause) => return wrong_usage(&format!("cycles: {cause}")),
        },
        ref arguments => return wrong_usage(&misunderstood(arguments)),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("error: {cause}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a study of `proof/studies`, which says itself what is wrong with `options`.
fn study(options: &[&str]) -> Outcome<ExitCode> {
    let run = ["run", "--release", "--manifest-path", PROOF, "--package", "studies", "--"];
    status(cargo(&run).args(options)).map(torture::code)
}

fn are_names(arguments: &[&str]) -> bool {
    !arguments.iter().any(|argument| argument.starts_with('-'))
}

/// Says why no command has these `arguments`.
fn misunderstood(arguments: &[&str]) -> String {
    const COMMANDS: [&str; 9] =
        ["ci", "structure", "lines", "firmware", "cores", "emulate", "log", "size", "sensors"];
    match arguments {
        [] => "cargo xtask needs a command".to_owned(),
        ["log"] => "log: needs a file behind it".to_owned(),
        [command, rest @ ..] if COMMANDS.contains(command) => {
            let options = || rest.iter().filter(|argument| argument.starts_with('-'));
            let accepts = ["emulate", "sensors"].contains(command) && rest.contains(&"--accept");
            match options().find(|option| !accepts || **option != "--accept") {
                Some(option) => format!("{command}: unknown option `{option}`"),
                None if accepts => {
                    "emulate: `--accept` must stand once, before the names".to_owned()
                }
                None => format!("{command}: too many arguments: `{}`", rest.join(" ")),
            }
        }
        [command, ..] => format!("unknown command `{command}`"),
    }
}

fn wrong_usage(cause: &str) -> ExitCode {
    eprint!("error: {cause}\n\n{HELP}");
    ExitCode::from(2)
}

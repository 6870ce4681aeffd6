//! Commands for everything that people and CI run; `cargo xtask help` lists them.

mod process;
mod structure;
mod toolchain;

mod firmware;
mod size;

mod emulate;

mod cycles;

mod ci;

use std::env;
use std::process::ExitCode;

use emulate::Differences;

const HELP: &str = "\
Usage: cargo xtask COMMAND

  ci                        everything that CI runs: format, structure, tests, clippy, docs, and beside them
                            firmware, size, cycles, emulate; goes on after a failure and ends with a
                            summary, in which each step's time stands beside that in xtask/times.txt
  structure                 which module and crate may import which, and where `unsafe` may stand, as
                            ARCHITECTURE.md says; what part of all lines each crate holds
  firmware                  builds and lints for thumbv7em-none-eabihf all that runs on a device,
                            and proves by linking that no panic is reachable there
  emulate [--accept] [NAME…]  runs the programs of these names, or all, of firmware/qemu/src/bin in
                            QEMU, and compares what they log and their exit status with the .out
                            file beside them; --accept writes these files instead. Shows the logs
                            of programs that are named. `application`, or no name, holds the
                            application to the host as well: under a minute. Two run at a time
  log FILE [ELF]            prints a log that `host-sim emulate --log FILE` saved; ELF is the image
                            that wrote it, if it is another than that command's own
  size                      shows what flash and RAM the images take, and fails if that is more
                            than firmware/budget.txt allows
  cycles [OPTION…]          counts in QEMU what decoding costs a Cortex-M4, with every kernel and
                            K = 16 to 256: instructions, cycles by a model, microseconds; fails if
                            that is more than its budget, or other than firmware/cycles.csv has: exactly
                            with the compiler that it names, else 2 % more
      --json                prints a list of objects to stdout, and nothing else
      --accept              writes firmware/cycles.csv, and the tables of docs/cycles.md, instead
      --kernel NAME         one kernel alone, held to its budget alone
      --model FILE          with this model, such as the chosen.bin of `host-sim trade`, held to
                            what firmware/cycles.csv has for its format, K and tail
  help                      this text

`bash firmware/setup.sh` installs what these need on Debian.
Exit status: 0 all well, 1 something failed, 2 bad usage.
Example: cargo xtask emulate hello decode
";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments[..] {
        ["help" | "--help" | "-h"] | [_, "--help" | "-h"] => {
            print!("{HELP}");
            Ok(())
        }
        ["ci"] => ci::run(),
        ["firmware"] => firmware::run(),
        ["emulate", "--accept", ref names @ ..] if are_names(names) => {
            emulate::run(names, Differences::Accept)
        }
        ["emulate", ref names @ ..] if are_names(names) => emulate::run(names, Differences::Fail),
        ["log", log] => emulate::print_log(log, None),
        ["log", log, image] => emulate::print_log(log, Some(image)),
        ["size"] => size::run(),
        ["structure"] => structure::run(),
        ["cycles", ref options @ ..] if cycles::Options::parse(options).is_some() => {
            cycles::run(&cycles::Options::parse(options).unwrap_or_default())
        }
        [] => {
            eprint!("cargo xtask needs a command\n\n{HELP}");
            return ExitCode::from(2);
        }
        _ => {
            eprint!("cargo xtask does not know `{}`\n\n{HELP}", arguments.join(" "));
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("error: {cause}");
            ExitCode::FAILURE
        }
    }
}

fn are_names(arguments: &[&str]) -> bool {
    !arguments.iter().any(|argument| argument.starts_with('-'))
}

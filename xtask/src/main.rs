//! One command for everything that people and CI run: `cargo xtask help`.

mod ci;
mod firmware;
mod process;
mod toolchain;

use std::env;
use std::process::ExitCode;

const HELP: &str = "\
Usage: cargo xtask COMMAND

  ci [--after-cargo-test]   everything that CI runs: format, clippy, tests, docs, firmware; goes on
                            after a failure and ends with a summary. After a plain `cargo test`,
                            the option tests only the crates which that leaves out
  firmware                  builds model-core and firmware for thumbv7em-none-eabihf, and proves
                            by linking that no panic is reachable on the device
  help                      this text

Exit status: 0 all well, 1 something failed, 2 bad usage.
Example: cargo xtask ci
";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments[..] {
        ["help" | "--help" | "-h"] | [_, "--help" | "-h"] => {
            print!("{HELP}");
            Ok(())
        }
        ["ci"] => ci::run(ci::Tests::All),
        ["ci", "--after-cargo-test"] => ci::run(ci::Tests::LeftOutByCargoTest),
        ["firmware"] => firmware::run(),
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

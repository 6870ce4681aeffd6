//! `taxel`: the program `host-sim` by the project's name.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_sim::program::main_from(std::env::args_os()).into()
}

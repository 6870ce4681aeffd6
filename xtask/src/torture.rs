//! Builds what the torture needs, and runs it.

use std::process::{ExitCode, ExitStatus, Stdio};

use crate::mutants;
use crate::process::{Outcome, cargo, run as run_command, status, target_dir};

/// Cargo's arguments before those of the torture.
const RUN: [&str; 4] = ["run", "--package", "torture", "--"];

/// Builds host-sim and the torture, and runs the torture with `options`.
///
/// Returns the exit status of the torture, which says itself what is wrong: 2 for options or names that it does not
/// know. These are refused before the rest is built.
///
/// With `--self-test` it runs lines on a product with faults instead (`proof/mutants/README.md`).
pub fn run(options: &[&str]) -> Outcome<ExitCode> {
    let self_test = options.strip_prefix(&["--self-test"]);
    let options = self_test.unwrap_or(options);
    let mut torture = cargo(&RUN);
    torture.args(options);
    if options.iter().any(|option| ["--help", "-h", "--list"].contains(option)) {
        return status(&mut torture).map(code);
    }
    let checked = status(cargo(&RUN).arg("--list").args(options).stdout(Stdio::null()))?;
    if !checked.success() {
        return Ok(code(checked));
    }
    if let Some(names) = self_test {
        return mutants::self_test(names).map(|()| ExitCode::SUCCESS);
    }
    run_command(&mut cargo(&["build", "--package", "host-sim"]))?;
    torture.arg("--program").arg(target_dir().join("debug/host-sim"));
    status(&mut torture).map(code)
}

/// Exit code of a program that ended with this `status`; 1 if a signal ended it.
pub fn code(status: ExitStatus) -> ExitCode {
    ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}

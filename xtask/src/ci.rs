//! Everything that CI runs, one step after the other.

use std::time::{Duration, Instant};

use crate::cycles;
use crate::emulate::{self, Differences};
use crate::firmware;
use crate::process::{Outcome, cargo, run as run_command};
use crate::size;

/// Which tests are still to be run.
#[derive(Clone, Copy)]
pub enum Tests {
    /// Those of the whole workspace.
    All,
    /// Those of the crates outside the workspace's default members.
    LeftOutByCargoTest,
}

/// Runs every step, whatever becomes of the ones before, and prints a summary.
pub fn run(tests: Tests) -> Outcome {
    let steps: [(&str, &dyn Fn() -> Outcome); 8] = [
        ("format", &|| run_command(&mut cargo(&["fmt", "--all", "--check"]))),
        ("clippy", &|| {
            let mut command = cargo(&["clippy", "--workspace", "--all-targets"]);
            run_command(command.args(["--", "-D", "warnings"]))
        }),
        ("tests", &|| {
            run_command(&mut match tests {
                Tests::All => cargo(&["test", "--workspace"]),
                Tests::LeftOutByCargoTest => cargo(&["test", "--package", "xtask"]),
            })
        }),
        ("docs", &|| {
            let mut command = cargo(&["doc", "--workspace", "--no-deps"]);
            run_command(command.env("RUSTDOCFLAGS", "-D warnings"))
        }),
        ("firmware", &firmware::run),
        ("emulate", &|| emulate::run(&[], Differences::Fail)),
        ("size", &size::run),
        ("cycles", &|| cycles::run(&cycles::Options::default())),
    ];

    let mut ended = Vec::new();
    for (name, step) in steps {
        eprintln!("\n== {name}");
        let start = Instant::now();
        let outcome = step();
        ended.push((name, start.elapsed(), outcome));
    }
    summarise(&ended)
}

fn summarise(ended: &[(&str, Duration, Outcome)]) -> Outcome {
    println!("\n== summary");
    for (name, time, outcome) in ended {
        let seconds = time.as_secs();
        match outcome {
            Ok(()) => println!("ok      {seconds:4} s  {name}"),
            Err(cause) => println!("FAILED  {seconds:4} s  {name}: {cause}"),
        }
    }
    let failed = ended.iter().filter(|(_, _, outcome)| outcome.is_err()).count();
    if failed == 0 { Ok(()) } else { Err(format!("{failed} of {} steps failed", ended.len())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failed_step_fails_the_whole() {
        let step = |outcome| ("step", Duration::ZERO, outcome);
        assert_eq!(summarise(&[step(Ok(())), step(Ok(()))]), Ok(()));
        let outcome = summarise(&[step(Err("no".into())), step(Ok(()))]);
        assert_eq!(outcome, Err("1 of 2 steps failed".into()));
    }
}

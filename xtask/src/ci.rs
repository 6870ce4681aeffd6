//! Everything that CI runs: two rows of steps side by side, one for the host and one for the device, and the emulators
//! after both.

mod step;
mod times;

use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use crate::process::{Outcome, PROOF, cargo, root, target_dir};
use step::{Ended, Step};
use times::Times;

/// File of the times that the steps take on the reference machine.
const TIMES: &str = "xtask/times.txt";

/// Runs every step, even after a failure, and prints a summary.
pub fn run() -> Outcome {
    let accepted = fs::read_to_string(root().join(TIMES));
    let accepted = accepted.map_err(|cause| format!("{TIMES}: {cause}"))?;
    let accepted = Times::parse(&accepted).map_err(|cause| format!("{TIMES}: {cause}"))?;
    let directory = target_dir().join("ci");
    let failed = |cause: std::io::Error| format!("{}: {cause}", directory.display());
    fs::create_dir_all(&directory).map_err(failed)?;
    // The steps run a copy, because a step that builds this program again replaces the file.
    let this = directory.join("xtask").with_extension(env::consts::EXE_EXTENSION);
    fs::copy(env::current_exe().map_err(failed)?, &this).map_err(failed)?;

    let start = Instant::now();
    let mut ended = in_rows(rows(&this), &directory);
    ended.extend(in_rows([last(&this)], &directory));
    summarise(&ended, start.elapsed(), &accepted)
}

/// The steps, row by row. The steps of one row share their builds, so they follow one another; the two rows build
/// in different folders.
fn rows(this: &Path) -> [Vec<Step>; 2] {
    let step = |name, command| Step { name, command };
    let of_cargo = |name, arguments: &[&str]| step(name, cargo(arguments));
    let own = |name| own(name, this);
    let mut docs = cargo(&["doc", "--workspace", "--no-deps"]);
    docs.env("RUSTDOCFLAGS", "-D warnings");
    let clippy = ["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"];
    // What `cargo xtask torture` runs is built with its tests.
    let proof = ["test", "--manifest-path", PROOF];
    [
        vec![
            of_cargo("format", &["fmt", "--all", "--check"]),
            own("structure"),
            // Plain `cargo test`, as users run it, for the default crates.
            of_cargo("tests", &["test"]),
            of_cargo("xtask-tests", &["test", "--package", "xtask"]),
            of_cargo("proof-tests", &proof),
            // Docs need what clippy has checked.
            of_cargo("clippy", &clippy),
            step("proof-clippy", proof_clippy()),
            step("docs", docs),
        ],
        vec![own("firmware"), own("cores"), own("size"), own("cycles")],
    ]
}

/// Clippy of the proof. As if somebody had built libFuzzer before, it needs no compiler of C++: nothing is linked.
fn proof_clippy() -> Command {
    let mut command = cargo(&[
        "clippy",
        "--manifest-path",
        PROOF,
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]);
    command.env("CUSTOM_LIBFUZZER_PATH", "./libfuzzer.a");
    command
}

/// Mutants of the board's image that CI builds: one for each of its files that matter most. All take some minutes.
const MUTANTS: [&str; 4] = ["select-early", "cache-stale", "over-drive", "not-fed-before-erase"];

/// The steps after both rows. They run two programs at a time, an emulator and a host or two emulators, whose devices
/// answer in time only if the machine has a core for each.
fn last(this: &Path) -> Vec<Step> {
    let mut mutants = Command::new(this);
    mutants.args(["board", "--mutants"]).args(MUTANTS).current_dir(root());
    let mutants = Step { name: "mutants", command: mutants };
    let torture = |name, options: &[&str]| {
        let mut command = Command::new(this);
        command.arg("torture").args(options).current_dir(root());
        Step { name, command }
    };
    let kept = torture("torture", &["--short"]);
    let planted = torture("self-test", &["--self-test"]);
    vec![own("emulate", this), own("board", this), mutants, kept, planted]
}

/// A step that is a command of this program, of which `this` is a copy.
fn own(name: &'static str, this: &Path) -> Step {
    let mut command = Command::new(this);
    command.arg(name).current_dir(root());
    Step { name, command }
}

/// Runs the rows side by side, and prints each step's output when it ends; returns the steps row by row.
fn in_rows<const ROWS: usize>(rows: [Vec<Step>; ROWS], directory: &Path) -> Vec<Ended> {
    // Only one step's output is printed at a time.
    let printing = Mutex::new(());
    let run_row = |row: Vec<Step>| -> Vec<Ended> {
        let run = |step: Step| {
            eprintln!("-- {} started", step.name);
            let ended = step.run(directory);
            let guard = printing.lock();
            let verdict = if ended.outcome.is_ok() { "ok" } else { "FAILED" };
            println!(
                "\n== {} ({verdict}, {} s)\n{}",
                ended.name,
                ended.time.as_secs(),
                ended.output
            );
            drop(guard);
            ended
        };
        row.into_iter().map(run).collect()
    };
    let run_row = &run_row;
    thread::scope(|scope| {
        let rows = rows.map(|row| scope.spawn(move || run_row(row)));
        rows.into_iter().flat_map(|row| row.join().unwrap_or_default()).collect()
    })
}

fn summarise(ended: &[Ended], whole: Duration, accepted: &Times<'_>) -> Outcome {
    println!("\n== summary");
    for Ended { name, time, outcome, .. } in ended {
        let time = accepted.beside(name, *time);
        match outcome {
            Ok(()) => println!("ok      {name:12} {time}"),
            Err(cause) => println!("FAILED  {name:12} {time}: {cause}"),
        }
    }
    println!("in all  {:12} {:6.0} s, two steps at a time", "", whole.as_secs_f64());
    for warning in ended.iter().filter_map(|step| accepted.warning(step.name, step.time)) {
        println!("warning: {warning} ({TIMES})");
    }
    let failed = ended.iter().filter(|step| step.outcome.is_err()).count();
    if failed == 0 { Ok(()) } else { Err(format!("{failed} of {} steps failed", ended.len())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(outcome: Outcome) -> Ended {
        Ended { name: "step", time: Duration::ZERO, outcome, output: String::new() }
    }

    #[test]
    fn one_failed_step_fails_the_whole() {
        let accepted = Times::parse("").unwrap();
        let summarise = |ended: &[Ended]| summarise(ended, Duration::ZERO, &accepted);
        assert_eq!(summarise(&[ended(Ok(())), ended(Ok(()))]), Ok(()));
        let outcome = summarise(&[ended(Err("no".into())), ended(Ok(()))]);
        assert_eq!(outcome, Err("1 of 2 steps failed".into()));
    }

    #[test]
    fn a_step_that_takes_long_does_not_fail_the_whole() {
        let accepted = Times::parse("step 1").unwrap();
        let slow = Ended { time: Duration::from_secs(100), ..ended(Ok(())) };
        assert_eq!(summarise(&[slow], Duration::ZERO, &accepted), Ok(()));
    }

    #[test]
    fn every_step_has_an_accepted_time() {
        let text = include_str!("../times.txt");
        let this = Path::new("xtask");
        let steps = rows(this).into_iter().flatten().chain(last(this));
        let steps: Vec<&str> = steps.map(|step| step.name).collect();
        assert_eq!(Times::parse(text).unwrap().names(), steps);
    }

    #[cfg(unix)]
    #[test]
    fn steps_of_a_row_follow_one_another_even_after_a_failure_and_rows_run_together() {
        let directory = env::temp_dir().join(format!("taxel-rows-{}", std::process::id()));
        fs::create_dir_all(&directory).unwrap();
        let step = |name, script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]).current_dir(&directory);
            Step { name, command }
        };
        // The steps of both rows wait for each other: neither ends unless both run.
        let wait = |own, other| format!("touch {own}; while [ ! -e {other} ]; do sleep 0.01; done");
        let rows = [
            vec![step("a", "exit 1"), step("b", &wait("b-here", "d-here"))],
            vec![step("c", "true"), step("d", &wait("d-here", "b-here"))],
        ];
        let ended: Vec<_> = in_rows(rows, &directory)
            .into_iter()
            .map(|ended| (ended.name, ended.outcome.is_ok()))
            .collect();
        assert_eq!(ended, [("a", false), ("b", true), ("c", true), ("d", true)]);
        fs::remove_dir_all(&directory).unwrap();
    }
}

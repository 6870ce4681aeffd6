//! Everything that CI runs: two rows of steps side by side, one for the host and one for the device, and what needs all
//! cores after both. And what takes too long for every change, and is run before a release.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use std::{env, thread};

use crate::process::{Outcome, cargo, root, target_dir};

/// A step's name and command.
type Step = (&'static str, Command);

/// A step that has ended: its name, its time, and the lines for the summary if it failed or ran tests.
type Ended = (&'static str, Duration, Outcome<String>);

/// Scenarios of the emulated board that CI runs: those of the main path, and of faults that restart the board. A release
/// runs all.
const SCENARIOS: [&str; 9] = [
    "session",
    "sparse",
    "silent-sensor",
    "fault-restarts",
    "panic-restarts",
    "burst",
    "restart",
    "scans",
    "shorts",
];

/// Runs every step of CI, even after a failure, and prints a summary.
pub fn run() -> Outcome {
    run_all(steps)
}

/// Runs what a release needs beside CI: packages, the module of Python, tests with more cases, errors of a tracker and events
/// against their bounds, all scenarios of the emulated board, a record of it, and exported models in all compilers.
pub fn run_before_release() -> Outcome {
    run_all(steps_of_release)
}

fn run_all(steps: fn(&Path) -> [Vec<Step>; 3]) -> Outcome {
    let logs = target_dir().join("ci");
    let failed = |cause: std::io::Error| format!("{}: {cause}", logs.display());
    fs::create_dir_all(&logs).map_err(failed)?;
    // The steps run a copy, because a step that builds this program again replaces the file.
    let this = logs.join("xtask").with_extension(env::consts::EXE_EXTENSION);
    fs::copy(env::current_exe().map_err(failed)?, &this).map_err(failed)?;
    let start = Instant::now();
    let [host, device, alone] = steps(&this);
    let mut ended = side_by_side([host, device], &logs);
    ended.extend(side_by_side([alone], &logs));
    println!("\n== summary");
    for (name, time, outcome) in &ended {
        let (verdict, text) = match outcome {
            Ok(text) => ("ok", text),
            Err(cause) => ("FAILED", cause),
        };
        println!("{verdict:6} {name:12} {:5.0} s  {text}", time.as_secs_f64());
    }
    println!("in all {:12} {:5.0} s, two steps at a time", "", start.elapsed().as_secs_f64());
    let failed = ended.iter().filter(|(_, _, outcome)| outcome.is_err()).count();
    if failed == 0 { Ok(()) } else { Err(format!("{failed} of {} steps failed", ended.len())) }
}

/// Step that runs a command of xtask's own, of which `this` is a copy.
fn own(this: &Path, name: &'static str, arguments: &[&str]) -> Step {
    let mut command = Command::new(this);
    command.args(arguments).current_dir(root());
    (name, command)
}

/// The steps of CI: two rows that build in different folders, and what follows both. QEMU's devices answer in time only
/// if the machine has a core for QEMU and one for its host.
fn steps(this: &Path) -> [Vec<Step>; 3] {
    let own = |name, arguments: &[&str]| own(this, name, arguments);
    // The fuzz targets are checked as if libFuzzer had been built: that needs no nightly toolchain and no C++.
    let of_all = |arguments: &[&str]| {
        let mut command = cargo(arguments);
        command.env("CUSTOM_LIBFUZZER_PATH", "./libfuzzer.a");
        command
    };
    let clippy = of_all(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]);
    let mut docs = of_all(&["doc", "--workspace", "--no-deps"]);
    docs.env("RUSTDOCFLAGS", "-D warnings");
    [
        vec![
            ("format", cargo(&["fmt", "--all", "--check"])),
            own("structure", &["structure"]),
            // Plain `cargo test`, as users run it, for the default crates.
            ("tests", cargo(&["test"])),
            ("xtask-tests", cargo(&["test", "--package", "xtask"])),
            // Docs need what clippy has checked.
            ("clippy", clippy),
            ("docs", docs),
            // With the program that the tests have built.
            own("pages", &["docs"]),
        ],
        vec![
            own("firmware", &["firmware"]),
            own("cores", &["cores"]),
            own("size", &["size"]),
            own("cycles", &["cycles"]),
            own("c", &["c", "--short"]),
            // The emulated board's time is virtual: it answers alike on a busy machine.
            own("board", &[&["board"], &SCENARIOS[..]].concat()),
            own("accept", &["accept", "--emulated"]),
        ],
        vec![own("emulate", &["emulate"])],
    ]
}

/// The steps that only a release waits for.
fn steps_of_release(this: &Path) -> [Vec<Step>; 3] {
    let own = |name, arguments: &[&str]| own(this, name, arguments);
    // The tests that draw their cases. A power cut takes a hundred times as long as another case.
    let drawn = |name, count: &str, tests: &[&str]| {
        let mut command = cargo(&[&["test", "--tests", "--"], tests].concat());
        command.env("TAXEL_CASES", count);
        (name, command)
    };
    let cases = drawn("cases", "3000", &["extremes", "limits_agree", "number_formats"]);
    let hostile = drawn("hostile", "60000", &["hostile"]);
    let power_cuts = drawn("power-cuts", "30", &["power_cuts"]);
    // They hold errors of a tracker, and events of a touch, to their bounds.
    let [tracking, events] = ["tracking", "events"].map(|name| {
        (name, cargo(&["run", "--quiet", "--package=taxel-evaluate", "--example", name]))
    });
    let [publish, python] = ["publish", "python"].map(|name| own(name, &[name]));
    [
        vec![publish, python, cases, hostile, power_cuts, tracking, events],
        vec![own("c", &["c"]), own("board", &["board"])],
        vec![own("faults", &["accept", "--emulated", "--fault", "all"])],
    ]
}

/// Runs rows side by side, the steps of each one after the other.
fn side_by_side<const ROWS: usize>(rows: [Vec<Step>; ROWS], logs: &Path) -> Vec<Ended> {
    // Only one step's output is printed at a time.
    let printing = &Mutex::new(());
    let run_row = |row: Vec<Step>| -> Vec<Ended> {
        row.into_iter().map(|step| run_step(step, logs, printing)).collect()
    };
    thread::scope(|scope| {
        let rows = rows.map(|row| scope.spawn(move || run_row(row)));
        rows.into_iter().flat_map(|row| row.join().unwrap_or_default()).collect()
    })
}

/// Runs a step, whose output goes to a file, and prints that when it ends.
fn run_step((name, mut command): Step, logs: &Path, printing: &Mutex<()>) -> Ended {
    eprintln!("-- {name} started");
    let start = Instant::now();
    let log = logs.join(name).with_extension("log");
    let status = File::create(&log).and_then(|file| {
        command.stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file).status()
    });
    let time = start.elapsed();
    let output = String::from_utf8_lossy(&fs::read(&log).unwrap_or_default()).into_owned();
    let guard = printing.lock();
    println!("\n== {name} ({} s)\n{output}", time.as_secs());
    drop(guard);
    let outcome = match status {
        Ok(status) if status.success() => Ok(passed(&output)),
        Ok(status) => {
            let cause = output.rfind("error: ").map_or("", |at| output[at..].trim_end());
            Err(format!("{status}; {cause}"))
        }
        Err(cause) => Err(format!("cannot be started: {cause}")),
    };
    (name, time, outcome)
}

/// Number of tests that passed, by what the test programs say; empty if there are none.
fn passed(output: &str) -> String {
    let results = output.lines().filter_map(|line| line.strip_prefix("test result: ok. "));
    let counts = results.filter_map(|line| line.split(' ').next()?.parse::<usize>().ok());
    counts
        .reduce(|all, count| all + count)
        .map_or(String::new(), |all| format!("{all} tests passed"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn steps_of_a_row_run_in_order_and_rows_in_parallel() {
        let logs = env::temp_dir().join(format!("taxel-rows-{}", std::process::id()));
        fs::create_dir_all(&logs).unwrap();
        let step = |name, script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]).current_dir(&logs);
            (name, command)
        };
        // The steps of both rows wait for each other: neither ends unless both run.
        let wait = |own, other| format!("touch {own}; while [ ! -e {other} ]; do sleep 0.01; done");
        let result = "echo 'test result: ok. 3 passed; 0 failed'; echo 'test result: ok. 4 passed'";
        let rows = [
            vec![step("a", "echo; echo error: no; exit 1"), step("b", &wait("b-here", "d-here"))],
            vec![step("c", result), step("d", &wait("d-here", "b-here"))],
        ];
        let ended = side_by_side(rows, &logs);
        let ended: Vec<_> = ended.into_iter().map(|(name, _, outcome)| (name, outcome)).collect();
        let failed = Err("exit status: 1; error: no".to_owned());
        let (none, seven) = (Ok(String::new()), Ok("7 tests passed".to_owned()));
        assert_eq!(ended, [("a", failed), ("b", none.clone()), ("c", seven), ("d", none)]);
        fs::remove_dir_all(&logs).unwrap();
    }
}

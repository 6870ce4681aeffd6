//! The tests of the copy, in processes of their own.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::copy::{Copy, folder};
use crate::process::{Outcome, root};

/// Longest that tests of one program run in one process, by their own times: the next ones need not run if one of
/// them fails.
const BATCH_MS: u64 = 5000;
/// Longest that a test whose time is not known yet may take.
const TRACE_LIMIT_MS: u64 = 900_000;
/// Memory that a test may take, in KiB: a fault may be a bound that is gone.
const MOST_KIB: u64 = 12_000_000;

/// One unit test, or one line of torture.
#[derive(Debug, Clone)]
pub struct Test {
    /// Place among the copy's programs; none for a line of torture.
    pub program: Option<usize>,
    pub name: String,
    /// Time without a fault.
    pub ms: u64,
    /// Numbers of the faults that it reaches.
    pub reaches: BTreeSet<usize>,
}

/// How a process with a fault is told of it.
pub enum Switch<'a> {
    Trace(&'a Path),
    On(usize),
}

/// All tests of the copy, not yet traced.
pub fn all(copy: &Copy) -> Outcome<Vec<Test>> {
    let mut tests = Vec::new();
    for (place, (_, program)) in copy.programs.iter().enumerate() {
        for line in said(Command::new(program).args(["--list", "--format=terse"]))?.lines() {
            tests.extend(line.strip_suffix(": test").map(|name| test(Some(place), name)));
        }
    }
    if copy.has_torture {
        tests.extend(lines(copy)?);
    }
    Ok(tests)
}

/// All lines of torture, not yet traced.
pub fn lines(copy: &Copy) -> Outcome<Vec<Test>> {
    let listed = said(Command::new(&copy.torture).arg("--list"))?;
    let names = listed.lines().filter_map(|line| line.split_whitespace().next());
    Ok(names.map(|name| test(None, name)).collect())
}

fn test(program: Option<usize>, name: &str) -> Test {
    Test { program, name: name.to_owned(), ms: 0, reaches: BTreeSet::new() }
}

fn said(command: &mut Command) -> Outcome<String> {
    let output = command.output().map_err(|cause| format!("{command:?}: {cause}"))?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Tests of one program that run in one process, at most about [`BATCH_MS`]; quick ones first.
pub fn batches<'t>(copy: &Copy, tests: &[&'t Test], own: &str) -> Vec<Vec<&'t Test>> {
    let mut batches: Vec<Vec<&Test>> = Vec::new();
    let mut tests = tests.to_vec();
    tests.sort_by_key(|test| (test.program, test.ms));
    for test in tests {
        match batches.last_mut() {
            Some(batch)
                if test.program.is_some()
                    && batch[0].program == test.program
                    && time(batch) + test.ms < BATCH_MS =>
            {
                batch.push(test);
            }
            _ => batches.push(vec![test]),
        }
    }
    let of_own = |test: &Test| test.program.is_some_and(|place| copy.programs[place].0 == own);
    batches.sort_by_key(|batch| (!of_own(batch[0]), time(batch)));
    batches
}

fn time(batch: &[&Test]) -> u64 {
    batch.iter().map(|test| test.ms).sum()
}

/// Tests that are running. Many write to a folder that bears their name, so that none may run twice at once.
static RUNNING: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Waits until none of these tests is running, and takes them.
fn take(batch: &[&Test]) {
    loop {
        if let Ok(mut running) = RUNNING.lock()
            && !batch.iter().any(|test| running.contains(&test.name))
        {
            running.extend(batch.iter().map(|test| test.name.clone()));
            return;
        }
        sleep(Duration::from_millis(20));
    }
}

/// Runs tests as [`run`] does, while no other worker runs one of them.
///
/// # Errors
/// A line of torture could not be tested here.
pub fn red(copy: &Copy, batch: &[&Test], switch: &Switch, worker: usize) -> Outcome<Vec<String>> {
    take(batch);
    let outcome = run(copy, batch, switch, worker);
    if let Ok(mut running) = RUNNING.lock() {
        for test in batch {
            running.remove(&test.name);
        }
    }
    outcome
}

/// Runs tests of one program in one process, and returns the names of those that fail. A test in which the process
/// dies or hangs has failed.
fn run(copy: &Copy, batch: &[&Test], switch: &Switch, worker: usize) -> Outcome<Vec<String>> {
    let Some(first) = batch.first() else { return Ok(Vec::new()) };
    let scratch = folder().join(format!("scratch-{worker}"));
    let (log, temporary) = (scratch.join("log"), scratch.join("tmp"));
    let failed = |cause| format!("{}: {cause}", scratch.display());
    let _ = fs::remove_dir_all(&temporary);
    fs::create_dir_all(&temporary).map_err(failed)?;
    let (program, place) = match first.program {
        Some(place) => {
            (&copy.programs[place].1, folder().join("source").join(&copy.programs[place].0))
        }
        None => (&copy.torture, folder().join("source")),
    };
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {MOST_KIB}; exec \"$0\" \"$@\"")]).arg(program);
    if first.program.is_some() {
        command.args(["--exact", "--test-threads=1"]).args(batch.iter().map(|test| &test.name));
    } else {
        command.args(["--short", "--json", &first.name, "--program"]).arg(&copy.host_sim);
    }
    match switch {
        Switch::Trace(file) => command.env("TAXEL_FAULT_TRACE", file),
        Switch::On(number) => command.env("TAXEL_FAULT", number.to_string()),
    };
    let out = File::create(&log).map_err(failed)?;
    // As `cargo test` does, for programs that look for files of their crate.
    command.env("CARGO_MANIFEST_DIR", &place).current_dir(&place).env("TMPDIR", &temporary);
    command.process_group(0).stdin(Stdio::null()).stdout(out).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|cause| format!("{command:?}: {cause}"))?;
    let limit_ms = if first.ms == 0 { TRACE_LIMIT_MS } else { 20_000 + 10 * time(batch) };
    let limit = Duration::from_millis(limit_ms);
    let start = Instant::now();
    let ended_well = loop {
        match child.try_wait().map_err(failed)? {
            Some(status) => break status.success(),
            None if start.elapsed() > limit => break false,
            None => sleep(Duration::from_millis(5)),
        }
    };
    // The group of this child: programs that it started, too.
    if !ended_well {
        let group = format!("-{}", child.id());
        let _ = Command::new("kill").args(["-KILL", "--", &group]).stderr(Stdio::null()).status();
        let _ = child.wait();
    }
    let text = String::from_utf8_lossy(&fs::read(&log).map_err(failed)?).into_owned();
    if first.program.is_none() {
        return torture_verdict(first, &text);
    }
    let says = |test: &&&Test, end: &str| text.contains(&format!("test {} ... {end}", test.name));
    let mut red: Vec<_> = batch.iter().filter(|test| says(test, "FAILED")).collect();
    if !ended_well && red.is_empty() {
        // Tests that are done have said so; the process ended in the next one.
        let is_open = |test: &&&Test| !says(test, "ok") && !says(test, "ignored");
        red.extend(
            batch
                .iter()
                .filter(is_open)
                .min_by_key(|test| !text.contains(&format!("test {} ...", test.name))),
        );
        if red.is_empty() {
            red.push(first);
        }
    }
    Ok(red.into_iter().map(|test| test.name.clone()).collect())
}

/// The name of a line of torture that is not kept: no verdict at all is a crash or a hang.
fn torture_verdict(line: &Test, text: &str) -> Outcome<Vec<String>> {
    let lines: Value = serde_json::from_str(text).unwrap_or_default();
    let lines = lines.as_array().map(Vec::as_slice).unwrap_or_default();
    let own = lines.iter().find(|entry| entry["name"] == line.name.as_str());
    match own.map(|entry| entry["verdict"].as_str().unwrap_or_default()) {
        Some("pass") => Ok(Vec::new()),
        Some("untested") if own.is_some_and(|entry| needs_tools(&entry["note"])) => Err(format!(
            "{}: {}",
            line.name,
            own.map_or("", |own| own["note"].as_str().unwrap_or(""))
        )),
        _ => Ok(vec![line.name.clone()]),
    }
}

/// Whether a line was not tested because this machine, or this command, gives it no tool.
fn needs_tools(note: &Value) -> bool {
    note.as_str().is_some_and(|note| note.contains("is not built"))
}

/// Traces one test: takes its time, and notes which faults it reaches.
pub fn trace(copy: &Copy, test: &Test, worker: usize) -> Outcome<Test> {
    let file: PathBuf = folder().join(format!("trace-{worker}"));
    let _ = fs::remove_file(&file);
    let start = Instant::now();
    let red = red(copy, &[test], &Switch::Trace(&file), worker)?;
    if !red.is_empty() {
        return Err(format!("{} fails without a fault", test.name));
    }
    let ms = start.elapsed().as_millis() as u64 + 1;
    let reaches = fs::read_to_string(&file).unwrap_or_default();
    let reaches = reaches.lines().filter_map(|line| line.parse().ok()).collect();
    Ok(Test { ms, reaches, ..test.clone() })
}

/// Name of a test as the score has it: program, then test.
pub fn full_name(copy: &Copy, test: &Test) -> String {
    let Some((crate_folder, program)) = test.program.map(|place| &copy.programs[place]) else {
        return test.name.clone();
    };
    let file = program.file_stem().unwrap_or_default().to_string_lossy();
    let stem = file.rsplit_once('-').map_or(&*file, |(stem, _)| stem);
    let package = Path::new(crate_folder).file_name().unwrap_or_default().to_string_lossy();
    debug_assert!(root().join(crate_folder).exists());
    if stem.starts_with("taxel_") || stem.replace('_', "-") == package {
        format!("{package} {}", test.name)
    } else {
        format!("{package}/{stem} {}", test.name)
    }
}

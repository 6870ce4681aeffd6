//! `cargo xtask mutants`: plants faults in a copy of the product, and tells which tests see them
//! (`proof/mutants/README.md`).

mod list;
mod copy;
mod programs;
mod score;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::process::Outcome;
use copy::{Copy, folder};
use list::Fault;
use programs::{Switch, Test, batches, full_name, lines, red, trace};
use score::Found;

/// Tests that run at the same time.
const WORKERS: usize = 2;

/// Runs `mutants` with these arguments.
///
/// # Errors
/// The lists are wrong, the copy does not build, or a fault is missed that was found before.
pub fn run(arguments: &[&str]) -> Outcome {
    let is_second = arguments.contains(&"--second");
    let faults = list::load(is_second)?;
    let accepted = score::accepted(is_second);
    let (options, names): (Vec<&str>, Vec<&str>) =
        arguments.iter().partition(|argument| argument.starts_with("--"));
    let with_torture = !options.contains(&"--no-torture");
    let (crates, options): (Vec<&str>, Vec<&str>) = options
        .into_iter()
        .filter(|option| !["--no-torture", "--second"].contains(option))
        .partition(|option| option.starts_with("--package="));
    let crates: Vec<&str> = crates.iter().filter_map(|it| it.strip_prefix("--package=")).collect();
    if let Some(unknown) = names.iter().find(|name| !faults.iter().any(|it| it.name == **name)) {
        return Err(format!("mutants: no fault is called `{unknown}`"));
    }
    match options[..] {
        ["--check-list"] => {
            println!("{} faults", faults.len());
            let verdict = |fault: &Fault| accepted.get(&fault.name).map_or("", String::as_str);
            print!("{}", score::by_crate(faults.iter().map(|fault| (fault, verdict(fault)))));
            return Ok(());
        }
        [] | ["--accept" | "--all"] => {}
        _ => return Err(format!("mutants: unknown options {options:?}")),
    }
    if options == ["--accept"] && !names.is_empty() {
        return Err("mutants: --accept writes the score of all faults".to_owned());
    }
    let copy = copy::build(&faults, &crates, with_torture)?;
    let tests = traced(&copy, &faults)?;
    let numbers: Vec<usize> = (1..=faults.len())
        .filter(|number| names.is_empty() || names.contains(&&*faults[number - 1].name))
        .collect();
    let scored = measure(&copy, &faults, &numbers, &tests, options == ["--all"])?;
    for (fault, found) in &scored {
        println!("{:<24}{}", found.verdict(fault), fault.name);
        println!("{:<24}unit: {}", "", found.unit.join("; "));
        println!("{:<24}torture: {}", "", found.torture.join(" "));
        if found.verdict(fault) == "missed" {
            println!("{:<24}{}: {}", "", fault.file, fault.why);
        }
    }
    print!(
        "{}",
        score::by_crate(scored.iter().map(|(fault, found)| (*fault, found.verdict(fault))))
    );
    if options == ["--accept"] {
        return score::accept(&scored, is_second);
    }
    let worse = |(fault, found): &&(&Fault, Found)| {
        let before = accepted.get(&fault.name).map(String::as_str);
        before.is_some_and(|before| {
            before == "found" && !["found", "open"].contains(&found.verdict(fault))
        }) || found.verdict(fault).starts_with("found though")
    };
    let worse: Vec<&str> = scored.iter().filter(worse).map(|(fault, _)| &*fault.name).collect();
    if worse.is_empty() {
        Ok(())
    } else {
        Err(format!("found before and not now, or found though equivalent: {}", worse.join(", ")))
    }
}

/// Lines of torture that no fault of the lists can turn red, and why.
const WITHOUT_FAULT: [(&str, &str); 1] =
    [("ram-flip", "its device runs in QEMU, whose image is not built with faults")];

/// Runs the lines of torture that faults name, or those of these `names` alone: each without a fault, which it must
/// stand, and with each of its faults, of which it must turn red.
///
/// # Errors
/// The copy does not build, a line misses a fault, or it has none.
pub fn self_test(names: &[&str]) -> Outcome {
    let faults = list::load(false)?;
    let copy = copy::build(&faults, &[copy::TORTURE], true)?;
    let mut lines = lines(&copy)?;
    let is_chosen =
        |line: &str| names.is_empty() || names.iter().any(|name| line.starts_with(name));
    for (fault, line) in
        faults.iter().flat_map(|fault| fault.torture.iter().map(move |it| (fault, it)))
    {
        if !lines.iter().any(|known| known.name == *line) {
            return Err(format!("{}: no line of torture is called `{line}`", fault.name));
        }
    }
    lines.retain(|line| is_chosen(&line.name));
    // Number 0 is no fault.
    let mut cases = Vec::new();
    let mut bad = Vec::new();
    for line in &lines {
        let own = faults.iter().enumerate().filter(|(_, fault)| fault.torture.contains(&line.name));
        let numbers: Vec<usize> = own.map(|(index, _)| index + 1).collect();
        if !numbers.is_empty() {
            cases.push((line, 0));
        } else if !WITHOUT_FAULT.iter().any(|(name, _)| *name == line.name) {
            bad.push(format!("{} has no fault to find", line.name));
        }
        cases.extend(numbers.into_iter().map(|number| (line, number)));
    }
    let outcomes = shared(cases.len(), |place, worker| {
        let (line, number) = cases[place];
        let is_red = !red(&copy, &[line], &Switch::On(number), worker)?.is_empty();
        let fault = number.checked_sub(1).map_or("no fault", |index| &faults[index].name);
        let verdict = match (number, is_red) {
            (0, false) => "kept",
            (0, true) => "BROKEN",
            (_, true) => "found",
            (_, false) => "MISSED",
        };
        println!("{verdict:<8}{:<24}{fault}", line.name);
        Ok::<_, String>((number == 0) == is_red)
    });
    for ((line, number), is_bad) in cases.iter().zip(outcomes) {
        if is_bad? {
            let fault = number.checked_sub(1).map_or("no fault", |index| &faults[index].name);
            bad.push(format!("{} with {fault}", line.name));
        }
    }
    for (line, why) in WITHOUT_FAULT.iter().filter(|(line, _)| is_chosen(line)) {
        println!("none    {line:<24}{why}");
    }
    if bad.is_empty() { Ok(()) } else { Err(format!("not as it should be: {}", bad.join("; "))) }
}

/// Runs `work` for each of so many places with [`WORKERS`], and returns the results in order.
fn shared<T: Send>(count: usize, work: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(BTreeMap::new());
    thread::scope(|scope| {
        for worker in 0..WORKERS {
            let (next, done, work) = (&next, &done, &work);
            scope.spawn(move || {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    if place >= count {
                        break;
                    }
                    let result = work(place, worker);
                    if let Ok(mut done) = done.lock() {
                        done.insert(place, result);
                    }
                }
            });
        }
    });
    done.into_inner().unwrap_or_default().into_values().collect()
}

/// All tests that pass without a fault, with the faults that each reaches. A file keeps them, until the copy differs.
fn traced(copy: &Copy, faults: &[Fault]) -> Outcome<Vec<Test>> {
    let mut state = DefaultHasher::new();
    (copy.digest, faults.iter().map(Fault::key).collect::<Vec<_>>()).hash(&mut state);
    let file = folder().join(format!("trace-{:016x}.csv", state.finish()));
    let tests = programs::all(copy)?;
    let known = fs::read_to_string(&file).unwrap_or_default();
    let known: BTreeMap<String, (u64, BTreeSet<usize>)> = known
        .lines()
        .filter_map(|line| {
            let mut fields = line.split(',');
            let (name, ms) = (fields.next()?.to_owned(), fields.next()?.parse().ok()?);
            Some((name, (ms, fields.filter_map(|number| number.parse().ok()).collect())))
        })
        .collect();
    let failed = |cause: std::io::Error| format!("{}: {cause}", file.display());
    let log = fs::File::options().append(true).create(true).open(&file).map_err(failed)?;
    let log = Mutex::new(log);
    let is_new = |test: &&Test| !known.contains_key(&full_name(copy, test));
    eprintln!("tracing {} of {} tests", tests.iter().filter(is_new).count(), tests.len());
    let outcomes = shared(tests.len(), |place, worker| {
        let (test, name) = (&tests[place], full_name(copy, &tests[place]));
        if let Some((ms, reaches)) = known.get(&name) {
            return Ok::<_, String>(Test { ms: *ms, reaches: reaches.clone(), ..test.clone() });
        }
        // Twice, as one that fails with a fault.
        let traced = trace(copy, test, worker).or_else(|_| trace(copy, test, worker));
        let traced = traced.map_err(|cause| format!("left out: {cause}"))?;
        let numbers: Vec<String> = traced.reaches.iter().map(usize::to_string).collect();
        if let Ok(mut log) = log.lock() {
            writeln!(log, "{name},{},{}", traced.ms, numbers.join(",")).map_err(failed)?;
        }
        Ok(traced)
    });
    let mut passing = Vec::new();
    for outcome in outcomes {
        match outcome {
            Ok(test) => passing.push(test),
            Err(cause) => eprintln!("{cause}"),
        }
    }
    let seconds: u64 = passing.iter().map(|test| test.ms).sum::<u64>() / 1000;
    eprintln!("{} tests, {seconds} s one after the other", passing.len());
    Ok(passing)
}

/// What was found before, by the fault's key and the kind of test.
type Known<'k> = BTreeMap<(&'k str, &'k str), Vec<String>>;

/// Runs the faults of these numbers with the tests that reach them. A file keeps what was found, until the product
/// or its tests differ.
fn measure<'f>(
    copy: &Copy,
    faults: &'f [Fault],
    numbers: &[usize],
    tests: &[Test],
    all: bool,
) -> Outcome<Vec<(&'f Fault, Found)>> {
    let name = format!("found-{:016x}{}.tsv", copy.digest, if all { "-all" } else { "" });
    let file = folder().join(name);
    let text = fs::read_to_string(&file).unwrap_or_default();
    let known: Known = text
        .lines()
        .filter_map(|line| {
            let mut fields = line.split('\t');
            let (key, kind) = (fields.next()?, fields.next()?);
            Some(((key, kind), fields.map(str::to_owned).collect()))
        })
        .collect();
    let failed = |cause: std::io::Error| format!("{}: {cause}", file.display());
    let log = fs::File::options().append(true).create(true).open(&file).map_err(failed)?;
    let log = Mutex::new(log);
    let outcomes = shared(numbers.len(), |place, worker| {
        let (number, fault) = (numbers[place], &faults[numbers[place] - 1]);
        let reaching: Vec<&Test> =
            tests.iter().filter(|test| test.reaches.contains(&number)).collect();
        let mut found = Found { is_reached: !reaching.is_empty(), ..Found::default() };
        let key = fault.key().replace(['\n', '\t'], " ");
        for kind in ["unit", "torture"] {
            let is_unit = kind == "unit";
            let (names, is_whole) = if let Some(names) = known.get(&(&*key, kind)) {
                (names.clone(), true)
            } else {
                let of_kind: Vec<&Test> = reaching
                    .iter()
                    .copied()
                    .filter(|test| test.program.is_some() == is_unit)
                    .collect();
                let names = look(copy, (fault, number), &of_kind, all || !is_unit, worker)?;
                // Tests of some crates only say nothing if none of them fails.
                let is_whole = if is_unit {
                    copy.has_all_units || !names.is_empty()
                } else {
                    copy.has_torture
                };
                if let (true, Ok(mut log)) = (is_whole, log.lock()) {
                    let names = [&[key.clone(), kind.to_owned()], &names[..]].concat().join("\t");
                    writeln!(log, "{names}").map_err(failed)?;
                }
                eprintln!("{}: {kind}: {}", fault.name, names.join("; "));
                (names, is_whole)
            };
            found.is_open |= !is_whole;
            *(if is_unit { &mut found.unit } else { &mut found.torture }) = names;
        }
        Ok((fault, found))
    });
    outcomes.into_iter().collect()
}

/// Names of the tests that fail with a fault: all of them, or the first one.
fn look(
    copy: &Copy,
    (fault, number): (&Fault, usize),
    tests: &[&Test],
    all: bool,
    worker: usize,
) -> Outcome<Vec<String>> {
    let mut failing = Vec::new();
    let on = Switch::On(number);
    for batch in batches(copy, tests, &fault.crate_folder) {
        let names = red(copy, &batch, &on, worker)?;
        for test in batch.into_iter().filter(|test| names.contains(&test.name)) {
            // Twice, so that a test that fails by chance does not count.
            if red(copy, &[test], &on, worker)?.is_empty() {
                eprintln!("{}: {} failed once only", fault.name, full_name(copy, test));
                continue;
            }
            failing.push(full_name(copy, test));
            if !all {
                return Ok(failing);
            }
        }
    }
    Ok(failing)
}

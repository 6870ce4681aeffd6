//! `cargo xtask mutants`: plants faults in a copy of the product, and tells which tests see them
//! (`proof/mutants/README.md`).

mod list;
mod copy;
mod programs;
mod score;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::sync::Mutex;

use crate::process::Outcome;
use crate::queue;
use copy::{Copy, folder};
use list::Fault;
use programs::{Switch, Test, batches, full_name, lines, red, trace};
use score::Found;

/// Which faults to plant, and which tests to run.
// One flag of the command line each.
#[allow(clippy::struct_excessive_bools)]
#[derive(clap::Args)]
pub struct Options {
    /// Write proof/mutants/score.csv instead of comparing
    #[arg(long, conflicts_with_all = ["names", "all"])]
    accept: bool,
    /// Run all tests that reach a fault, and tell every one that fails
    #[arg(long)]
    all: bool,
    /// Plant the faults of the second list
    #[arg(long)]
    second: bool,
    /// Run only the unit tests of this crate, or with `torture` the lines of torture
    #[arg(long = "package", value_name = "NAME")]
    packages: Vec<String>,
    /// Run no line of torture
    #[arg(long)]
    no_torture: bool,
    /// Check only that each fault's text stands once in its file, and show the accepted score
    #[arg(long)]
    check_list: bool,
    /// Faults to plant; all if there are none
    #[arg(value_name = "FAULT")]
    names: Vec<String>,
}

impl Options {
    /// A name that no fault has, if there is one. A list that is wrong is for [`run`] to tell.
    pub fn unknown(&self) -> Option<&String> {
        let faults = list::load(self.second).ok()?;
        self.names.iter().find(|name| !faults.iter().any(|fault| fault.name == **name))
    }
}

/// Plants faults. Without `--all`, the tests that the accepted score names come first. The others run only for faults that
/// these do not find: that were found or are new, and with `--accept` any.
///
/// # Errors
/// The lists are wrong, the copy does not build, or a fault is missed that was found before.
pub fn run(options: &Options) -> Outcome {
    let faults = list::load(options.second)?;
    let accepted = score::accepted(options.second);
    if options.check_list {
        println!("{} faults", faults.len());
        let verdict = |fault: &Fault| accepted.get(&fault.name).map_or("", |it| &it.verdict);
        print!("{}", score::by_crate(faults.iter().map(|fault| (fault, verdict(fault)))));
        return Ok(());
    }
    let numbers: Vec<usize> = (1..=faults.len())
        .filter(|number| {
            options.names.is_empty() || options.names.contains(&faults[number - 1].name)
        })
        .collect();
    let copy = copy::build(&faults, &options.packages, !options.no_torture)?;
    let tests = programs::all(&copy)?;
    let mut found = BTreeMap::new();
    if !options.all {
        let is_named = |fault: &Fault, test: &Test| {
            accepted.get(&fault.name).is_some_and(|it| it.tests.contains(&full_name(&copy, test)))
        };
        let chosen = |test: &&Test| numbers.iter().any(|it| is_named(&faults[it - 1], test));
        let named: Vec<Test> = tests.iter().filter(chosen).cloned().collect();
        let named = traced(&copy, &faults, &named)?;
        found = measure(&copy, &faults, &numbers, &named, None, is_named)?;
        found.retain(|number, found| {
            let before = accepted.get(&faults[number - 1].name).map(|it| &*it.verdict);
            let is_searched = options.accept || before.is_none_or(|verdict| verdict == "found");
            !found.is_nothing() || !is_searched
        });
    }
    let open: Vec<usize> = numbers.iter().copied().filter(|it| !found.contains_key(it)).collect();
    if !open.is_empty() {
        let tests = traced(&copy, &faults, &tests)?;
        let name =
            format!("found-{:016x}{}.tsv", copy.digest, if options.all { "-all" } else { "" });
        let log = Log::open(&name)?;
        found.extend(measure(&copy, &faults, &open, &tests, Some((&log, options.all)), |_, _| {
            true
        })?);
    }
    let scored: Vec<(&Fault, Found)> =
        found.into_iter().map(|(number, found)| (&faults[number - 1], found)).collect();
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
    if options.accept {
        return score::accept(&scored, options.second);
    }
    let worse = |(fault, found): &&(&Fault, Found)| {
        let before = accepted.get(&fault.name).is_some_and(|before| before.verdict == "found");
        before && !["found", "open"].contains(&found.verdict(fault))
            || found.verdict(fault).starts_with("found though")
    };
    let worse: Vec<&str> = scored.iter().filter(worse).map(|(fault, _)| &*fault.name).collect();
    if worse.is_empty() {
        Ok(())
    } else {
        Err(format!("found before and not now, or found though equivalent: {}", worse.join(", ")))
    }
}

/// Runs the lines of torture that faults name, or those of these `names` alone: each without a fault, which it must
/// stand, and with each of its faults, of which it must turn red.
///
/// # Errors
/// The copy does not build, a line misses a fault, or it has none.
pub fn self_test(names: &[&str]) -> Outcome {
    let faults = list::load(false)?;
    let copy = copy::build(&faults, &[copy::TORTURE.to_owned()], true)?;
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
        if numbers.is_empty() {
            bad.push(format!("{} has no fault to find", line.name));
        } else {
            cases.push((line, 0));
        }
        cases.extend(numbers.into_iter().map(|number| (line, number)));
    }
    let outcomes = queue::results(&cases, |&(line, number), worker| {
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
    if bad.is_empty() { Ok(()) } else { Err(format!("not as it should be: {}", bad.join("; "))) }
}

/// A file that keeps what was found out, so that a stopped run goes on: a key and its values on each line.
struct Log {
    known: BTreeMap<String, Vec<String>>,
    file: Mutex<File>,
}

impl Log {
    fn open(name: &str) -> Outcome<Self> {
        let path = folder().join(name);
        let text = fs::read_to_string(&path).unwrap_or_default();
        let fields = |line: &str| {
            let mut fields = line.split('\t').map(str::to_owned);
            Some((fields.next()?, fields.collect()))
        };
        let file = File::options().append(true).create(true).open(&path);
        let file = file.map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(Self { known: text.lines().filter_map(fields).collect(), file: Mutex::new(file) })
    }

    /// What is kept under `key`; if nothing is, what `find` finds, which is kept unless it is not the `whole` truth.
    fn get(
        &self,
        key: String,
        find: impl FnOnce() -> Outcome<Vec<String>>,
        whole: impl FnOnce(&[String]) -> bool,
    ) -> Outcome<(Vec<String>, bool)> {
        if let Some(values) = self.known.get(&key) {
            return Ok((values.clone(), true));
        }
        let values = find()?;
        let is_whole = whole(&values);
        if is_whole && let Ok(mut file) = self.file.lock() {
            let line = [&[key], &values[..]].concat().join("\t");
            writeln!(file, "{line}").map_err(|cause| cause.to_string())?;
        }
        Ok((values, is_whole))
    }
}

/// Those of `tests` that pass without a fault, with the faults that each reaches.
fn traced(copy: &Copy, faults: &[Fault], tests: &[Test]) -> Outcome<Vec<Test>> {
    let mut state = DefaultHasher::new();
    (copy.digest, faults.iter().map(Fault::key).collect::<Vec<_>>()).hash(&mut state);
    let log = Log::open(&format!("trace-{:016x}.tsv", state.finish()))?;
    let is_new = |test: &&Test| !log.known.contains_key(&full_name(copy, test));
    eprintln!("tracing {} of {} tests", tests.iter().filter(is_new).count(), tests.len());
    let outcomes = queue::results(tests, |test, worker| {
        let find = || {
            // Twice, as one that fails with a fault.
            let traced = trace(copy, test, worker).or_else(|_| trace(copy, test, worker))?;
            let numbers = traced.reaches.iter().map(usize::to_string);
            Ok([traced.ms.to_string()].into_iter().chain(numbers).collect())
        };
        let (fields, _) = log.get(full_name(copy, test), find, |_| true)?;
        let mut fields = fields.iter().filter_map(|field| field.parse().ok());
        let ms = fields.next().unwrap_or_default();
        let reaches: BTreeSet<usize> = fields.map(|number| number as usize).collect();
        Ok::<_, String>(Test { ms, reaches, ..test.clone() })
    });
    let mut passing = Vec::new();
    for outcome in outcomes {
        match outcome {
            Ok(test) => passing.push(test),
            Err(cause) => eprintln!("left out: {cause}"),
        }
    }
    let seconds: u64 = passing.iter().map(|test| test.ms).sum::<u64>() / 1000;
    eprintln!("{} tests, {seconds} s one after the other", passing.len());
    Ok(passing)
}

/// Runs the faults of these numbers with those of the `tests` that reach them and are wanted. A `log` keeps what was
/// found, until the product or its tests differ; with it comes whether to tell all unit tests that fail.
fn measure(
    copy: &Copy,
    faults: &[Fault],
    numbers: &[usize],
    tests: &[Test],
    log: Option<(&Log, bool)>,
    is_wanted: impl Fn(&Fault, &Test) -> bool + Sync,
) -> Outcome<BTreeMap<usize, Found>> {
    let outcomes = queue::results(numbers, |&number, worker| {
        let fault = &faults[number - 1];
        let reaching: Vec<&Test> = tests
            .iter()
            .filter(|test| test.reaches.contains(&number) && is_wanted(fault, test))
            .collect();
        let mut found = Found { is_reached: !reaching.is_empty(), ..Found::default() };
        for is_unit in [true, false] {
            let of_kind = |test: &&&Test| test.program.is_some() == is_unit;
            let of_kind: Vec<&Test> = reaching.iter().filter(of_kind).copied().collect();
            let all = !is_unit || log.is_some_and(|(_, all)| all);
            let find = || look(copy, (fault, number), &of_kind, all, worker);
            // Tests of some crates only say nothing if none of them fails.
            let whole = |names: &[String]| {
                if is_unit { copy.has_all_units || !names.is_empty() } else { copy.has_torture }
            };
            let kind = if is_unit { "unit" } else { "torture" };
            let (names, is_whole) = if let Some((log, _)) = log {
                let key = format!("{kind} {}", fault.key().replace(['\n', '\t'], " "));
                log.get(key, find, whole)?
            } else {
                find().map(|names| (names, false))?
            };
            eprintln!("{}: {kind}: {}", fault.name, names.join("; "));
            found.is_open |= !is_whole;
            *(if is_unit { &mut found.unit } else { &mut found.torture }) = names;
        }
        Ok((number, found))
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

//! Puts every promise of reliability to the test, and prints one table: promise, cases, share refused, worst found,
//! bound, verdict, and the seed that repeats the worst case.

mod found;
mod effort;
mod tally;
mod tools;

mod promise;
mod promises;
mod bounds;

mod table;

use std::error::Error;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;

use effort::Effort;
use found::Found;
use promise::{Promise, Tested};
use promises::PROMISES;
use tools::Tools;

/// Puts every promise of reliability to the test.
// One flag of the command line each.
#[allow(clippy::struct_excessive_bools)]
#[derive(Debug, Parser)]
#[command(name = "torture", bin_name = "cargo xtask torture")]
struct Arguments {
    /// Promises to test, by the start of their names [default: all]
    #[arg(value_name = "PROMISE")]
    names: Vec<String>,
    /// Time for all promises together; each tests its least number of cases even if that takes longer
    #[arg(long, default_value_t = 20.0, value_name = "N")]
    minutes: f64,
    /// Test the least number of cases only, in at most two minutes
    #[arg(long, conflicts_with = "minutes")]
    short: bool,
    /// Seed of the first case; that of the table repeats the worst case of a promise
    #[arg(long, default_value_t = 1, value_name = "S")]
    seed: u64,
    /// Write the worst of ten runs into bounds.csv instead of judging: of the promises whose bounds are there
    #[arg(long)]
    accept: bool,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// List the promises
    #[arg(long)]
    list: bool,
    /// Program of host-sim
    #[arg(long, value_name = "FILE", hide = true)]
    program: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(cause) => {
            eprintln!("error: {cause}");
            ExitCode::from(2)
        }
    }
}

/// Whether everything is as it should be.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let chosen = choose(&arguments.names)?;
    if !(0.0..=1e6).contains(&arguments.minutes) {
        let given = arguments.minutes;
        return Err(format!("--minutes is {given}, but must be from 0 to a million").into());
    }
    if arguments.list {
        chosen.iter().for_each(|promise| println!("{:<24}{}", promise.name, promise.text));
        return Ok(true);
    }
    let tools = Tools { program: arguments.program.clone() };
    if arguments.accept {
        let measured = chosen.into_iter().filter(|promise| bounds::is_measured(promise.name));
        accept(arguments, &measured.collect::<Vec<_>>(), &tools)?;
        return Ok(true);
    }
    let entries = test(arguments, &chosen, &tools, (arguments.seed, arguments.given_s()));
    if arguments.json {
        println!("{}", table::json(&entries)?);
    } else {
        print!("{}", table::text(&entries, &arguments.deciding()));
    }
    Ok(entries.iter().all(Tested::is_kept))
}

/// Tests promises, one after the other, from a seed on and for so many seconds.
fn test(
    arguments: &Arguments,
    chosen: &[&'static Promise],
    tools: &Tools,
    (seed, given_s): (u64, f64),
) -> Vec<Tested> {
    let shares: f64 = chosen.iter().map(|promise| f64::from(promise.share)).sum::<f64>().max(1.0);
    let is_shown = io::stderr().is_terminal() && !arguments.json;
    let mut entries = Vec::new();
    for promise in chosen {
        if is_shown {
            eprint!("\r{}: {} …\x1b[K", promise.name, promise.text);
        }
        let time = Duration::from_secs_f64(given_s * f64::from(promise.share) / shares);
        let start = Instant::now();
        let outcome = (promise.check)(&Effort::new(seed, time), tools);
        let outcome =
            outcome.map(|found| Found { bound: bounds::bound(promise.name, found.bound), ..found });
        entries.push(Tested { promise, outcome, time: start.elapsed() });
    }
    if is_shown {
        eprint!("\r\x1b[K");
    }
    entries
}

/// Writes the worst of several runs of each promise, from seeds far apart.
fn accept(
    arguments: &Arguments,
    measured: &[&'static Promise],
    tools: &Tools,
) -> Result<(), Box<dyn Error>> {
    let mut worst: Vec<(&str, f64)> = measured.iter().map(|promise| (promise.name, 0.0)).collect();
    for run in 0..bounds::RUNS {
        let seed = arguments.seed.wrapping_add(run * 1_000_000_000);
        let given_s = arguments.given_s() / bounds::RUNS as f64;
        for (entry, (name, worst)) in
            test(arguments, measured, tools, (seed, given_s)).into_iter().zip(&mut worst)
        {
            let found = entry.outcome?;
            if !found.worst.is_finite() {
                return Err(format!("{name}, seed {}: {}", found.seed, found.note).into());
            }
            println!("{name:<20}{:.3e} {}", found.worst, found.unit);
            *worst = worst.max(found.worst);
        }
    }
    // A line in which nothing was off keeps what it has.
    worst.retain(|(_, worst)| *worst > 0.0);
    Ok(bounds::accept(&worst)?)
}

impl Arguments {
    /// Time for more than the least number of cases, in s.
    fn given_s(&self) -> f64 {
        if self.short { 0.0 } else { self.minutes * 60.0 }
    }

    /// Options that decide what a case does: some do more in a run that has time.
    fn deciding(&self) -> String {
        if self.short { "--short".to_owned() } else { format!("--minutes {}", self.minutes) }
    }
}

/// The promises whose names start with one of `names`, or all.
fn choose(names: &[String]) -> Result<Vec<&'static Promise>, String> {
    let has = |promise: &&Promise, name: &String| promise.name.starts_with(name.as_str());
    if let Some(unknown) = names.iter().find(|name| !PROMISES.iter().any(|one| has(&one, name))) {
        return Err(format!("no promise is called `{unknown}`; --list shows all"));
    }
    let chosen = PROMISES.iter();
    Ok(chosen.filter(|one| names.is_empty() || names.iter().any(|name| has(one, name))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_with_time_is_repeated_with_time() {
        let of =
            |options: &[&str]| Arguments::parse_from([&["torture"], options].concat()).deciding();
        assert_eq!(of(&["--minutes", "2.5", "rls"]), "--minutes 2.5");
        assert_eq!(of(&[]), "--minutes 20");
        assert_eq!(of(&["--short"]), "--short");
    }

    #[test]
    fn wrong_options_are_refused_before_a_list() {
        let list = |option| run(&Arguments::parse_from(["torture", "--list", option]));
        let refused = |option| list(option).unwrap_err().to_string();
        assert_eq!(refused("exp-nosuch"), "no promise is called `exp-nosuch`; --list shows all");
        assert_eq!(refused("--minutes=-3"), "--minutes is -3, but must be from 0 to a million");
        assert!(list("exp-polynomial").unwrap());
    }
}

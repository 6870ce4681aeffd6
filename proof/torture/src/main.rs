//! Puts every promise of reliability to the test, and prints one table: promise, cases, worst found, bound, verdict,
//! and the seed that repeats the worst case.

mod found;
mod effort;
mod tally;
mod tools;
mod scratch;

mod promise;
mod promises;

mod table;

use std::error::Error;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;

use effort::Effort;
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
    /// Plant a fault under every promise: each must be found broken
    #[arg(long)]
    self_test: bool,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// List the promises
    #[arg(long)]
    list: bool,
    /// Program of host-sim
    #[arg(long, value_name = "FILE", hide = true)]
    program: Option<PathBuf>,
    /// Folder of the emulator's images
    #[arg(long, value_name = "FOLDER", hide = true)]
    images: Option<PathBuf>,
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
    let tools = Tools { program: arguments.program.clone(), images: arguments.images.clone() };
    let shares: f64 = chosen.iter().map(|promise| f64::from(promise.share)).sum::<f64>().max(1.0);
    let given_s =
        if arguments.short || arguments.self_test { 0.0 } else { arguments.minutes * 60.0 };
    let mut entries = Vec::new();
    for promise in chosen {
        if io::stderr().is_terminal() {
            eprint!("\r{}: {} …\x1b[K", promise.name, promise.text);
        }
        let time = Duration::from_secs_f64(given_s * f64::from(promise.share) / shares);
        let effort = Effort::new(arguments.seed, time, arguments.self_test);
        let start = Instant::now();
        let outcome = (promise.check)(&effort, &tools);
        entries.push(Tested { promise, outcome, time: start.elapsed() });
    }
    if io::stderr().is_terminal() {
        eprint!("\r\x1b[K");
    }
    if arguments.json {
        println!("{}", table::json(&entries, arguments.self_test)?);
    } else {
        print!("{}", table::text(&entries, arguments.self_test, &deciding(arguments)));
    }
    Ok(entries.iter().all(|entry| entry.is_as_it_should_be(arguments.self_test)))
}

/// Options that decide what a case does: some do more in a run that has time.
fn deciding(arguments: &Arguments) -> String {
    match arguments {
        Arguments { self_test: true, .. } => "--self-test".to_owned(),
        Arguments { short: true, .. } => "--short".to_owned(),
        Arguments { minutes, .. } => format!("--minutes {minutes}"),
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
            |options: &[&str]| deciding(&Arguments::parse_from([&["torture"], options].concat()));
        assert_eq!(of(&["--minutes", "2.5", "rls"]), "--minutes 2.5");
        assert_eq!(of(&[]), "--minutes 20");
        assert_eq!(of(&["--short"]), "--short");
        assert_eq!(of(&["--self-test", "--short"]), "--self-test");
    }

    #[test]
    fn wrong_options_are_refused_before_a_list() {
        let list = |option| run(&Arguments::parse_from(["torture", "--list", option]));
        let refused = |option| list(option).unwrap_err().to_string();
        assert_eq!(refused("exp-nosuch"), "no promise is called `exp-nosuch`; --list shows all");
        assert_eq!(refused("--minutes=-3"), "--minutes is -3, but must be from 0 to a million");
        assert!(list("exp-libm").unwrap());
    }
}

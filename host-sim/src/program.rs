//! The program: its command line, and every command by its name.

use std::ffi::OsString;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, CommandFactory, FromArgMatches, Parser, Subcommand};
use taxel_data::DataFile;

use crate::Result;
use crate::commands::print::Outcome;
use crate::commands::{
    self, Caller, Common, compare, decode, emulate, eval, export, forward, inspect, limit, link,
    run, sweep, synth, table1, trade, train, view,
};

/// Simulate, train and evaluate resistive tactile sensors; write weight blobs for the device.
///
/// Without a command: `run press`. Results go to stdout, progress and remarks to stderr. Exit status: 0
/// done, 1 failed, 2 bad usage or input, 130 interrupted by Ctrl-C, 143 by SIGTERM.
///
/// Files are written whole or not at all: after an error or an interruption, old files are unchanged and no new ones
/// are left. `-o -` writes to stdout; results then go to stderr. Links are followed, and read-only files are refused.
#[derive(Parser)]
#[command(name = "taxel", version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    common: Common,
}

#[derive(Subcommand)]
enum Command {
    Run(run::Arguments),
    Synth(synth::Arguments),
    Forward(forward::Arguments),
    Train(train::Arguments),
    Decode(decode::Arguments),
    Eval(eval::Arguments),
    Inspect(inspect::Arguments),
    Export(export::Arguments),
    Table1(table1::Arguments),
    Trade(trade::Arguments),
    Limit(limit::Arguments),
    Compare(compare::Arguments),
    Sweep(sweep::Arguments),
    Emulate(emulate::Arguments),
    Link(link::Arguments),
    View(view::Arguments),
    /// Print a script that completes commands and options in a shell.
    ///
    /// bash: `taxel completions bash > ~/.local/share/bash-completion/completions/taxel`.
    Completions {
        shell: clap_complete::Shell,
    },
}

impl Command {
    /// Name of the command, as it is typed; with the action of `link`.
    fn name(&self) -> String {
        let name = match self {
            Self::Link(arguments) => return format!("link {}", arguments.action_name()),
            Self::Run(_) => "run",
            Self::Synth(_) => "synth",
            Self::Forward(_) => "forward",
            Self::Train(_) => "train",
            Self::Decode(_) => "decode",
            Self::Eval(_) => "eval",
            Self::Inspect(_) => "inspect",
            Self::Export(_) => "export",
            Self::Table1(_) => "table1",
            Self::Trade(_) => "trade",
            Self::Limit(_) => "limit",
            Self::Compare(_) => "compare",
            Self::Sweep(_) => "sweep",
            Self::Emulate(_) => "emulate",
            Self::View(_) => "view",
            Self::Completions { .. } => "completions",
        };
        name.into()
    }
}

/// Runs the command line with these arguments, of which the first is the program's name, and returns its exit status.
pub fn main_from<A: Into<OsString> + Clone>(arguments: impl IntoIterator<Item = A>) -> u8 {
    let cli = parsed(arguments).unwrap_or_else(|error| error.exit());
    commands::run_to_end(|| execute(cli, None).0)
}

/// What a command told that was called in this process.
pub struct Called {
    /// Its result, as `--json` prints it.
    pub json: String,
    /// Notes and warnings, one each.
    pub remarks: Vec<String>,
}

/// Calls a command with these arguments (without the program's name), and returns its result as JSON. It reads these
/// `tables` where an argument is their path, and unwinds with [`commands::Stopped`] soon after `stop` is set.
///
/// # Errors
/// As the program has them, with its message and its exit status.
pub fn call(
    arguments: &[String],
    tables: Vec<DataFile>,
    stop: &Arc<AtomicBool>,
) -> std::result::Result<Called, (String, u8)> {
    let all = ["taxel", "--json"].into_iter().chain(arguments.iter().map(String::as_str));
    let cli = parsed(all).map_err(|error| (error.to_string().trim_end().to_owned(), 2))?;
    let caller = Caller { tables, stop: Arc::clone(stop), remarks: Mutex::default() };
    let (outcome, common) = execute(cli, Some(caller));
    let remarks = common.caller.map_or(vec![], Caller::into_remarks);
    match outcome {
        Ok(Outcome { text: json, failure: None }) => Ok(Called { json, remarks }),
        Ok(Outcome { failure: Some(error), .. }) | Err(error) => {
            Err((commands::message(&error), commands::exit_status(&error)))
        }
    }
}

/// Command line that is read from its words; a negative number is a value of the option before it, and not an option.
fn parsed<A: Into<OsString> + Clone>(
    words: impl IntoIterator<Item = A>,
) -> std::result::Result<Cli, clap::Error> {
    let matches = with_negative_numbers(Cli::command()).try_get_matches_from(words);
    matches.and_then(|matches| Cli::from_arg_matches(&matches)).map_err(advised)
}

fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes = |option: Arg| {
        let has_value = option.get_long().is_some()
            && option.get_action().takes_values()
            && option.get_num_args().is_none_or(|count| count.takes_values());
        option.allow_negative_numbers(has_value)
    };
    command.mut_args(takes).mut_subcommands(with_negative_numbers)
}

/// A usage error with advice, where an option was taken for one with a similar name.
fn advised(mut error: clap::Error) -> clap::Error {
    let of_output = matches!(
        error.get(ContextKind::InvalidArg),
        Some(ContextValue::String(argument)) if argument.starts_with("--output ")
    );
    if error.kind() == ErrorKind::ArgumentConflict && of_output {
        let tip = "columns that a model is to predict are given by '--outputs <GLOB>'";
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}

/// Does what a command line says, for a `caller` in this process or for who typed it.
fn execute(cli: Cli, caller: Option<Caller>) -> (Result<Outcome>, Common) {
    let command = cli.command.unwrap_or_else(|| Command::Run(run::Arguments::default()));
    let begun = Some((command.name(), Instant::now()));
    let common = Common { begun, caller, ..cli.common };
    (outcome_of(command, &common), common)
}

fn outcome_of(command: Command, common: &Common) -> Result<Outcome> {
    match command {
        Command::Run(arguments) => run::execute(&arguments, common),
        Command::Synth(arguments) => synth::execute(&arguments, common),
        Command::Forward(arguments) => forward::execute(&arguments, common),
        Command::Train(arguments) => train::execute(&arguments, common),
        Command::Decode(arguments) => decode::execute(&arguments, common),
        Command::Eval(arguments) => eval::execute(&arguments, common),
        Command::Inspect(arguments) => inspect::execute(&arguments, common),
        Command::Export(arguments) => export::execute(&arguments, common),
        Command::Table1(arguments) => table1::execute(&arguments, common),
        Command::Trade(arguments) => trade::execute(&arguments, common),
        Command::Limit(arguments) => limit::execute(&arguments, common),
        Command::Compare(arguments) => compare::execute(&arguments, common),
        Command::Sweep(arguments) => sweep::execute(&arguments, common),
        Command::Emulate(arguments) => emulate::execute(&arguments, common),
        Command::Link(arguments) => link::execute(&arguments, common),
        Command::View(arguments) => view::execute(&arguments, common),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "taxel", &mut script);
            Ok(Outcome::of(String::from_utf8_lossy(&script).into_owned()))
        }
    }
}

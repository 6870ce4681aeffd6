//! `host-sim`: from a scene or a CSV file to a trained, checked weight blob.

/// Prints to stderr as the standard macro does, with control characters escaped. It never panics: a log on a full disk
/// must not end the work.
macro_rules! eprintln {
    ($($text:tt)*) => {{
        let text = format!("{}\n", format_args!($($text)*));
        let text = taxel_data::error::printable(&text);
        let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
    }};
}

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use host_sim::{Error, Result};

mod commands;

use commands::{
    Common, confidence, decode, drift, emulate, eval, export, forward, gate, inspect, join, limit,
    link, readout, run, study, synth, table1, trade, train,
};

/// Simulate, train and evaluate resistive tactile sensors; write weight blobs for the device.
///
/// Without a command: `run press`. Results go to stdout, progress and remarks to stderr. Exit status: 0
/// done, 1 failed, 2 bad usage or input, 130 interrupted by Ctrl-C, 143 by SIGTERM.
///
/// Files appear whole or not at all: after an error or an interruption the old ones are there, and nothing else. `-o -`
/// writes to stdout, and results then go to stderr. A link is followed, a read-only file is refused.
#[derive(Parser)]
#[command(version)]
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
    Join(join::Arguments),
    Decode(decode::Arguments),
    Eval(eval::Arguments),
    Inspect(inspect::Arguments),
    Export(export::Arguments),
    Table1(table1::Arguments),
    Trade(trade::Arguments),
    Readout(readout::Arguments),
    Gate(gate::Arguments),
    Drift(drift::Arguments),
    Limit(limit::Arguments),
    Confidence(confidence::Arguments),
    Study(study::Arguments),
    Emulate(emulate::Arguments),
    Link(link::Arguments),
}

impl Command {
    /// Name of the command, as it is typed; with the action of `link` or the question of `study`.
    fn name(&self) -> String {
        let name = match self {
            Self::Link(arguments) => return format!("link {}", arguments.action_name()),
            Self::Study(arguments) => return format!("study {}", arguments.study_name()),
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
            Self::Readout(_) => "readout",
            Self::Gate(_) => "gate",
            Self::Drift(_) => "drift",
            Self::Limit(_) => "limit",
            Self::Confidence(_) => "confidence",
            Self::Emulate(_) => "emulate",
            Self::Join(_) => "join",
        };
        name.into()
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let command = cli.command.unwrap_or_else(|| Command::Run(run::Arguments::default()));
    commands::begin(&command.name());
    let outcome = commands::watch_signals()
        .map_err(|cause| Error::Failed(format!("cannot watch for Ctrl-C: {cause}")))
        .and_then(|()| execute(command, &cli.common));
    report(outcome)
}

fn execute(command: Command, common: &Common) -> Result<()> {
    match command {
        Command::Run(arguments) => run::execute(&arguments, common),
        Command::Synth(arguments) => synth::execute(&arguments, common),
        Command::Forward(arguments) => forward::execute(&arguments, common),
        Command::Train(arguments) => train::execute(&arguments, common),
        Command::Join(arguments) => join::execute(&arguments, common),
        Command::Decode(arguments) => decode::execute(&arguments, common),
        Command::Eval(arguments) => eval::execute(&arguments, common),
        Command::Inspect(arguments) => inspect::execute(&arguments, common),
        Command::Export(arguments) => export::execute(&arguments, common),
        Command::Table1(arguments) => table1::execute(&arguments, common),
        Command::Trade(arguments) => trade::execute(&arguments, common),
        Command::Readout(arguments) => readout::execute(&arguments, common),
        Command::Gate(arguments) => gate::execute(&arguments, common),
        Command::Drift(arguments) => drift::execute(&arguments, common),
        Command::Limit(arguments) => limit::execute(&arguments, common),
        Command::Confidence(arguments) => confidence::execute(&arguments, common),
        Command::Study(arguments) => study::execute(&arguments, common),
        Command::Emulate(arguments) => emulate::execute(&arguments, common),
        Command::Link(arguments) => link::execute(&arguments, common),
    }
}

fn report(outcome: Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}{}", commands::advice(&error));
            if matches!(error, Error::Rig(taxel_rig::Error::Interrupted)) {
                commands::end_interrupted();
            }
            ExitCode::from(exit_status(&error))
        }
    }
}

/// Exit status of an error: 1 for work that failed, 2 for bad usage or input.
fn exit_status(error: &Error) -> u8 {
    use taxel_learn::Error as Learn;
    use taxel_rig::Error as Rig;
    match error {
        Error::Failed(_)
        | Error::Learn(Learn::NoRegression | Learn::ProjectionBeyondF32 | Learn::NotPacked(_)) => 1,
        Error::Simulate(cause) => match cause {
            taxel_simulate::Error::Setting(_) | taxel_simulate::Error::Data(_) => 2,
            _ => 1,
        },
        Error::Rig(cause) => match cause {
            Rig::Port { .. }
            | Rig::NoRoom { .. }
            | Rig::OtherReadout { .. }
            | Rig::NoQemu { .. }
            | Rig::NoImage { .. }
            | Rig::NotElf { .. }
            | Rig::Setting(_)
            | Rig::File(_) => 2,
            _ => 1,
        },
        _ => 2,
    }
}

//! Subcommands, one small file each: arguments in, library calls, results out.

mod stdout;
pub mod print;
pub mod progress;
pub mod arguments;
mod model_argument;
mod command_line;
mod model_outputs;
pub mod scene_argument;
pub mod coverage_page;
mod data_notes;
mod refused_readings;
mod data_file;
mod readings;
mod health;
mod data_argument;
mod data_stream;
mod subject_argument;
mod check_arguments;
mod interruption;

pub mod run;
pub mod synth;
pub mod forward;
pub mod train;
pub mod decode;
pub mod eval;
pub mod inspect;
pub mod export;
pub mod join;
pub mod table1;
pub mod trade;
pub mod gate;
pub mod limit;
pub mod emulate;
pub mod link;

use std::process::ExitCode;

use crate::{Error, Result};

/// Options of every command.
#[derive(clap::Args)]
pub struct Common {
    /// Seed of every random draw, instead of the scene's or 1 (no effect where nothing is drawn).
    #[arg(long, global = true)]
    pub seed: Option<u64>,
    /// Print the results as JSON.
    #[arg(long, global = true)]
    pub json: bool,
}

/// Runs the `work` of the command of this `name`, prints its error, and returns the program's exit status.
pub fn run_to_end(name: &str, work: impl FnOnce() -> Result<()>) -> ExitCode {
    print::begin(name);
    let outcome = interruption::watch()
        .map_err(|cause| Error::Failed(format!("cannot watch for Ctrl-C: {cause}")))
        .and_then(|()| work());
    let Err(error) = outcome else { return ExitCode::SUCCESS };
    eprintln!("error: {error}{}", advice(&error));
    if matches!(error, Error::Rig(taxel_rig::Error::Interrupted)) {
        interruption::end();
    }
    ExitCode::from(exit_status(&error))
}

/// Advice on options for an error that a library reported without knowing them.
fn advice(error: &Error) -> &'static str {
    use taxel_data::Error as Data;
    use taxel_data::error::Problem;
    match error {
        Error::Learn(taxel_learn::Error::OneRow { .. }) => " (--whole-array)",
        Error::Learn(taxel_learn::Error::NoFill(_)) => " (leave --fill or training.fill out)",
        Error::Setting(bad) | Error::Learn(taxel_learn::Error::Setting(bad))
            if bad.field == "folds" =>
        {
            " (--folds or --fold-column, --no-refine)"
        }
        Error::Setting(bad) | Error::Learn(taxel_learn::Error::Setting(bad))
            if bad.field == "memory" =>
        {
            " (--centres, --no-affine, --most-memory)"
        }
        Error::Data(Data::Write { .. } | Data::WrittenOverInput { .. }) => " (-o)",
        Error::Data(Data::File { problem: Problem::NoPartner { .. }, .. }) => {
            " (--tolerance, --lag, --on)"
        }
        Error::Data(Data::File {
            problem: Problem::ClockSetBack { .. } | Problem::NoTimeStamp { .. },
            ..
        }) => " (--on)",
        Error::Rig(taxel_rig::Error::NoQemu { .. } | taxel_rig::Error::NoStart { .. }) => {
            " (--qemu)"
        }
        Error::Rig(taxel_rig::Error::NoImage { .. } | taxel_rig::Error::NotElf { .. }) => {
            " (--image)"
        }
        Error::Rig(taxel_rig::Error::Port { .. }) => " (PORT)",
        _ => "",
    }
}

/// Exit status of an error: 1 for work that failed, 2 for bad usage or input.
fn exit_status(error: &Error) -> u8 {
    use taxel_learn::Error as Learn;
    use taxel_rig::Error as Rig;
    match error {
        Error::Failed(_)
        | Error::Learn(
            Learn::NoRegression
            | Learn::ProjectionBeyondF32
            | Learn::NotExcited { .. }
            | Learn::NotBetter
            | Learn::NotPacked(_),
        ) => 1,
        Error::Simulate(cause) => match cause {
            taxel_simulate::Error::Setting(_) | taxel_simulate::Error::Data(_) => 2,
            taxel_simulate::Error::Board { .. } => 1,
        },
        Error::Rig(cause) => match cause {
            Rig::Port { .. }
            | Rig::NoRoom { .. }
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

//! Subcommands, one small file each: arguments in, library calls, results out.

mod stdout;
mod print;
mod progress;
mod arguments;
mod model_argument;
mod command_line;
mod model_outputs;
mod scene_argument;
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
pub mod confidence;
pub mod eval;
pub mod inspect;
pub mod export;
pub mod join;
pub mod table1;
pub mod trade;
pub mod readout;
pub mod gate;
pub mod drift;
pub mod limit;
pub mod emulate;
pub mod link;
pub mod study;

use host_sim::Error;

pub use interruption::{end as end_interrupted, watch as watch_signals};
pub use print::begin;

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

/// Advice on options for an error that a library reported without knowing them.
pub fn advice(error: &Error) -> &'static str {
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
        Error::Rig(taxel_rig::Error::OtherReadout { .. }) => " (--scans)",
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

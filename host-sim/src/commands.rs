//! Subcommands, one small file each: arguments in, library calls, results out.

mod common;
mod stdout;
pub mod print;
pub mod progress;
pub mod arguments;
mod device_arguments;
mod format_note;
mod decoder_arguments;
mod command_line;
mod model_outputs;
pub mod scene_argument;
mod data_notes;
mod refused_readings;
mod recordings;
mod data_file;
mod mat_cells;
mod readings;
mod rest_argument;
mod filter_arguments;
mod health;
mod data_argument;
mod subject_argument;
mod device_lines;
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
pub mod table1;
pub mod trade;
pub mod limit;
mod merged;
pub mod sweep;
pub mod compare;
pub mod emulate;
pub mod link;
pub mod view;

pub use common::{Caller, Common};
pub use progress::Stopped;

use taxel_firmware::link::message::Refusal;

use crate::{Error, Result};
use print::Outcome;

/// Does the `work` of a command, prints what it found and its error, and returns the program's exit status.
pub fn run_to_end(work: impl FnOnce() -> Result<Outcome>) -> u8 {
    let outcome = interruption::watch()
        .map_err(|cause| Error::failed(format!("cannot watch for Ctrl-C: {cause}")))
        .and_then(|()| work())
        .and_then(Outcome::print);
    let Err(error) = outcome else { return 0 };
    eprintln!("error: {}", message(&error));
    if matches!(error, Error::Rig(taxel_rig::Error::Interrupted)) {
        interruption::end();
    }
    exit_status(&error)
}

/// Message of an error, with advice on options.
pub fn message(error: &Error) -> String {
    format!("{error}{}", advice(error))
}

/// Advice on options for an error that a library reported without knowing them.
fn advice(error: &Error) -> &'static str {
    use taxel_data::Error as Data;
    let of_field = |field: &str| match field {
        "folds" => " (--folds or --fold-column, --no-refine)",
        "memory" => " (--centres)",
        "image" => " (--image)",
        "port" => " (PORT)",
        _ => "",
    };
    let Error::Data(error) = error else { return "" };
    match error {
        Data::Setting(bad) => of_field(&bad.field),
        Data::Unfit { field, .. } => of_field(field),
        Data::Write { .. } | Data::WrittenOverInput { .. } => " (-o)",
        _ => "",
    }
}

/// Exit status of an error: 1 for work that failed, 2 for bad usage or input.
pub fn exit_status(error: &Error) -> u8 {
    match error {
        // A model and a configuration are inputs too.
        Error::Rig(taxel_rig::Error::Refused(Refusal::BadModel(_) | Refusal::Configuration(_))) => {
            2
        }
        Error::Rig(_) | Error::Data(taxel_data::Error::Failed(_)) => 1,
        _ => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_option_to_change_whichever_crate_found_it() {
        let errors = || {
            [
                taxel_data::BadValue::new("memory", 1, "give more").into(),
                taxel_data::Error::unfit_for("memory", "too little"),
            ]
        };
        let of_rig = errors().map(|error| Error::from(taxel_rig::Error::from(error)));
        for error in of_rig.into_iter().chain(errors().map(Error::Data)) {
            assert_eq!(advice(&error), " (--centres)", "{error}");
            assert_eq!(exit_status(&error), 2, "{error}");
        }
    }
}

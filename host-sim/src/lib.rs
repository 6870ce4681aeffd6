//! Library of the program: what [`taxel_evaluate`] computes, its pages, and the commands.

// What a command's options mean is said where users read it: `--help`.
#![allow(missing_docs, clippy::missing_errors_doc, clippy::new_without_default)]

/// Prints to stderr as the standard macro does, with control characters escaped. It never panics: a log on a full disk
/// must not end the work.
macro_rules! eprintln {
    ($($text:tt)*) => {{
        let text = format!("{}\n", format_args!($($text)*));
        let text = taxel_data::error::printable(&text);
        let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
    }};
}

pub mod report;
pub mod live;
pub mod commands;
pub mod program;

pub use taxel_evaluate::{
    Error, Result, by_load, device, error, evaluate, experiment, measurements, metrics, others,
    over_time, run, select, subject, sweep, trade, training_options, training_set, verdict, worth,
};

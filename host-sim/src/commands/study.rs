//! Command `study`: one question each, put to the test by computing.

use clap::{Args, Subcommand};
use host_sim::Result;

use super::Common;

mod widths;
mod map;

/// Put one question to the test: what a setting is worth, or whether a claim of the paper holds.
#[derive(Args)]
#[command(after_help = "Example: host-sim study map paper -o map.svg")]
pub struct Arguments {
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand)]
enum Study {
    Widths(widths::Arguments),
    Map(map::Arguments),
}

impl Arguments {
    /// Name of the study, as it is typed.
    pub fn study_name(&self) -> &'static str {
        match self.study {
            Study::Widths(_) => "widths",
            Study::Map(_) => "map",
        }
    }
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    match &arguments.study {
        Study::Widths(arguments) => widths::execute(arguments, common),
        Study::Map(arguments) => map::execute(arguments, common),
    }
}

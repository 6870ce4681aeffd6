//! Command `study`: answers to one question each.

use clap::{Args, Subcommand};
use host_sim::Result;

use super::Common;

mod recursion;

/// Study one question, as a table and a picture.
#[derive(Args)]
#[command(after_help = "Example: host-sim study recursion -o recursion.svg")]
pub struct Arguments {
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand)]
enum Study {
    Recursion(recursion::Arguments),
}

impl Arguments {
    /// Name of the study, as it is typed.
    pub fn study_name(&self) -> &'static str {
        match self.study {
            Study::Recursion(_) => "recursion",
        }
    }
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    match &arguments.study {
        Study::Recursion(arguments) => recursion::execute(arguments, common),
    }
}

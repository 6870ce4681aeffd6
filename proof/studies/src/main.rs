//! Studies of one question each, about the sensor, the paper's method, or a part of the product: a table, JSON, a picture.

// Fields of results carry the names that JSON has.
#![expect(clippy::struct_field_names)]

use std::process::ExitCode;

use clap::Parser;
use host_sim::commands::{self, Common};

mod anomaly;
mod equations;
mod reconstruct;
mod level;
mod question;
mod picture;
mod command;

/// Answer one question about the sensor, the paper's method or a part of Taxel, with a table and a picture.
#[derive(Parser)]
#[command(bin_name = "cargo xtask study")]
struct Cli {
    #[command(subcommand)]
    question: command::Question,
    #[command(flatten)]
    common: Common,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    commands::run_to_end(cli.question.name(), &cli.common, || cli.question.answer(&cli.common))
        .into()
}

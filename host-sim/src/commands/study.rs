//! Command `study`: studies of one question each.

use clap::{Args, Subcommand};
use host_sim::Result;
use host_sim::metrics::LimitSummary;

use super::Common;
use super::print::{self, Page};

mod directions;
mod equations;
mod widths;
mod map;
mod recursion;

/// Answer one question about the sensor or the paper's method, with a table and a picture.
#[derive(Args)]
#[command(after_help = "Example: host-sim study equations paper -o equations.svg")]
pub struct Arguments {
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand)]
enum Study {
    Equations(equations::Arguments),
    Directions(directions::Arguments),
    Widths(widths::Arguments),
    Map(map::Arguments),
    Recursion(recursion::Arguments),
}

impl Arguments {
    /// Name of the study, as it is typed.
    pub fn study_name(&self) -> &'static str {
        match self.study {
            Study::Equations(_) => "equations",
            Study::Directions(_) => "directions",
            Study::Widths(_) => "widths",
            Study::Map(_) => "map",
            Study::Recursion(_) => "recursion",
        }
    }
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    match &arguments.study {
        Study::Equations(arguments) => equations::execute(arguments, common),
        Study::Directions(arguments) => directions::execute(arguments, common),
        Study::Widths(arguments) => widths::execute(arguments, common),
        Study::Map(arguments) => map::execute(arguments, common),
        Study::Recursion(arguments) => recursion::execute(arguments, common),
    }
}

/// Headings of columns, one a noise level.
fn noise_columns(levels: impl Iterator<Item = f64>) -> String {
    let columns: Vec<String> =
        levels.map(|level| format!("{:>10}", print::percent(level))).collect();
    columns.concat()
}

/// Line of a table of errors.
fn line(name: &str, values: impl Iterator<Item = Option<f64>>) -> String {
    let cell = |value: Option<f64>| match value {
        None => format!("{:>10}", "-"),
        Some(value) if value == 0.0 || (1e-3..1e5).contains(&value) => format!("{value:>10.4}"),
        Some(value) => format!("{value:>10.1e}"),
    };
    format!("{name:<18}{}", values.map(cell).collect::<String>())
}

/// Limit of group number `place`, if there is one.
fn limit_of(limit: &LimitSummary, place: usize) -> Option<f64> {
    limit.groups.get(place).map(|group| group.limit)
}

/// Adds what the limit is of, and the reasons why there is none.
fn refusals<'l>(page: &mut Page, limits: impl Iterator<Item = (f64, &'l LimitSummary)>) {
    page.line("limit: of a decoder that sees all readings of a frame, on the first test frames, at most 40.");
    for (level, limit) in limits {
        if let Some(refused) = &limit.refused {
            print::wrapped(
                page,
                &format!("no limit at noise {}: {refused}", print::percent(level)),
            );
        }
    }
}

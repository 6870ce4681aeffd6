//! The studies' options and pages, a file each.

use clap::Subcommand;
use host_sim::Result;
use host_sim::commands::Common;
use host_sim::commands::print::{self, Page};
use host_sim::metrics::LimitSummary;

mod directions;
mod equations;
mod widths;
mod map;
mod recursion;
mod drift;
mod readout;
mod confidence;

/// What is studied.
#[derive(Subcommand)]
pub enum Question {
    Equations(equations::Arguments),
    Directions(directions::Arguments),
    Widths(widths::Arguments),
    Map(map::Arguments),
    Recursion(recursion::Arguments),
    Drift(drift::Arguments),
    Readout(readout::Arguments),
    Confidence(confidence::Arguments),
}

impl Question {
    /// Name of the study in JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Equations(_) => "study equations",
            Self::Directions(_) => "study directions",
            Self::Widths(_) => "study widths",
            Self::Map(_) => "study map",
            Self::Recursion(_) => "study recursion",
            Self::Drift(_) => "drift",
            Self::Readout(_) => "readout",
            Self::Confidence(_) => "confidence",
        }
    }

    /// Computes and prints the answer.
    pub fn answer(&self, common: &Common) -> Result<()> {
        match self {
            Self::Equations(arguments) => equations::execute(arguments, common),
            Self::Directions(arguments) => directions::execute(arguments, common),
            Self::Widths(arguments) => widths::execute(arguments, common),
            Self::Map(arguments) => map::execute(arguments, common),
            Self::Recursion(arguments) => recursion::execute(arguments, common),
            Self::Drift(arguments) => drift::execute(arguments, common),
            Self::Readout(arguments) => readout::execute(arguments, common),
            Self::Confidence(arguments) => confidence::execute(arguments, common),
        }
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

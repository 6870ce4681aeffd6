//! The studies' options and pages, a file each.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use host_sim::Result;
use host_sim::commands::Common;
use host_sim::commands::print::{self, Page};
use host_sim::metrics;
use serde::Serialize;
use taxel_data::output;

use crate::level::AtNoise;
use crate::reconstruct;

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
    Reconstruct(reconstruct::Arguments),
}

/// Options of a study, and what it does with them.
trait Study {
    /// Computes and prints the answer.
    fn answer(&self, common: &Common) -> Result<()>;
}

impl Study for reconstruct::Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        reconstruct::answer(self, common)
    }
}

impl Question {
    /// Name of the study in JSON, and its options.
    fn study(&self) -> (&'static str, &dyn Study) {
        match self {
            Self::Equations(study) => ("study equations", study),
            Self::Directions(study) => ("study directions", study),
            Self::Widths(study) => ("study widths", study),
            Self::Map(study) => ("study map", study),
            Self::Recursion(study) => ("study recursion", study),
            Self::Drift(study) => ("drift", study),
            Self::Readout(study) => ("readout", study),
            Self::Confidence(study) => ("confidence", study),
            Self::Reconstruct(study) => ("study reconstruct", study),
        }
    }

    /// Name of the study in JSON.
    pub fn name(&self) -> &'static str {
        self.study().0
    }

    /// Computes and prints the answer.
    pub fn answer(&self, common: &Common) -> Result<()> {
        self.study().1.answer(common)
    }
}

/// Option of a study with a picture.
#[derive(Args)]
struct Picture {
    /// Picture to write.
    #[arg(short, long, value_name = "FILE.svg")]
    output: Option<PathBuf>,
}

impl Picture {
    /// Checks before long work that it can be written, and would not replace the `scene`.
    fn check(&self, scene: &Path) -> Result<()> {
        self.output.as_ref().map_or(Ok(()), |path| print::check_output(path, &[scene]))
    }

    /// Writes what is drawn, if it is asked for.
    fn write(&self, draw: impl FnOnce() -> String) -> Result<()> {
        let Some(path) = &self.output else { return Ok(()) };
        Ok(output::write_bytes(path, draw().as_bytes())?)
    }
}

/// Prints a result as JSON, or its page.
fn show<T: Serialize>(common: &Common, result: &T, page: impl FnOnce(&T) -> Page) -> Result<()> {
    if common.json { print::json(result) } else { page(result).print() }
}

/// Headings of columns, one a noise level.
fn noise_columns(levels: &[impl AtNoise]) -> String {
    let columns = levels.iter().map(|level| format!("{:>10}", print::percent(level.noise_level())));
    columns.collect::<Vec<_>>().concat()
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

/// Adds a table of each group's errors by noise: of `decoders`, and the limit.
fn errors_by_noise(page: &mut Page, levels: &[impl AtNoise], decoders: &[&str]) {
    let columns = noise_columns(levels);
    let groups = levels.first().map_or(&[][..], |level| &level.decoders()[0].errors);
    for (place, group) in groups.iter().enumerate() {
        let heading = format!("RMSE of {}, {}", group.group, group.unit);
        page.line(format_args!("\n{heading:<18}{columns}"));
        for decoder in decoders {
            let errors = levels.iter().map(|level| metrics::of_decoder(level.decoders(), decoder));
            page.line(line(decoder, errors.map(|of| of.get(place).map(|errors| errors.rmse))));
        }
        let limits = levels.iter().map(|level| level.limit().groups.get(place));
        page.line(line("limit", limits.map(|group| group.map(|group| group.limit))));
    }
}

/// Adds what the limit is of, and the reasons why there is none.
fn refusals(page: &mut Page, levels: &[impl AtNoise]) {
    page.line("limit: of a decoder that sees all readings of a frame, on the first test frames, at most 40.");
    for level in levels {
        if let Some(refused) = &level.limit().refused {
            let noise = print::percent(level.noise_level());
            print::wrapped(page, &format!("no limit at noise {noise}: {refused}"));
        }
    }
}

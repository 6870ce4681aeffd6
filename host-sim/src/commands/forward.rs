//! Command `forward`: the ideal sensor's readings for given deformations.

use std::path::PathBuf;

use crate::Result;
use crate::experiment::Experiment;
use crate::report::Sections;
use clap::Args;
use taxel_data::{DataFile, csv_file};
use taxel_simulate::forward::forward;

use super::{Common, arguments, print};

/// Compute the ideal readings for deformations from a CSV file, in columns r{m}c{k}_ohm.
#[derive(Args)]
#[command(after_help = "Example: taxel forward paper deformation.csv -o readings.csv")]
pub struct Arguments {
    /// A built-in scene (paper, press) or the path of a scene file.
    scene: String,
    /// CSV file with columns r{m}e{i}_d{x|y|z}_mm.
    deformation: PathBuf,
    #[command(flatten)]
    to: arguments::OutputFile,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let scene = Experiment::load_open(&arguments.scene)?;
    let file = DataFile::read(&arguments.deformation)?;
    print::check_output(&arguments.to.output, &[&arguments.deformation, arguments.scene.as_ref()])?;
    let readings = forward(&scene.world, &file)?;
    let names = scene.world.reading_names();
    let lines = readings.chunks_exact(names.len()).map(|line| line.iter().copied());
    csv_file::write(&arguments.to.output, names.iter().map(String::as_str), lines)?;
    let mut result = Sections::new("Readings of the ideal sensor");
    result.fact("subject", "scene", "", &scene.name);
    result.fact("frames", "frames", "", file.lines());
    result.fact("readings", "readings of a frame", "", names.len());
    result.fact("file", "file", "", arguments.to.output.display().to_string());
    Ok(print::sections(common, &result))
}

//! Action `constants`: constants of the device's circuit, from a file.

use std::path::{Path, PathBuf};

use crate::report::Sections;
use crate::{Error, Result};
use clap::Args;
use serde::Deserialize;
use taxel_data::input;
use taxel_firmware::link::message::Setting;
use taxel_rig::device::{CircuitConstants, Device};

use super::super::{Common, print};
use super::settings::constants_lines;

#[derive(Args)]
pub struct Arguments {
    /// TOML file of constants that were measured by hand.
    ///
    /// Keys: reference_v, drive_v, row_source_ohm, feedback_ohm, series_ohm; the last three are one number, or one
    /// for each row or column. What is left out stays unchanged.
    file: PathBuf,
}

/// Constants in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    reference_v: Option<f32>,
    drive_v: Option<f32>,
    row_source_ohm: Option<Numbers>,
    feedback_ohm: Option<Numbers>,
    series_ohm: Option<Numbers>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Numbers {
    Alike(f32),
    Each(Vec<f32>),
}

impl Numbers {
    fn put_into(self, place: &mut Vec<f32>) {
        match self {
            Self::Alike(number) => place.fill(number),
            Self::Each(numbers) => *place = numbers,
        }
    }
}

pub fn execute(
    device: &mut Device,
    arguments: &Arguments,
    common: &Common,
) -> Result<print::Outcome> {
    let constants = read_constants(&arguments.file, &device.constants()?)?;
    device.set_constants(&constants)?;
    device.keep(Setting::Constants)?;
    let constants = device.constants()?;
    let mut result = Sections::new("Constants of the circuit, kept over restarts");
    result.value("constants", &constants);
    constants_lines(&mut result, &constants);
    Ok(print::sections(common, &result))
}

/// Constants of a file, in place of those `before`.
fn read_constants(path: &Path, before: &CircuitConstants) -> Result<CircuitConstants> {
    let text = input::read_text(path)?;
    let file: File = toml::from_str(&text)
        .map_err(|cause| Error::Usage(format!("{}: {cause}", path.display())))?;
    let mut constants = before.clone();
    constants.reference_v = file.reference_v.unwrap_or(constants.reference_v);
    constants.drive_v = file.drive_v.unwrap_or(constants.drive_v);
    let lists = [
        (file.row_source_ohm, &mut constants.row_source_ohm, "row_source_ohm"),
        (file.feedback_ohm, &mut constants.feedback_ohm, "feedback_ohm"),
        (file.series_ohm, &mut constants.series_ohm, "series_ohm"),
    ];
    for (numbers, place, name) in lists {
        let count = place.len();
        if let Some(numbers) = numbers {
            numbers.put_into(place);
        }
        if place.len() != count {
            let (path, found) = (path.display(), place.len());
            return Err(Error::Usage(format!(
                "{path}: {name} has {found} numbers; the device has {count}"
            )));
        }
    }
    Ok(constants)
}

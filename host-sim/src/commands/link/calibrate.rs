//! Action `calibrate`: constants of the device's circuit, from known resistors or from a file.

use std::io::{BufRead, Write as _};
use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::Args;
use serde::{Deserialize, Serialize};
use taxel_core::Wires;
use taxel_data::{DataFile, input};
use taxel_firmware::link::message::Setting;
use taxel_firmware::readout::ScanSettings;
use taxel_rig::calibration::{CircuitConstants, Fit};
use taxel_rig::device::Device;
use taxel_rig::device::calibrate::{Reading, calibrate as find};

use super::super::progress::Terminal;
use super::super::{Common, print};
use super::scan::{ScanArguments, all_wires, patience, reading_names};
use super::settings::constants_lines;

#[derive(Args)]
pub struct Arguments {
    /// CSV file of known resistors in Ω: columns r1c1_ohm and so on, one line for each arrangement of them. Empty, or
    /// without a column, is not connected.
    #[arg(required_unless_present = "constants")]
    known: Option<PathBuf>,
    /// TOML file of constants that were measured by hand. With KNOWN, the search begins with them.
    ///
    /// Keys: reference_v, drive_v, row_source_ohm, feedback_ohm, series_ohm; the last three are one number, or one a
    /// row or column. What is left out stays as it is.
    #[arg(long, value_name = "FILE")]
    constants: Option<PathBuf>,
    /// Keep the constants over restarts; otherwise they are active until the next one.
    #[arg(long)]
    store: bool,
    #[command(flatten)]
    scan: ScanArguments,
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

#[derive(Serialize)]
struct Outcome<'o> {
    constants: &'o CircuitConstants,
    fit: Option<&'o Fit>,
    kept: bool,
}

pub fn execute(device: &mut Device, arguments: &Arguments, common: &Common) -> Result<()> {
    let identity = device.identify()?;
    let wires = all_wires(&identity)?;
    let known = match &arguments.known {
        Some(path) => read_known(path, &reading_names(&identity, None)?, wires)?,
        None => Vec::new(),
    };
    let before = device.constants()?;
    if let Some(path) = &arguments.constants {
        let constants = read_constants(path, &before)?;
        device.set_constants(&constants)?;
    }
    let fit = if known.is_empty() {
        None
    } else {
        let scan = &arguments.scan;
        let reading = Reading {
            frames: scan.frames,
            period_us: scan.period_us,
            scan: ScanSettings { settling_us: scan.settling_us, oversampling: scan.oversampling },
            patience: patience(scan, &identity),
        };
        let connect = |number: usize| ask_to_connect(number, &known, wires);
        match find(device, wires, &known, reading, connect, &Terminal::new()) {
            Ok(fit) => Some(fit),
            Err(error) => {
                device.set_constants(&before)?;
                return Err(error);
            }
        }
    };
    let kept = if arguments.store { device.keep(Setting::Constants)?.constants } else { false };
    let constants = device.constants()?;
    let outcome = Outcome { constants: &constants, fit: fit.as_ref(), kept };
    if common.json {
        return print::json(&outcome);
    }
    let mut page = print::Page::default();
    if let Some(fit) = &fit {
        page.line(format_args!(
            "{} readings of known resistors tell the constants of {} rows and {} columns.",
            fit.readings, fit.rows, fit.columns
        ));
        page.line("Readings against known resistors (read/known − 1):");
        page.line(format_args!("{:<17} {}", "  before", fit.before));
        page.line(format_args!("{:<17} {}", "  after", fit.after));
        page.line(format_args!(
            "Standard errors: row source up to {:.4} Ω, feedback up to {:.3} %.",
            fit.row_source_error_ohm,
            100.0 * fit.feedback_error
        ));
    }
    let until =
        if kept { "kept over restarts" } else { "active until the restart (--store keeps them)" };
    page.line(format_args!("{:<17} {until}", "constants"));
    constants_lines(&mut page, &constants);
    page.print()
}

/// Asks for the arrangement with this number, and waits for a line on stdin.
fn ask_to_connect(number: usize, known: &[Vec<f64>], wires: Wires) -> Result<()> {
    let places: Vec<usize> =
        (0..known[number].len()).filter(|i| known[number][*i].is_finite()).collect();
    let name =
        |place: &usize| format!("r{}c{}", place / wires.columns + 1, place % wires.columns + 1);
    let what = match &places[..] {
        [place] => format!("{} Ω at {} alone", known[number][*place], name(place)),
        [first, .., last] => {
            format!(
                "{} resistors, from {} to {}, and nothing else",
                places.len(),
                name(first),
                name(last)
            )
        }
        [] => "nothing".into(),
    };
    let mut stderr = std::io::stderr();
    // Without stderr there is nobody to be asked, and stdin decides.
    let _ = write!(stderr, "{} of {}: connect {what}; then press Enter: ", number + 1, known.len());
    let _ = stderr.flush();
    let mut line = String::new();
    match std::io::stdin().lock().read_line(&mut line) {
        Ok(1..) => Ok(()),
        _ => Err(Error::failed("stdin ended before all resistors were connected")),
    }
}

/// Resistors of each line of a file, for all places `names`; NaN is not connected.
fn read_known(path: &Path, names: &[String], wires: Wires) -> Result<Vec<Vec<f64>>> {
    let file = DataFile::read(path)?;
    let bad = |what: String| Error::Usage(format!("{}: {what}", path.display()));
    if let Some(name) = file.header.iter().find(|name| !names.contains(name)) {
        let Wires { rows, columns } = wires;
        return Err(bad(format!(
            "column {name} is no reading that the device scans: r1c1_ohm to r{rows}c{columns}_ohm"
        )));
    }
    file.columns(file.header.iter().map(String::as_str))?;
    let line = |line: usize| -> Result<Vec<f64>> {
        let mut known = vec![f64::NAN; names.len()];
        for (column, name) in file.header.iter().enumerate() {
            let ohm = file.value(line, column);
            if ohm <= 0.0 {
                let line = file.line_number(line);
                return Err(bad(format!("line {line}, {name}: {ohm} Ω is no resistor")));
            }
            if let Some(place) = names.iter().position(|known| known == name) {
                known[place] = ohm;
            }
        }
        Ok(known)
    };
    (0..file.lines()).map(line).collect()
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

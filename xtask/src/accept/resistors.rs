//! Known resistors at the wires.

use std::path::Path;
use std::time::Duration;

use taxel_data::DataFile;
use taxel_firmware::link::message::{Report, Request};
use taxel_rig::device::Device;

use super::record::Beside;
use super::text;
use crate::process::Outcome;

/// RMS error in per cent of readings of known resistors, and what it may be: a metal film resistor's tolerance.
const RESISTORS_PERCENT: f64 = 1.0;

/// RMS error in per cent of the board's readings of `known` resistances in Ω.
pub fn compare(device: &mut Device, known: &[f32]) -> Outcome<Beside<f64>> {
    let request = Request::CaptureBaseline { frames: 100 };
    let patience = Duration::from_secs(10);
    let answer = device.ask(&request, patience, |report| match report {
        Report::Baseline { readings_ohm } => Some(readings_ohm.iter().collect::<Vec<f32>>()),
        _ => None,
    });
    let read = answer.map_err(text)?.map_err(|refusal| format!("{refusal:?}"))?;
    if read.len() != known.len() {
        return Err(format!(
            "--resistors has {} columns, the board reads {}",
            known.len(),
            read.len()
        ));
    }
    let squares = read.iter().zip(known).map(|(read, known)| f64::from(read / known - 1.0).powi(2));
    let measured = 100.0 * (squares.sum::<f64>() / known.len() as f64).sqrt();
    println!("readings of the known resistors are {measured:.3} % off (RMS)");
    Ok(Beside { measured, predicted: RESISTORS_PERCENT })
}

/// Resistances in Ω of a CSV file of one line, whose columns have these `names` in any order; in the order of the names.
pub fn read_resistors(path: &Path, names: &[String]) -> Outcome<Vec<f32>> {
    let failed = |cause: String| format!("--resistors {}: {cause}", path.display());
    let file = DataFile::read(path).map_err(text)?;
    if file.lines() != 1 {
        return Err(failed(format!("{} lines of resistances: give one", file.lines())));
    }
    if let Some(other) = file.header.iter().find(|name| !names.contains(name)) {
        return Err(failed(format!("the board reads no {other}")));
    }
    let resistance = |name: &String| {
        let ohm = file.value(0, file.column(name).map_err(text)?);
        let is_one = ohm.is_finite() && ohm > 0.0;
        let refused = || failed(format!("{name} is {ohm} Ω: give the resistance there"));
        is_one.then_some(ohm as f32).ok_or_else(refused)
    };
    names.iter().map(resistance).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn resistors_are_one_line_of_positive_numbers_under_their_names_in_any_order() {
        let path = std::env::temp_dir().join(format!("resistors-{}.csv", std::process::id()));
        let names = ["r1c1_ohm", "r1c2_ohm"].map(String::from);
        let read = |content: &str| {
            fs::write(&path, content).unwrap();
            read_resistors(&path, &names)
        };
        assert_eq!(read("r1c2_ohm,r1c1_ohm\n56.2,56\n"), Ok(vec![56.0, 56.2]));
        for (content, says) in [
            ("r1c1_ohm,r1c2_ohm\n1,1\n2,2\n", "2 lines"),
            ("r1c1_ohm,r1c2_ohm\nx,1\n", "number"),
            ("r1c1_ohm,r1c2_ohm\n1,0\n", "r1c2_ohm is 0"),
            ("r1c1_ohm\n1\n", "\"r1c2_ohm\""),
            ("r1c1_ohm,r1c2_ohm,r1c3_ohm\n1,1,1\n", "no r1c3_ohm"),
            ("56,56.2\n", "no c1"),
        ] {
            let refusal = read(content).unwrap_err();
            assert!(refusal.contains(says), "{content}: {refusal}");
        }
        fs::remove_file(&path).unwrap();
    }
}

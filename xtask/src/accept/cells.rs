//! What is between the wires: known resistors, and then the sensor at rest.

use std::str::FromStr;
use std::time::Instant;

use taxel_firmware::link::message::{Configuration, Report};
use taxel_rig::device::Device;

use super::line::baseline;
use super::stage::Stage;
use super::text;
use crate::process::Outcome;

/// Largest share by which a reading may differ from its resistor of 1 %: V_b, R_f and the switch add as much.
const LARGEST_ERROR: f32 = 0.03;

/// Frames of the sensor at rest, and the most that a reading may scatter, as a share: a standard deviation of the strongest
/// noise that models are made for.
const FRAMES: usize = 100;
const MOST_NOISE: f64 = 0.1;

/// What is between the wires.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cells {
    /// The sensor, untouched.
    Sensor,
    /// A resistor of so many Ω in every cell.
    Resistors(f32),
}

impl FromStr for Cells {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text == "sensor" {
            return Ok(Self::Sensor);
        }
        let ohm = text.parse().ok().filter(|ohm: &f32| ohm.is_finite() && *ohm > 0.0);
        ohm.map(Self::Resistors).ok_or("give `sensor`, or the resistors' Ω, such as 100")
    }
}

/// Compares all readings with resistors of `ohm`, of which one is in every cell.
pub fn resistors(device: &mut Device, ohm: f32) -> Outcome<Stage> {
    let own = device.configuration().map_err(text)?;
    let readings = baseline(device, own.scan.settling_us)?;
    device.resume().map_err(text)?;
    let columns = device.identify().map_err(text)?.columns.max(1);
    let errors: Vec<f32> = readings.iter().map(|reading| reading / ohm - 1.0).collect();
    // Neither a missing nor an open reading is off by a share.
    let largest = errors.iter().map(|error| error.abs()).filter(|error| error.is_finite());
    let measured = format!(
        "{:.2} % at most, {} missing or open",
        100.0 * largest.fold(0.0, f32::max),
        errors.iter().filter(|error| !error.is_finite()).count()
    );
    let allowed = format!("up to {} %, none missing", 100.0 * LARGEST_ERROR);
    let name = format!("readings of {ohm} Ω, error");
    Ok(Stage::new(name, measured, allowed, cause_of(&errors, columns)))
}

/// The probable cause of readings that are off: what a whole row, a whole column or all have in common.
fn cause_of(errors: &[f32], columns: usize) -> Option<String> {
    let is_off = |error: &&f32| error.abs() > LARGEST_ERROR || !error.is_finite();
    let first = errors.iter().position(|error| is_off(&error))?;
    let (row, column) = (first / columns, first % columns);
    if errors.iter().filter(is_off).count() == errors.len() {
        return Some(
            "every reading is off: V_b, R_f or the resistors do not match the constants".into(),
        );
    }
    if errors.chunks(columns).nth(row)?.iter().all(|error| is_off(&error)) {
        return Some(format!(
            "row-wire {} is off: its switch, its line to the board or its wire",
            row + 1
        ));
    }
    if errors.iter().skip(column).step_by(columns).all(|error| is_off(&error)) {
        return Some(format!(
            "column-wire {} is off: its op-amp, R_f, multiplexer or wire",
            column + 1
        ));
    }
    Some(format!("r{}c{} is off: check its resistor and its joints", row + 1, column + 1))
}

/// Looks at the untouched sensor: readings that are missing, and how much the others scatter.
pub fn sensor(device: &mut Device) -> Outcome<Vec<Stage>> {
    let own = device.configuration().map_err(text)?;
    device
        .configure(Configuration { send_readings: true, send_estimates: false, ..own })
        .map_err(text)?;
    let mut frames: Vec<Vec<f64>> = Vec::new();
    let heard = device.hear(Instant::now() + device.patience, |_, report| {
        if let Report::Readings { readings_ohm, .. } = report {
            frames.push(readings_ohm.iter().map(f64::from).collect());
        }
        (frames.len() == FRAMES).then_some(())
    });
    heard.map_err(text)?;
    device.resume().map_err(text)?;
    let missing = frames.iter().flatten().filter(|reading| !reading.is_finite()).count();
    let torn = "a wire is torn or a contact loose: `taxel link … record` shows which reading";
    let mut noise: Vec<f64> = (0..frames.first().map_or(0, Vec::len))
        .map(|cell| scatter(frames.iter().map(|frame| frame[cell])))
        .filter(|share| share.is_finite())
        .collect();
    noise.sort_by(f64::total_cmp);
    let median = noise.get(noise.len() / 2).copied().unwrap_or(f64::INFINITY);
    let noisy = "the sensor is touched, or its contacts or its ground are loose";
    let rounded = (median * 1e4).round() / 1e2;
    Ok(vec![
        Stage::within("readings of the sensor that are missing", missing, [0, 0], torn),
        Stage::within(
            "noise at rest, median of readings, %",
            rounded,
            [0.0, 100.0 * MOST_NOISE],
            noisy,
        ),
    ])
}

/// Standard deviation of readings as a share of their mean.
fn scatter(readings: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = readings.clone().count() as f64;
    let mean = readings.clone().sum::<f64>() / count;
    let squares: f64 = readings.map(|reading| (reading - mean).powi(2)).sum();
    (squares / (count - 1.0)).sqrt() / mean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_is_named_by_what_it_has_in_common() {
        let (row, column, cell) = ([2, 5, 8].as_slice(), [3, 4, 5].as_slice(), [4].as_slice());
        for (off, words) in [
            (&[][..], None),
            (cell, Some("r2c2 is off")),
            (row, Some("column-wire 3")),
            (column, Some("row-wire 2")),
            (&[0, 1, 2, 3, 4, 5, 6, 7, 8], Some("every reading")),
        ] {
            for error in [0.04, -0.04, f32::NAN, f32::INFINITY] {
                let mut errors = [0.02; 9];
                off.iter().for_each(|place| errors[*place] = error);
                let cause = cause_of(&errors, 3);
                assert_eq!(cause.is_some(), words.is_some());
                assert!(
                    words.is_none_or(|words| cause.as_ref().unwrap().contains(words)),
                    "{cause:?}"
                );
            }
        }
        let found = scatter([99.0, 101.0, 100.0].into_iter());
        assert!((found - 0.01).abs() < 1e-12, "{found}");
    }
}

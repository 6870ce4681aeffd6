//! Calibration of a device with known resistors.

use std::time::{Duration, Instant};

use taxel_core::Wires;
use taxel_data::Progress;
use taxel_firmware::link::message::{Configuration, Report};
use taxel_firmware::readout::ScanSettings;

use super::Device;
use crate::calibration::{Arrangement, Fit, fit};
use crate::error::{Error, Result};

/// How known resistors are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Number of frames that are averaged.
    pub frames: u16,
    /// Time from one scan to the next, in µs.
    pub period_us: u32,
    pub scan: ScanSettings,
    /// Longest time in which all frames must have come.
    pub patience: Duration,
}

/// Finds the constants of the device's circuit, and activates them until the next restart.
///
/// `known` has one list an arrangement of resistors: the resistance in Ω between each row and column of `wires`, row
/// after row; NaN and infinite are not connected. `connect` is called with the number of an arrangement (from 0)
/// before it is read, and returns when it is connected.
///
/// # Errors
/// [`Error::Data`] if constants cannot be found; the former ones then stay active. Errors of `connect`, and
/// of [`ask`](Device::ask).
pub fn calibrate<E: From<Error>>(
    device: &mut Device,
    wires: Wires,
    known: &[Vec<f64>],
    reading: Reading,
    mut connect: impl FnMut(usize) -> std::result::Result<(), E>,
    progress: &dyn Progress,
) -> std::result::Result<Fit, E> {
    let before = device.constants()?;
    let mut arrangements = Vec::new();
    for (number, known_ohm) in known.iter().enumerate() {
        connect(number)?;
        progress.stage("reading resistors", reading.frames.into());
        let read_s = device.while_paused(|device| read(device, wires, reading, progress))?;
        let siemens = |ohm: &f64| if ohm.is_nan() { 0.0 } else { 1.0 / ohm };
        arrangements.push(Arrangement { known_s: known_ohm.iter().map(siemens).collect(), read_s });
    }
    let fit = fit(&before, wires, &arrangements)?;
    device.set_constants(&fit.constants)?;
    Ok(fit)
}

/// Mean conductances in S of so many frames; 0 is open, NaN could not be read in some frame.
fn read(
    device: &mut Device,
    wires: Wires,
    reading: Reading,
    progress: &dyn Progress,
) -> Result<Vec<f64>> {
    device.configure(Configuration {
        frame_period_us: reading.period_us,
        scan: reading.scan,
        send_readings: true,
        send_estimates: false,
        ..Configuration::DEFAULT
    })?;
    let mut sums = vec![0.0; wires.readings()];
    let mut frames = 0;
    let heard = device.hear(Instant::now() + reading.patience, |_, report| {
        let Report::Readings { readings_ohm, .. } = report else { return None };
        if readings_ohm.0.len() != 4 * sums.len() {
            return Some(false);
        }
        // A short has an infinite conductance, which is far from any resistor's.
        let siemens = readings_ohm.iter().map(|ohm| 1.0 / f64::from(ohm));
        sums.iter_mut().zip(siemens).for_each(|(sum, siemens)| *sum += siemens);
        frames += 1;
        progress.step();
        (frames == reading.frames).then_some(true)
    })?;
    match heard {
        Some(true) => Ok(sums.iter().map(|sum| sum / f64::from(frames)).collect()),
        Some(false) => Err(Error::failed("the device scans other wires than it said")),
        None => {
            let wanted = reading.frames;
            Err(Error::failed(format!("only {frames} of {wanted} frames came in time")))
        }
    }
}

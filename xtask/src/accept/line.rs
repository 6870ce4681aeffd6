//! The line at its full rate, and whether op-amps settle: what shows only while the sensor is scanned.

use std::time::{Duration, Instant};

use taxel_firmware::link::message::{ConfidenceSent, Configuration, Report, Request};
use taxel_rig::device::Device;

use super::stage::Stage;
use super::text;
use crate::process::Outcome;

/// Bits on the line for a byte, and bytes of a report of all readings.
const BITS_A_BYTE: u32 = 10;
const READINGS_BYTES: u32 = 600;

/// Share of the line's time that readings take.
const LOAD: f64 = 0.95;

/// How often the time of a stream may pass before it is given up: the emulated board is slower than its own time.
const SLOWEST: u32 = 30;

/// Scans of a baseline; a settling time in µs that is enough for any op-amp, and the largest share by which a reading may
/// differ from one that waited so long.
const SCANS: u16 = 8;
const LONG_SETTLING_US: u32 = 500;
const LARGEST_CHANGE: f32 = 0.02;

/// Sends every reading for so many `seconds` of the board, as fast as the line carries them, and counts what is lost.
pub fn stream(device: &mut Device, seconds: u32, baud: u32) -> Outcome<Vec<Stage>> {
    let own = device.configuration().map_err(text)?;
    // Each takes this many bits of the line's time.
    let bits = f64::from(READINGS_BYTES * BITS_A_BYTE) / LOAD;
    let frame_period_us = (bits * 1e6 / f64::from(baud)).ceil() as u32;
    let streaming = Configuration {
        frame_period_us,
        send_readings: true,
        send_estimates: false,
        confidence: ConfidenceSent::Nothing,
        report_every: u16::MAX,
        ..own
    };
    device.configure(streaming).map_err(text)?;
    let (before, damaged_before) = (device.statistics().map_err(text)?, device.damaged);
    let mut frames: Vec<(u32, u64)> = Vec::new();
    let deadline = Instant::now() + SLOWEST * Duration::from_secs(seconds.into());
    let span_us = 1_000_000 * u64::from(seconds);
    let heard = device.hear(deadline, |_, report| {
        if let Report::Readings { frame, start_us, .. } = report {
            frames.push((*frame, *start_us));
        }
        let first = frames.first()?.1;
        frames.last().filter(|last| last.1 - first >= span_us).map(|_| ())
    });
    heard.map_err(text)?;
    let damaged = device.damaged - damaged_before;
    device.pause().map_err(text)?;
    let after = device.statistics().map_err(text)?;
    device.resume().map_err(text)?;
    let missed = after.frames_missed - before.frames_missed;
    let unsent = after.lost_reports - before.lost_reports;
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
        let silent = "no reading came: the sensor is not scanned, or the line is cut";
        return Ok(vec![Stage::new("packets of the stream", 0, "1 or more", Some(silent))]);
    };
    let sent = last.0.wrapping_sub(first.0) + 1;
    let lost = sent - frames.len() as u32;
    let of_line = if unsent > 0 {
        "the board could not send in time: the line or the computer is too slow. Give a lower --baud"
    } else {
        "the line loses bytes: update the ST-LINK's firmware, take another cable, or give a lower --baud"
    };
    let cause = (lost > 0 || damaged > 0).then_some(of_line);
    let measured = format!("{lost} of {sent} lost, {damaged} damaged");
    let slow = "the board scans more slowly than it should: a scan or its sending takes too long";
    // The start of a scan waits for the program's turn: one frame more or less.
    let rate = f64::from(sent - 1) * 1e6 / (last.1 - first.1).max(1) as f64;
    let wanted = 1e6 / f64::from(frame_period_us);
    let bounds = [0.99, 1.01].map(|share| (share * wanted * 10.0).round() / 10.0);
    Ok(vec![
        Stage::new("packets of the stream", measured, "none lost or damaged", cause),
        Stage::within("frames that the board missed", missed, [0, 0], slow),
        Stage::within("frames a second", (rate * 10.0).round() / 10.0, bounds, slow),
    ])
}

/// Compares readings that were taken after the usual wait with others after a long one.
pub fn settling(device: &mut Device) -> Outcome<Stage> {
    let own = device.configuration().map_err(text)?;
    let (usual, long) =
        (baseline(device, own.scan.settling_us)?, baseline(device, LONG_SETTLING_US)?);
    device.resume().map_err(text)?;
    let columns = device.identify().map_err(text)?.columns.max(1);
    let changes = usual.iter().zip(&long).map(|(usual, long)| (usual / long - 1.0).abs());
    let worst = changes.enumerate().filter(|(_, change)| change.is_finite());
    let Some((place, change)) = worst.max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(Stage::new("settling", "no cell is connected", "any", None::<&str>));
    };
    let slow = format!(
        "the op-amp of column {} is slow: it has not settled when it is sampled",
        place % columns + 1
    );
    let measured = format!("{:.2} %", 100.0 * change);
    let allowed = format!("up to {} %", 100.0 * LARGEST_CHANGE);
    Ok(Stage::new(
        "settling, largest change",
        measured,
        allowed,
        (change > LARGEST_CHANGE).then_some(slow),
    ))
}

/// Readings in Ω, each a mean of some scans with this wait.
pub fn baseline(device: &mut Device, settling_us: u32) -> Outcome<Vec<f32>> {
    let mut configuration = device.configuration().map_err(text)?;
    configuration.scan.settling_us = settling_us;
    device.configure(configuration).map_err(text)?;
    let request = Request::CaptureBaseline { frames: SCANS };
    let read = |report: &Report<'_>| match report {
        Report::Baseline { readings_ohm } => Some(readings_ohm.iter().collect()),
        _ => None,
    };
    device.ask_plainly(&request, read).map_err(text)
}

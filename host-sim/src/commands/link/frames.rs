//! Frames that a device sends of its scans.

use std::time::{Duration, Instant};

use crate::{Error, Result};
use taxel_data::Progress;
use taxel_rig::device::Device;
use taxel_rig::scans::{Assembler, Scan};

use super::super::Common;
use super::super::progress::Terminal;
use super::scan::{Wanted, check_length};

/// Values of a scan: readings; or outputs, their deviations and the frame's novelty, as far as they are sent.
pub fn values(scan: &Scan) -> Vec<f64> {
    let Some(estimate) = &scan.estimate else {
        return scan.readings.iter().copied().map(f64::from).collect();
    };
    let values = estimate.outputs.iter().chain(&estimate.deviations);
    values.copied().chain(estimate.novelty).map(f64::from).collect()
}

/// Receives the scans that the device sends, of `width` values each, and passes each to `take` at once. It waits for the next
/// one as long as its `patience` lasts.
pub fn hear_scans(
    device: &mut Device,
    count: usize,
    patience: Duration,
    wanted: Wanted,
    width: usize,
    common: &Common,
    mut take: impl FnMut(&Scan) -> Result<()>,
) -> Result<Vec<Scan>> {
    let progress = Terminal::new(common);
    progress.stage("recording", count);
    let mut scans: Vec<Scan> = Vec::new();
    let mut assembler = Assembler::new(wanted.sent());
    while scans.len() < count {
        let next = device
            .hear(Instant::now() + patience, |_, report| assembler.take(report).transpose())?;
        let Some(scan) = next.transpose()? else {
            let why = match scans.len() {
                0 => "does it scan? `identify` counts its frames",
                _ => "is the line fast enough? Give a longer --period-us",
            };
            return Err(Error::failed(format!(
                "{} of {count} frames arrived, and then none for {:.0} s: {why}",
                scans.len(),
                patience.as_secs_f64()
            )));
        };
        check_length(scan.number, values(&scan).len(), width)?;
        if scans.last().is_some_and(|last| scan.is_after_restart(last)) {
            return Err(Error::failed("the device has restarted meanwhile"));
        }
        take(&scan)?;
        scans.push(scan);
        progress.step();
    }
    Ok(scans)
}

/// A value as text files hold it: a reading that is open, which is infinite, is missing.
pub fn in_text(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::NAN }
}

/// Number of values that are missing or open; if all are missing, that is a failure.
pub fn missing<'v>(
    mut values: impl Iterator<Item = &'v f64> + Clone,
    wanted: Wanted,
) -> Result<usize> {
    let empty = values.clone().filter(|value| !value.is_finite()).count();
    if values.any(|value| !value.is_nan()) {
        return Ok(empty);
    }
    let what = if wanted.sent().estimates { "estimate" } else { "reading" };
    Err(Error::failed(format!(
        "the device sent no {what}; `identify` shows failed samples: check the wiring of \
         converters and rows (docs/board.md)"
    )))
}

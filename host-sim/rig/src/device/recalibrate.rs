//! Recalibration of a device's model from reference presses.

use std::time::Duration;

use firmware::link::message::{
    RecalibrationFault, RecalibrationReport, RecalibrationState, RecalibrationStep, Refusal,
    Report, Request,
};
use model_core::blob::Floats;
use taxel_data::progress::Progress;
use taxel_data::table::Table;

use super::upload::ERASE;
use super::{Device, Wire};
use crate::error::{Error, Result};

/// Longest time in which a board learns from a press that it has read.
const LEARNING: Duration = Duration::from_secs(1);

/// What became of reference presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// What the device says of them.
    pub report: RecalibrationReport,
    /// Number of presses that the device could not use.
    pub unusable: usize,
}

impl<W: Wire> Device<W> {
    /// Sends one step of a recalibration. Its frames, if it has some, take at most `patience` besides.
    pub fn recalibration_step(
        &mut self,
        step: RecalibrationStep<'_>,
        patience: Duration,
    ) -> Result<std::result::Result<RecalibrationReport, Refusal>> {
        let timeout = match step {
            RecalibrationStep::Commit => ERASE.max(self.patience),
            RecalibrationStep::Press { .. } => self.patience + LEARNING + patience,
            _ => self.patience,
        };
        self.ask(&Request::Recalibrate(step), timeout, |report| match report {
            Report::Recalibration(report) => Some(*report),
            _ => None,
        })
    }

    /// Sends a step that needs no frames.
    fn recalibration_plainly(
        &mut self,
        step: RecalibrationStep<'_>,
    ) -> Result<RecalibrationReport> {
        self.recalibration_step(step, Duration::ZERO)?.map_err(Error::Refused)
    }

    /// Puts the model before the active one in its place again; returns its CRC-32.
    pub fn undo(&mut self) -> Result<u32> {
        let nothing = Refusal::Recalibration(RecalibrationFault::NoModel);
        let active = self.identify()?.model.ok_or(Error::Refused(nothing))?;
        let step = RecalibrationStep::Undo { crc_32: active.crc_32 };
        crc_of(&self.recalibration_plainly(step)?)
    }
}

/// Lets the device learn from presses, and activates the model that it makes of them.
///
/// `outputs` has a line for each press: what the outputs truly are. `show` is called with the number of a press, and
/// returns once the sensor is pressed so, or the device has decoded its readings. `frames` are scanned for each press
/// within `patience`; 0 for presses that the device decodes.
///
/// # Errors
/// [`Error::Refused`] if the device cannot make a better model; the former one then stays active. Errors of `show`, and of
/// [`ask`](Device::ask).
pub fn recalibrate<W: Wire, E: From<Error>>(
    device: &mut Device<W>,
    outputs: &Table,
    frames: u16,
    patience: Duration,
    mut show: impl FnMut(&mut Device<W>, usize) -> std::result::Result<(), E>,
    progress: &dyn Progress,
) -> std::result::Result<Outcome, E> {
    device.recalibration_plainly(RecalibrationStep::Begin)?;
    progress.stage("learning from presses", outputs.len());
    let (mut before, mut unusable) = (0, 0);
    for (number, line) in outputs.lines().enumerate() {
        show(device, number)?;
        let line: Vec<f32> = line.iter().map(|output| *output as f32).collect();
        let outputs = Floats::of(&line);
        let step = RecalibrationStep::Press { before, frames, outputs };
        match device.recalibration_step(step, patience)? {
            Ok(report) => before = report.presses,
            Err(Refusal::Recalibration(RecalibrationFault::UnusablePress)) => unusable += 1,
            Err(refusal) => return Err(Error::Refused(refusal).into()),
        }
        progress.step();
    }
    let report = device.recalibration_plainly(RecalibrationStep::Commit)?;
    let crc_32 = crc_of(&report)?;
    let identity = device.identify()?;
    if !identity.has_in_force(crc_32) {
        let in_force = format!("{:08x?}", identity.model.map(|model| model.crc_32));
        return Err(Error::NotInForce { committed: crc_32, in_force }.into());
    }
    Ok(Outcome { report, unusable })
}

/// Lets the device learn from presses whose readings in Ω are known, while it does not scan.
pub fn recalibrate_from_readings<W: Wire>(
    device: &mut Device<W>,
    readings: &Table,
    outputs: &Table,
    progress: &dyn Progress,
) -> Result<Outcome> {
    device.while_paused(|device| {
        let show = |device: &mut Device<W>, number: usize| {
            let Some(line) = readings.lines().nth(number) else { return Ok(()) };
            let line: Vec<f32> = line.iter().map(|reading| *reading as f32).collect();
            let request = Request::Decode { frame: number as u32, readings_ohm: Floats::of(&line) };
            device
                .ask_plainly(&request, |report| matches!(report, Report::Estimate(_)).then_some(()))
        };
        recalibrate(device, outputs, 0, Duration::ZERO, show, progress)
    })
}

/// CRC-32 of the model that a report says is in force.
fn crc_of(report: &RecalibrationReport) -> Result<u32> {
    match report.state {
        RecalibrationState::InForce { crc_32 } => Ok(crc_32),
        state => Err(Error::Unexpected {
            request: "a change of the model".into(),
            answer: format!("{state:?}"),
        }),
    }
}

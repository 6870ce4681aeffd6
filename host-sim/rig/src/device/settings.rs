//! Constants of a device's circuit, and settings that it keeps over restarts.

use serde::Serialize;
use taxel_core::blob::Floats;
use taxel_firmware::circuit::Constants;
use taxel_firmware::link::message::{Kept, Report, Request, Setting};

use super::{Device, WRITING};
use crate::error::{Error, Result};

/// Constants of a circuit, as the device takes them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CircuitConstants {
    /// Reference voltage of the converter, in V.
    pub reference_v: f32,
    /// Voltage in V by which the active row is pulled below the others.
    pub drive_v: f32,
    /// Resistance in Ω between the drive and each row-wire.
    pub row_source_ohm: Vec<f32>,
    /// Feedback resistance in Ω of each column.
    pub feedback_ohm: Vec<f32>,
    /// Resistance in Ω in series with each column.
    pub series_ohm: Vec<f32>,
}

impl From<&Constants<'_>> for CircuitConstants {
    fn from(constants: &Constants<'_>) -> Self {
        Self {
            reference_v: constants.reference_v,
            drive_v: constants.drive_v,
            row_source_ohm: constants.row_source_ohm.iter().collect(),
            feedback_ohm: constants.feedback_ohm.iter().collect(),
            series_ohm: constants.series_ohm.iter().collect(),
        }
    }
}

impl CircuitConstants {
    /// The constants as the link carries them.
    fn for_link(&self) -> Constants<'_> {
        Constants {
            reference_v: self.reference_v,
            drive_v: self.drive_v,
            row_source_ohm: Floats::new(&self.row_source_ohm),
            feedback_ohm: Floats::new(&self.feedback_ohm),
            series_ohm: Floats::new(&self.series_ohm),
        }
    }
}

impl Device {
    /// Asks for the active constants of the circuit.
    pub fn constants(&mut self) -> Result<CircuitConstants> {
        self.ask_plainly(&Request::Constants, constants)
    }

    /// Activates `constants` until the next restart.
    pub fn set_constants(&mut self, new: &CircuitConstants) -> Result<()> {
        self.ask_plainly(&Request::SetConstants(new.for_link()), constants).map(|_| ())
    }

    /// Asks which settings are kept over restarts.
    pub fn kept(&mut self) -> Result<Kept> {
        self.ask_plainly(&Request::Kept, kept)
    }

    /// Keeps an active setting over restarts.
    pub fn keep(&mut self, setting: Setting) -> Result<Kept> {
        self.write(&Request::Keep(setting))
    }

    /// Lets the device forget a setting: the next restart activates the image's.
    pub fn forget(&mut self, setting: Setting) -> Result<Kept> {
        self.write(&Request::Forget(setting))
    }

    fn write(&mut self, request: &Request<'_>) -> Result<Kept> {
        self.ask(request, self.patience.max(WRITING), kept)?.map_err(Error::Refused)
    }
}

fn kept(report: &Report<'_>) -> Option<Kept> {
    match report {
        Report::Kept(kept) => Some(*kept),
        _ => None,
    }
}

fn constants(report: &Report<'_>) -> Option<CircuitConstants> {
    match report {
        Report::Constants(constants) => Some(constants.into()),
        _ => None,
    }
}

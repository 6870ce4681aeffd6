//! Constants of a device's circuit, and settings that it keeps over restarts.

use taxel_firmware::link::message::{Kept, Report, Request, Setting};

use super::{Device, WRITING};
use crate::calibration::CircuitConstants;
use crate::error::{Error, Result};

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

//! Configurations of a device.

use taxel_firmware::link::message::{Configuration, Report, Request};

use super::Device;
use crate::error::{Error, Result};

impl Device {
    /// Asks for the active configuration.
    pub fn configuration(&mut self) -> Result<Configuration> {
        self.ask_for_configuration(&Request::Configuration)
    }

    /// Makes `configuration` the active one, until [`resume`](Self::resume) or a restart unless it is
    /// [kept](Self::keep).
    pub fn configure(&mut self, configuration: Configuration) -> Result<()> {
        self.ask_for_configuration(&Request::Configure(configuration))?;
        Ok(())
    }

    /// Makes the configuration active that the device keeps, else its default.
    pub fn resume(&mut self) -> Result<Configuration> {
        self.ask_for_configuration(&Request::Resume)
    }

    /// Makes the configuration active that the device keeps. Returns what a host sets on top of it to scan: every scan is
    /// reported, at the default period if the device keeps none.
    pub fn resume_to_scan(&mut self) -> Result<Configuration> {
        let own = self.resume()?;
        let frame_period_us = match own.frame_period_us {
            0 => Configuration::DEFAULT.frame_period_us,
            kept => kept,
        };
        Ok(Configuration { frame_period_us, report_every: 1, ..own })
    }

    fn ask_for_configuration(&mut self, request: &Request<'_>) -> Result<Configuration> {
        self.ask_plainly(request, |report| match report {
            Report::Configuration(configuration) => Some(*configuration),
            _ => None,
        })
    }

    /// Runs `work` while the device does not scan, so that no reports come unasked. Afterwards the device
    /// [resumes](Self::resume), even if the work failed or was interrupted.
    pub fn while_paused<T, E: From<Error>>(
        &mut self,
        work: impl FnOnce(&mut Self) -> std::result::Result<T, E>,
    ) -> std::result::Result<T, E> {
        let outcome = match self.pause() {
            Ok(()) => work(self),
            Err(Error::Interrupted) => Err(Error::Interrupted.into()),
            // A device that does not answer need not be asked to go on.
            Err(cause) => return Err(cause.into()),
        };
        let resumed = self.uninterrupted(Self::resume);
        outcome.and_then(|value| Ok(resumed.map(|_| value)?))
    }

    /// Stops scanning.
    pub fn pause(&mut self) -> Result<()> {
        self.configure(Configuration { frame_period_us: 0, ..Configuration::DEFAULT })
    }
}

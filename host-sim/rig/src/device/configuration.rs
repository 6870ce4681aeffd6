//! Configurations of a device, which a host leases.

use std::time::{Duration, Instant};

use serde::Serialize;
use taxel_firmware::link::message::{Configuration, Report, Request};

use super::Device;
use crate::error::{Error, Result};

/// Time without requests after which a device returns to its own configuration, unless told otherwise.
pub const LEASE: Duration = Duration::from_secs(10);

/// Configuration that is active, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ActiveConfiguration {
    pub configuration: Configuration,
    /// Time in ms after which the device returns to its own configuration if no request comes; 0 if this is its own.
    pub lease_left_ms: u32,
}

/// Configuration that a host prolongs while it listens.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    configuration: Configuration,
    /// Time at which a request was sent last.
    pub asked: Instant,
    /// Number of the request that prolongs the lease, until it is answered.
    pub waiting: Option<u16>,
}

impl Device {
    /// Asks for the active configuration.
    pub fn configuration(&mut self) -> Result<ActiveConfiguration> {
        self.ask_for_configuration(&Request::Configuration)
    }

    /// Makes `configuration` the active one for as long as this host is there: until [`resume`](Self::resume), or
    /// until the device has heard no request for [`lease`](Self::lease). While the device scans, listening to it
    /// prolongs the lease.
    pub fn configure(&mut self, configuration: Configuration) -> Result<()> {
        self.kept = None;
        self.ask_for_configuration(&self.leased(configuration))?;
        // Without scans there is nothing to listen to; and a device whose flash is erased may lose what is sent.
        let scans = configuration.frame_period_us > 0;
        self.kept = scans.then(|| Kept { configuration, asked: Instant::now(), waiting: None });
        Ok(())
    }

    /// Makes `configuration` the device's own one, which it returns to, until its next restart.
    pub fn configure_until_restart(&mut self, configuration: Configuration) -> Result<()> {
        self.kept = None;
        self.ask_for_configuration(&Request::Configure { configuration, lease_ms: 0 })?;
        Ok(())
    }

    /// Makes the device's own configuration the active one again.
    pub fn resume(&mut self) -> Result<ActiveConfiguration> {
        self.kept = None;
        self.ask_for_configuration(&Request::Resume)
    }

    fn ask_for_configuration(&mut self, request: &Request<'_>) -> Result<ActiveConfiguration> {
        self.ask_plainly(request, |report| match report {
            Report::Configuration { configuration, lease_left_ms } => Some(ActiveConfiguration {
                configuration: *configuration,
                lease_left_ms: *lease_left_ms,
            }),
            _ => None,
        })
    }

    /// Runs `work` while the device does not scan, so that no reports come unasked. Afterwards the device returns to
    /// its own configuration, even if the work failed or was interrupted.
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

    /// Stops scanning, for as long as this host is there.
    pub fn pause(&mut self) -> Result<()> {
        self.configure(Configuration { frame_period_us: 0, ..Configuration::DEFAULT })
    }

    /// Prolongs the lease of the configuration that is kept, if it is time to.
    pub(super) fn prolong(&mut self) -> Result<()> {
        let Some(kept) = self.kept else { return Ok(()) };
        // A device that is slow to answer is not sent more and more; but a request may be lost.
        let patience = if kept.waiting.is_some() { self.lease } else { self.lease / 3 };
        if kept.asked.elapsed() > patience {
            let number = self.send(&self.leased(kept.configuration))?;
            self.kept = Some(Kept { asked: Instant::now(), waiting: Some(number), ..kept });
        }
        Ok(())
    }

    /// Request for a leased configuration.
    fn leased(&self, configuration: Configuration) -> Request<'static> {
        let lease_ms = u32::try_from(self.lease.as_millis()).unwrap_or(u32::MAX).max(1);
        Request::Configure { configuration, lease_ms }
    }
}

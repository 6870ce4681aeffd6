//! A device at the other end of a serial line, real or emulated.
//!
//! [`Device`] sends requests and receives reports; [`upload`] replaces its model; [`calibrate`] finds the constants
//! of its circuit; [`stream`] lets it decode frames; [`check`] and [`scan`] compare it with the host. `docs/link.md` specifies the
//! protocol.

use std::collections::VecDeque;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use firmware::capacity::Capacity;
use firmware::link::message::{
    Configuration, Identity, Memory, ModelIdentity, Refusal, Report, Request,
};
use firmware::link::receive::{Received, Receiver};
use firmware::link::{cobs, packet};
use model_core::Wires;
use model_core::blob::{Floats, ModelShape};
use serde::Serialize;

use crate::error::{Error, Result};

pub mod serial;
mod settings;
pub mod calibrate;
pub mod stream;
pub mod upload;
mod expected;
pub mod scan;
pub mod check;

/// Longest time that a board takes to answer a request that erases no flash.
const ANSWER: Duration = Duration::from_millis(500);
/// Time without requests after which a device returns to its own configuration, unless told otherwise.
pub const LEASE: Duration = Duration::from_secs(10);
/// Time that a device takes to start.
const START: Duration = Duration::from_millis(100);
/// Number of times that a request is sent before the device is given up.
const ATTEMPTS: u32 = 6;
/// Longest time that sending a request may take.
const SLOWEST_WRITE: Duration = Duration::from_secs(10);
/// Largest size of a request.
const MOST_REQUEST_BYTES: usize = 4096;
/// Largest size of a report: that of a sensor of 255 rows, 32 columns and 255 outputs a row would be larger.
const MOST_REPORT_BYTES: usize = 64 * 1024;
/// Time that one look for bytes waits.
const GLANCE: Duration = Duration::from_millis(5);

/// Line of bytes to a device.
pub trait Wire: Read + Write {
    /// Lets reads end after `timeout` if nothing has come.
    ///
    /// # Errors
    /// Error of the system if the timeout cannot be set.
    fn set_read_timeout(&mut self, timeout: Duration) -> std::io::Result<()>;
}

impl Wire for TcpStream {
    fn set_read_timeout(&mut self, timeout: Duration) -> std::io::Result<()> {
        TcpStream::set_read_timeout(self, Some(timeout))
    }
}

/// Identity that a device reports.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeviceIdentity {
    /// Name of the board.
    pub board: String,
    /// Version of its firmware.
    pub firmware: String,
    /// Largest number of row-wires.
    pub rows: usize,
    /// Largest number of readings in a row.
    pub columns: usize,
    /// Largest number of outputs of a row.
    pub outputs: usize,
    /// Name of the exponential that it decodes with.
    pub kernel: String,
    /// Active model, if there is one.
    pub model: Option<ModelIdentity>,
    /// Name of its scene or data set, cut after 40 bytes.
    pub model_name: String,
    /// Largest blob that a slot holds, in bytes.
    pub slot_bytes: usize,
    /// Largest chunk of an upload, in bytes.
    pub chunk_bytes: usize,
    /// Use of its flash and RAM.
    pub memory: Memory,
}

impl DeviceIdentity {
    /// Sensor and model that the device has room for.
    #[must_use]
    pub fn capacity(&self) -> Capacity {
        Capacity { rows: self.rows, columns: self.columns, outputs: self.outputs }
    }

    /// Wires that the device scans: those of its model, or all without one.
    #[must_use]
    pub fn wires(&self) -> Wires {
        let capacity = self.capacity();
        let shape = self.model.map(|model| ModelShape {
            rows: model.rows.into(),
            inputs: model.inputs.into(),
            outputs: model.outputs.into(),
        });
        shape.and_then(|shape| capacity.wires_for(shape)).unwrap_or(capacity.wires())
    }

    /// Whether the model with that CRC-32 is active.
    #[must_use]
    pub fn has_in_force(&self, crc_32: u32) -> bool {
        self.model.is_some_and(|found| found.crc_32 == crc_32)
    }
}

impl From<&Identity<'_>> for DeviceIdentity {
    fn from(identity: &Identity<'_>) -> Self {
        Self {
            board: identity.board.into(),
            firmware: identity.firmware.into(),
            rows: identity.rows.into(),
            columns: identity.columns.into(),
            outputs: identity.outputs.into(),
            kernel: identity.kernel.into(),
            model: identity.model,
            model_name: identity.model_name.into(),
            slot_bytes: identity.slot_bytes as usize,
            chunk_bytes: identity.chunk_bytes.into(),
            memory: identity.memory,
        }
    }
}

/// Configuration that is active, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ActiveConfiguration {
    /// Configuration.
    pub configuration: Configuration,
    /// Time in ms after which the device returns to its own configuration if no request comes; 0 if this is its own.
    pub lease_left_ms: u32,
}

/// Configuration that a host prolongs while it listens.
#[derive(Clone, Copy)]
struct Kept {
    configuration: Configuration,
    /// Time at which a request was sent last.
    asked: Instant,
    /// Number of the request that prolongs the lease, until it is answered.
    waiting: Option<u16>,
}

/// Host's end of the line to a device.
pub struct Device<W> {
    wire: W,
    receiver: Receiver<Vec<u8>>,
    /// Bytes that were read and not looked at yet.
    pending: VecDeque<u8>,
    number: u16,
    /// Configuration that is prolonged while reports are heard.
    kept: Option<Kept>,
    /// Time without requests after which the device returns to its own configuration.
    pub lease: Duration,
    /// Flag that ends waiting with [`Error::Interrupted`] when it is set, if there is one.
    pub stop: Option<Arc<AtomicBool>>,
    /// Longest time that an answer may take.
    pub patience: Duration,
    /// Number of frames of bytes that arrived damaged.
    pub damaged: u64,
    /// Number of requests that had to be sent again.
    pub repeated: u64,
}

impl<W: Wire> Device<W> {
    /// Device on `wire`; nothing is sent yet.
    ///
    /// # Errors
    /// [`Error::Line`] if the wire takes no timeout.
    pub fn new(mut wire: W) -> Result<Self> {
        wire.set_read_timeout(GLANCE)?;
        let receiver = Receiver::new(vec![0; MOST_REPORT_BYTES]);
        let pending = VecDeque::new();
        Ok(Self {
            wire,
            receiver,
            pending,
            // Answers to a host before this one may still come: they shall not have this one's numbers.
            number: RandomState::new().build_hasher().finish() as u16,
            kept: None,
            lease: LEASE,
            stop: None,
            patience: ANSWER,
            damaged: 0,
            repeated: 0,
        })
    }

    /// Sends `bytes` unframed, as they are.
    ///
    /// # Errors
    /// [`Error::Line`] if the line fails, or takes no bytes for too long; [`Error::Interrupted`].
    pub fn send_raw(&mut self, bytes: &[u8]) -> Result<()> {
        let (mut rest, start) = (bytes, Instant::now());
        while !rest.is_empty() {
            self.check_stop()?;
            match self.wire.write(rest) {
                Ok(0) => return Err(std::io::Error::from(ErrorKind::WriteZero).into()),
                Ok(count) => rest = &rest[count..],
                // A slow line takes them little by little.
                Err(cause) if is_timeout(&cause) && start.elapsed() < SLOWEST_WRITE => {}
                Err(cause) => return Err(cause.into()),
            }
        }
        Ok(self.wire.flush()?)
    }

    /// Sends a request with a new number, and returns the number.
    ///
    /// # Errors
    /// [`Error::RequestTooLong`], or [`Error::Line`] if the line fails.
    pub fn send(&mut self, request: &Request<'_>) -> Result<u16> {
        self.number = self.number.checked_add(1).unwrap_or(packet::UNASKED + 1);
        self.send_raw(&request_bytes(self.number, request)?)?;
        if let Some(kept) = &mut self.kept {
            kept.asked = Instant::now();
        }
        Ok(self.number)
    }

    /// Prolongs the lease of the configuration that is kept, if it is time to.
    fn prolong(&mut self) -> Result<()> {
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

    /// Ends the work if somebody wants that.
    fn check_stop(&self) -> Result<()> {
        let stopped = self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed));
        if stopped { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Runs `work`, which an interruption does not end.
    fn uninterrupted<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let stop = self.stop.take();
        let outcome = work(self);
        self.stop = stop;
        outcome
    }

    /// Passes reports with their numbers to `read` until it returns a value; `None` once `deadline` has
    /// passed.
    ///
    /// # Errors
    /// [`Error::Line`] or [`Error::Closed`] if the line fails; [`Error::Interrupted`].
    pub fn hear<T>(
        &mut self,
        deadline: Instant,
        mut read: impl FnMut(u16, &Report<'_>) -> Option<T>,
    ) -> Result<Option<T>> {
        let mut bytes = [0; 4096];
        let mut is_last_look = false;
        loop {
            while let Some(byte) = self.pending.pop_front() {
                let report = match self.receiver.push(byte) {
                    Some(Received::Frame(bytes)) => packet::decode::<Report<'_>>(bytes),
                    Some(_) => Err(packet::PacketError::Damaged),
                    None => continue,
                };
                match report {
                    Ok(report) => {
                        if let Some(kept) = &mut self.kept {
                            kept.waiting = kept.waiting.filter(|number| *number != report.number);
                        }
                        if let Some(answer) = read(report.number, &report.body) {
                            return Ok(Some(answer));
                        }
                    }
                    Err(_) => self.damaged += 1,
                }
            }
            if is_last_look {
                return Ok(None);
            }
            self.check_stop()?;
            self.prolong()?;
            match self.wire.read(&mut bytes) {
                Ok(0) => return Err(Error::Closed),
                Ok(count) => self.pending.extend(&bytes[..count]),
                Err(cause) if is_timeout(&cause) => {}
                Err(cause) => return Err(cause.into()),
            }
            // The time is looked at after reading, so that even a deadline of now takes the bytes that
            // are there. Bytes that came do not prolong it, since a device that scans never pauses for
            // long.
            is_last_look = Instant::now() >= deadline;
        }
    }

    /// Sends `request` until the device answers; its refusal is an answer too.
    ///
    /// # Errors
    /// [`Error::NoAnswer`] if there is none, [`Error::Unexpected`] for an answer that `read` does not
    /// take.
    pub fn ask<T>(
        &mut self,
        request: &Request<'_>,
        timeout: Duration,
        read: impl Fn(&Report<'_>) -> Option<T>,
    ) -> Result<std::result::Result<T, Refusal>> {
        for attempt in 0..ATTEMPTS {
            self.repeated += u64::from(attempt > 0);
            let number = self.send(request)?;
            let answer = self.hear(Instant::now() + timeout, |found, report| {
                (found == number).then(|| match report {
                    Report::Refused(refusal) => Ok(Err(*refusal)),
                    report => read(report).map(Ok).ok_or_else(|| format!("{report:?}")),
                })
            })?;
            match answer {
                Some(Ok(answer)) => return Ok(answer),
                Some(Err(answer)) => {
                    return Err(Error::Unexpected { request: format!("{request:?}"), answer });
                }
                None => {}
            }
        }
        Err(Error::NoAnswer { attempts: ATTEMPTS, timeout })
    }

    /// Sends a `request` that no device of this protocol refuses, until the device answers.
    ///
    /// # Errors
    /// [`Error::Refused`] if it does refuse, or the errors of [`ask`](Self::ask).
    pub fn ask_plainly<T>(
        &mut self,
        request: &Request<'_>,
        read: impl Fn(&Report<'_>) -> Option<T>,
    ) -> Result<T> {
        self.ask(request, self.patience, read)?.map_err(Error::Refused)
    }

    /// Asks the device for its identity.
    ///
    /// # Errors
    /// Errors of [`ask`](Self::ask), such as [`Error::NoAnswer`].
    pub fn identify(&mut self) -> Result<DeviceIdentity> {
        self.ask_plainly(&Request::Identify, |report| match report {
            Report::Identity(identity) => Some(identity.into()),
            _ => None,
        })
    }

    /// Asks for the device's counters.
    ///
    /// # Errors
    /// Errors of [`ask`](Self::ask), such as [`Error::NoAnswer`].
    pub fn statistics(&mut self) -> Result<firmware::link::message::Statistics> {
        self.ask_plainly(&Request::Statistics, |report| match report {
            Report::Statistics(statistics) => Some(*statistics),
            _ => None,
        })
    }

    /// Asks for the active configuration.
    ///
    /// # Errors
    /// Errors of [`ask`](Self::ask), such as [`Error::NoAnswer`].
    pub fn configuration(&mut self) -> Result<ActiveConfiguration> {
        self.ask_for_configuration(&Request::Configuration)
    }

    /// Makes `configuration` the active one for as long as this host is there: until [`resume`](Self::resume), or
    /// until the device has heard no request for [`lease`](Self::lease). While the device scans, listening to it
    /// prolongs the lease.
    ///
    /// # Errors
    /// [`Error::Refused`] if the device refuses it, or the errors of [`ask`](Self::ask).
    pub fn configure(&mut self, configuration: Configuration) -> Result<()> {
        self.kept = None;
        self.ask_for_configuration(&self.leased(configuration))?;
        // Without scans there is nothing to listen to; and a device whose flash is erased may lose what is sent.
        let scans = configuration.frame_period_us > 0;
        self.kept = scans.then(|| Kept { configuration, asked: Instant::now(), waiting: None });
        Ok(())
    }

    /// Makes `configuration` the device's own one, which it returns to, until its next restart.
    ///
    /// # Errors
    /// [`Error::Refused`] if the device refuses it, or the errors of [`ask`](Self::ask).
    pub fn configure_until_restart(&mut self, configuration: Configuration) -> Result<()> {
        self.kept = None;
        self.ask_for_configuration(&Request::Configure { configuration, lease_ms: 0 })?;
        Ok(())
    }

    /// Makes the device's own configuration the active one again.
    ///
    /// # Errors
    /// Errors of [`ask`](Self::ask), such as [`Error::NoAnswer`].
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

    /// Gives the device a baseline in Ω, one number a reading of its model.
    ///
    /// # Errors
    /// [`Error::Refused`] if their number is another, or the errors of [`ask`](Self::ask).
    pub fn set_baseline(&mut self, baseline_ohm: &[f32]) -> Result<()> {
        let request = Request::SetBaseline { readings_ohm: Floats::of(baseline_ohm) };
        self.ask_plainly(&request, |report| matches!(report, Report::Baseline { .. }).then_some(()))
    }

    /// Runs `work` while the device does not scan, so that no reports come unasked. Afterwards the device returns to
    /// its own configuration, even if the work failed or was interrupted.
    ///
    /// # Errors
    /// Errors of [`ask`](Self::ask), or whatever error `work` returns.
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
    pub(crate) fn pause(&mut self) -> Result<()> {
        self.configure(Configuration { frame_period_us: 0, ..Configuration::DEFAULT })
    }

    /// Restarts the device and waits until it answers again.
    ///
    /// # Errors
    /// [`Error::NoAnswer`] if the device does not answer in time.
    pub fn restart(&mut self) -> Result<DeviceIdentity> {
        self.ask_plainly(&Request::Restart, |report| {
            matches!(report, Report::Restarting).then_some(())
        })?;
        self.kept = None;
        // Bytes that arrive while it starts are lost, which is no fault of the line.
        let (patience, repeated) = (self.patience, self.repeated);
        let start = Instant::now();
        self.patience = START;
        let mut identity = self.identify();
        while identity.is_err() && start.elapsed() < patience {
            identity = self.identify();
        }
        (self.patience, self.repeated) = (patience, repeated);
        identity
    }
}

/// Bytes of a request, framed for the line.
///
/// # Errors
/// [`Error::RequestTooLong`] for a request of more than 4096 bytes.
pub fn request_bytes(number: u16, request: &Request<'_>) -> Result<Vec<u8>> {
    let mut buffer = [0; MOST_REQUEST_BYTES];
    let packet = packet::encode(number, request, &mut buffer)
        .ok_or(Error::RequestTooLong { most_bytes: MOST_REQUEST_BYTES })?;
    let mut bytes = Vec::with_capacity(packet.len() + 8);
    cobs::encode(packet, |byte| {
        bytes.push(byte);
        true
    });
    Ok(bytes)
}

fn is_timeout(cause: &std::io::Error) -> bool {
    matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

//! A device at the other end of a serial line, real or emulated.
//!
//! [`Device`] sends requests and receives reports; [`upload`] replaces its model; [`stream`] lets it decode frames; [`check`] compares it with the host.
//! `docs/link.md` specifies the protocol.

use std::collections::VecDeque;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{ErrorKind, Read, Write};
use std::mem;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taxel_core::blob::Floats;
use taxel_firmware::link::message::{Refusal, Report, Request};
use taxel_firmware::link::packet::PacketError;
use taxel_firmware::link::receive::{Received, Receiver};
use taxel_firmware::link::{cobs, packet};

use crate::error::{Error, Heard, Result};

pub(crate) mod look;
mod identity;
mod configuration;
pub mod serial;
mod settings;
pub mod stream;
pub mod upload;
mod expected;
pub mod check;

pub use identity::DeviceIdentity;
pub use settings::CircuitConstants;

/// Longest time that a board takes to answer a request that erases no flash.
const ANSWER: Duration = Duration::from_millis(500);
/// Longest time of a request that is written down: a page of flash may have to be erased.
const WRITING: Duration = Duration::from_secs(5);
/// Time that a device takes to start.
const START: Duration = Duration::from_millis(100);
/// Number of times that a request is sent before the device is given up.
const ATTEMPTS: u32 = 6;
/// Longest time that sending a request may take.
const SLOWEST_WRITE: Duration = Duration::from_secs(10);
/// Largest size of a request: a frame of 32 × 32 readings takes more than half of it.
const MOST_REQUEST_BYTES: usize = 8192;
/// Largest size of a report: that of a sensor of 255 rows, 32 columns and 255 outputs a row would be larger.
const MOST_REPORT_BYTES: usize = 64 * 1024;

/// Line of bytes to a device.
pub trait Wire: Read + Write {
    /// Lets reads end after `timeout` if nothing has come.
    fn set_read_timeout(&mut self, timeout: Duration) -> std::io::Result<()>;
}

impl Wire for TcpStream {
    fn set_read_timeout(&mut self, timeout: Duration) -> std::io::Result<()> {
        TcpStream::set_read_timeout(self, Some(timeout))
    }
}

/// Host's end of the line to a device.
pub struct Device {
    wire: Box<dyn Wire>,
    receiver: Receiver<Vec<u8>>,
    /// Bytes that were read and not looked at yet.
    pending: VecDeque<u8>,
    number: u16,
    /// Flag that ends waiting with [`Error::Interrupted`] when it is set, if there is one.
    pub stop: Option<Arc<AtomicBool>>,
    /// Longest time that an answer may take.
    pub patience: Duration,
    /// Number of frames of bytes that arrived damaged. The first one does not count: it may have begun before anybody
    /// listened.
    pub damaged: u64,
    /// What came last since a request was sent.
    heard: Heard,
    /// Whether the end of a frame has been heard.
    is_in_step: bool,
    /// Number of requests that had to be sent again.
    pub repeated: u64,
}

impl Device {
    /// Device on `wire`; nothing is sent yet.
    pub fn new(mut wire: impl Wire + 'static) -> Result<Self> {
        wire.set_read_timeout(look::GLANCE)?;
        let receiver = Receiver::new(vec![0; MOST_REPORT_BYTES]);
        let pending = VecDeque::new();
        Ok(Self {
            wire: Box::new(wire),
            receiver,
            pending,
            // Answers to a host before this one may still come: they shall not have this one's numbers.
            number: RandomState::new().build_hasher().finish() as u16,
            stop: None,
            patience: ANSWER,
            damaged: 0,
            heard: Heard::Nothing,
            is_in_step: false,
            repeated: 0,
        })
    }

    /// Sends `bytes` as they are.
    fn send_raw(&mut self, bytes: &[u8]) -> Result<()> {
        let (mut rest, start) = (bytes, Instant::now());
        while !rest.is_empty() {
            self.check_stop()?;
            match self.wire.write(rest) {
                Ok(0) => return Err(std::io::Error::from(ErrorKind::WriteZero).into()),
                Ok(count) => rest = &rest[count..],
                // A slow line takes them little by little.
                Err(cause) if look::is_timeout(&cause) && start.elapsed() < SLOWEST_WRITE => {}
                Err(cause) => return Err(cause.into()),
            }
        }
        Ok(self.wire.flush()?)
    }

    /// Sends a request with a new number, and returns the number.
    pub fn send(&mut self, request: &Request<'_>) -> Result<u16> {
        self.number = self.number.checked_add(1).unwrap_or(packet::UNASKED + 1);
        self.send_raw(&request_bytes(self.number, request)?)?;
        Ok(self.number)
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
                    Some(_) => Err(PacketError::Damaged),
                    None => continue,
                };
                let was_in_step = mem::replace(&mut self.is_in_step, true);
                match report {
                    Ok(report) => {
                        self.heard = Heard::Reports;
                        if let Some(answer) = read(report.number, &report.body) {
                            return Ok(Some(answer));
                        }
                    }
                    Err(cause) => {
                        self.heard = match cause {
                            PacketError::OtherVersion { version, .. } => {
                                Heard::OtherVersion(version)
                            }
                            PacketError::NotAMessage { .. } => Heard::UnknownMessage,
                            PacketError::Damaged => Heard::Noise,
                        };
                        self.damaged += u64::from(was_in_step);
                    }
                }
            }
            if is_last_look {
                return Ok(None);
            }
            self.check_stop()?;
            let count = look::read(&mut *self.wire, &mut bytes)?;
            self.pending.extend(&bytes[..count]);
            if count > 0 && self.heard == Heard::Nothing {
                self.heard = Heard::Noise;
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
        self.heard = Heard::Nothing;
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
        Err(Error::NoAnswer { attempts: ATTEMPTS, timeout, heard: self.heard })
    }

    /// Sends a `request` that no device of this protocol refuses, until the device answers.
    pub fn ask_plainly<T>(
        &mut self,
        request: &Request<'_>,
        read: impl Fn(&Report<'_>) -> Option<T>,
    ) -> Result<T> {
        self.ask(request, self.patience, read)?.map_err(Error::Refused)
    }

    /// Asks the device for its identity.
    pub fn identify(&mut self) -> Result<DeviceIdentity> {
        self.ask_plainly(&Request::Identify, |report| match report {
            Report::Identity(identity) => Some(identity.into()),
            _ => None,
        })
    }

    /// Asks for the device's counters.
    pub fn statistics(&mut self) -> Result<taxel_firmware::link::message::Statistics> {
        self.ask_plainly(&Request::Statistics, |report| match report {
            Report::Statistics(statistics) => Some(*statistics),
            _ => None,
        })
    }

    /// Lets the device's readout test itself.
    pub fn diagnose(&mut self) -> Result<taxel_firmware::readout::Diagnosis> {
        self.ask_plainly(&Request::Diagnose, |report| match report {
            Report::Diagnosis(diagnosis) => Some(*diagnosis),
            _ => None,
        })
    }

    /// Gives the device a baseline in Ω, one number a reading of its model.
    pub fn set_baseline(&mut self, baseline_ohm: &[f32]) -> Result<()> {
        let request = Request::SetBaseline { readings_ohm: Floats::new(baseline_ohm) };
        self.ask_plainly(&request, |report| matches!(report, Report::Baseline { .. }).then_some(()))
    }

    /// Restarts the device and waits until it answers again.
    pub fn restart(&mut self) -> Result<DeviceIdentity> {
        self.restart_by(&Request::Restart)
    }

    /// Lets the chip reset while its supply is too low, for good; and restarts it.
    pub fn set_brown_out(&mut self) -> Result<DeviceIdentity> {
        self.restart_by(&Request::SetBrownOut)
    }

    fn restart_by(&mut self, request: &Request<'_>) -> Result<DeviceIdentity> {
        self.ask_plainly(request, |report| matches!(report, Report::Restarting).then_some(()))?;
        // Bytes that arrive while it starts are lost, which is no fault of the line. An emulated device may take longer
        // to answer than a board does to start.
        let (patience, repeated) = (self.patience, self.repeated);
        let start = Instant::now();
        self.patience = START;
        let mut identity = self.identify();
        while identity.is_err() && start.elapsed() < patience {
            self.patience *= 2;
            identity = self.identify();
        }
        (self.patience, self.repeated) = (patience, repeated);
        identity
    }
}

/// Bytes of a request, framed for the line.
pub fn request_bytes(number: u16, request: &Request<'_>) -> Result<Vec<u8>> {
    let mut buffer = [0; MOST_REQUEST_BYTES];
    let packet = packet::encode(number, request, &mut buffer).ok_or_else(|| {
        Error::failed(format!("a request longer than {MOST_REQUEST_BYTES} bytes"))
    })?;
    Ok(framed(packet))
}

/// A packet as bytes on the line.
fn framed(packet: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(packet.len() + 8);
    cobs::encode(packet, |piece| {
        bytes.extend_from_slice(piece);
        true
    });
    bytes
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use taxel_core::checksum::CRC_32;

    use super::*;

    impl Wire for Cursor<Vec<u8>> {
        fn set_read_timeout(&mut self, _: Duration) -> std::io::Result<()> {
            Ok(())
        }
    }

    fn report() -> Vec<u8> {
        framed(packet::encode(0, &Report::Restarting, &mut [0; 64]).expect("room"))
    }

    #[test]
    fn a_report_that_began_before_anybody_listened_is_not_damaged() {
        let whole = report();
        let mut cut = whole.clone();
        cut.remove(2);
        for (first, second, damaged) in
            [(&whole[3..], &whole[..], 0), (&whole, &cut, 1), (&cut, &cut, 1)]
        {
            let mut device = Device::new(Cursor::new([first, second].concat())).unwrap();
            let heard = device.hear(Instant::now() + Duration::from_secs(1), |_, _| None::<()>);
            assert!(matches!(heard, Err(Error::Closed)));
            assert_eq!(device.damaged, damaged);
        }
    }

    /// Line that answers every request with the same bytes.
    struct Deaf(Vec<u8>);

    impl Read for Deaf {
        fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
            let count = self.0.len();
            bytes[..count].copy_from_slice(&self.0);
            if count == 0 { Err(ErrorKind::TimedOut.into()) } else { Ok(count) }
        }
    }

    impl Write for Deaf {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Wire for Deaf {
        fn set_read_timeout(&mut self, _: Duration) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_device_that_does_not_answer_is_told_by_what_comes_instead() {
        let packet =
            |start: &[u8]| framed(&[start, &CRC_32.checksum(start).to_le_bytes()].concat());
        let version = packet::PROTOCOL_VERSION;
        let other_version = format!(
            "it speaks version {} of the link, and this program version {version}",
            version + 1
        );
        for (bytes, says) in [
            (vec![], "it sends nothing"),
            (vec![0x55; 40], "it sends bytes that are not packets: check the speed"),
            (packet(&[version + 1, 0, 3]), &other_version),
            (report(), "it sends reports, but no answer in time"),
            (packet(&[version, 0, 120]), "messages that this program does not know"),
        ] {
            let mut device = Device::new(Deaf(bytes)).unwrap();
            device.patience = Duration::from_millis(2);
            let message = device.identify().unwrap_err().to_string();
            assert!(message.contains(says), "{message}");
        }
    }
}

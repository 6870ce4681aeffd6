//! A readout whose pins, converters and delays are at the other end of a serial line.
//!
//! An emulator has no sensor, and neither has a bare board on a desk. Here every transaction goes to
//! the host, where virtual hardware carries it out. The readout's code is the same as with a sensor.
//!
//! Bytes on the line: setting a pin is one byte, 0x80 + 2 · number + level. A wait is 0x02 and its nanoseconds
//! (u32, little-endian). An SPI transaction is 0x01, the chip's number, the count of bytes and these bytes; the
//! host replies with as many bytes. It replies to nothing else.
//!
//! The crate is part of a test rig: the emulator's image sends transactions, and host-sim's virtual board carries
//! them out.
#![cfg_attr(not(test), no_std)]

use core::cell::{Cell, RefCell};

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use firmware::platform::Port;

const TRANSFER: u8 = 0x01;
const WAIT: u8 = 0x02;
const PIN: u8 = 0x80;
/// Largest SPI transaction, in bytes.
const LONGEST_TRANSFER: usize = 16;
/// Longest time in µs without progress on the line. The other end may run on a busy computer; a reply that comes
/// later would be taken for the next transaction's.
const STALL_US: u32 = 2_000_000;

/// Why a transaction failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RemoteError {
    /// The other end accepts no bytes, or sends none.
    Silent,
    /// The SPI transaction is not one transfer in place, or has more than 16 bytes.
    Unsupported,
}

impl digital::Error for RemoteError {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl spi::Error for RemoteError {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

/// The line to the host, which gives pins, SPI devices and delays.
///
/// Once the line was silent it stays failed until the program restarts: a late reply would be taken for the next
/// transaction's.
#[derive(Debug)]
pub struct Remote<P> {
    port: RefCell<P>,
    failed: Cell<bool>,
}

impl<P: Port> Remote<P> {
    /// Makes a line of `port`, whose other end has the parts.
    pub const fn new(port: P) -> Self {
        Self { port: RefCell::new(port), failed: Cell::new(false) }
    }

    /// The pin with this number, from 0 to 63.
    pub fn pin(&self, number: u8) -> RemotePin<'_, P> {
        RemotePin { remote: self, number: number & 0x3F }
    }

    /// The SPI device with this number.
    pub fn spi(&self, chip: u8) -> RemoteSpi<'_, P> {
        RemoteSpi { remote: self, chip }
    }

    /// Delays by the clock of the other end.
    pub fn delay(&self) -> RemoteDelay<'_, P> {
        RemoteDelay { remote: self }
    }

    /// Sends `bytes`, then fills `answer` with received bytes.
    fn exchange(&self, bytes: &[u8], answer: &mut [u8]) -> Result<(), RemoteError> {
        let mut port = self.port.try_borrow_mut().map_err(|_| RemoteError::Silent)?;
        if self.failed.get() {
            return Err(RemoteError::Silent);
        }
        let outcome = exchange(&mut *port, bytes, answer);
        self.failed.set(outcome.is_err());
        outcome
    }
}

fn exchange<P: Port>(port: &mut P, bytes: &[u8], answer: &mut [u8]) -> Result<(), RemoteError> {
    for byte in bytes {
        in_time(port, |port| port.send(*byte).then_some(()))?;
    }
    for place in answer {
        *place = in_time(port, P::receive)?;
    }
    Ok(())
}

/// Tries until there is a result, or until the line makes no progress for too long.
fn in_time<P: Port, T>(
    port: &mut P,
    mut attempt: impl FnMut(&mut P) -> Option<T>,
) -> Result<T, RemoteError> {
    if let Some(answer) = attempt(port) {
        return Ok(answer);
    }
    let start_us = port.now_us();
    while port.now_us().wrapping_sub(start_us) < STALL_US {
        if let Some(answer) = attempt(port) {
            return Ok(answer);
        }
    }
    Err(RemoteError::Silent)
}

/// A pin at the other end.
#[derive(Debug)]
pub struct RemotePin<'r, P> {
    remote: &'r Remote<P>,
    number: u8,
}

impl<P> digital::ErrorType for RemotePin<'_, P> {
    type Error = RemoteError;
}

impl<P: Port> OutputPin for RemotePin<'_, P> {
    fn set_low(&mut self) -> Result<(), RemoteError> {
        self.remote.exchange(&[PIN | self.number << 1], &mut [])
    }

    fn set_high(&mut self) -> Result<(), RemoteError> {
        self.remote.exchange(&[PIN | self.number << 1 | 1], &mut [])
    }
}

/// An SPI device at the other end.
#[derive(Debug)]
pub struct RemoteSpi<'r, P> {
    remote: &'r Remote<P>,
    chip: u8,
}

impl<P> spi::ErrorType for RemoteSpi<'_, P> {
    type Error = RemoteError;
}

impl<P: Port> SpiDevice for RemoteSpi<'_, P> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), RemoteError> {
        let [Operation::TransferInPlace(bytes)] = operations else {
            return Err(RemoteError::Unsupported);
        };
        if bytes.len() > LONGEST_TRANSFER {
            return Err(RemoteError::Unsupported);
        }
        self.remote.exchange(&[TRANSFER, self.chip, bytes.len() as u8], &mut [])?;
        for byte in bytes.iter() {
            self.remote.exchange(&[*byte], &mut [])?;
        }
        self.remote.exchange(&[], bytes)
    }
}

/// Delays by the clock of the other end: the wait happens there, not here.
#[derive(Debug)]
pub struct RemoteDelay<'r, P> {
    remote: &'r Remote<P>,
}

impl<P: Port> DelayNs for RemoteDelay<'_, P> {
    fn delay_ns(&mut self, ns: u32) {
        let [a, b, c, d] = ns.to_le_bytes();
        // A failed line also fails the next transaction, which can report it.
        let _ = self.remote.exchange(&[WAIT, a, b, c, d], &mut []);
    }
}

/// A transaction that the other end is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked<'b> {
    /// Set a pin.
    Pin {
        /// Number of the pin.
        number: u8,
        /// Whether its level is high.
        high: bool,
    },
    /// Carry out an SPI transaction, and reply with as many bytes.
    Transfer {
        /// Number of the SPI device.
        chip: u8,
        /// Bytes to send to the device.
        bytes: &'b [u8],
    },
    /// Let time pass.
    Wait {
        /// Time in ns.
        ns: u32,
    },
}

impl<'b> Asked<'b> {
    /// Parses the first transaction in `bytes`, and returns it with the bytes behind it; `None` while it is not
    /// complete.
    ///
    /// # Errors
    /// [`UnknownByte`]: the first byte starts no transaction.
    pub fn parse(bytes: &'b [u8]) -> Result<Option<(Self, &'b [u8])>, UnknownByte> {
        match *bytes {
            [pin @ (PIN..=u8::MAX), ref rest @ ..] => {
                let (number, high) = (pin >> 1 & 0x3F, pin & 1 == 1);
                Ok(Some((Self::Pin { number, high }, rest)))
            }
            [TRANSFER, chip, count, ref rest @ ..] => {
                let whole = rest.split_at_checked(count.into());
                Ok(whole.map(|(bytes, rest)| (Self::Transfer { chip, bytes }, rest)))
            }
            [WAIT, a, b, c, d, ref rest @ ..] => {
                Ok(Some((Self::Wait { ns: u32::from_le_bytes([a, b, c, d]) }, rest)))
            }
            [] | [TRANSFER | WAIT, ..] => Ok(None),
            [other, ..] => Err(UnknownByte(other)),
        }
    }
}

/// A byte that starts no transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnknownByte(pub u8);

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    #[derive(Default)]
    struct Ends {
        sent: Vec<u8>,
        answers: VecDeque<u8>,
        now_us: u32,
        deaf: bool,
    }

    impl Port for Ends {
        fn now_us(&mut self) -> u32 {
            self.now_us += 1;
            self.now_us
        }

        fn receive(&mut self) -> Option<u8> {
            self.answers.pop_front()
        }

        fn send(&mut self, byte: u8) -> bool {
            if !self.deaf {
                self.sent.push(byte);
            }
            !self.deaf
        }
    }

    #[test]
    fn what_is_asked_for_arrives_and_is_answered() {
        let remote = Remote::new(Ends { answers: [7, 8, 9].into(), ..Ends::default() });
        remote.pin(63).set_high().unwrap();
        remote.pin(5).set_low().unwrap();
        remote.delay().delay_ns(0x0102_0304);
        let mut bytes = [1, 2, 3];
        remote.spi(2).transfer_in_place(&mut bytes).unwrap();
        assert_eq!(bytes, [7, 8, 9]);

        let sent = remote.port.into_inner().sent;
        let mut rest = &sent[..];
        let mut asked = Vec::new();
        while let Some((one, behind)) = Asked::parse(rest).unwrap() {
            asked.push(one);
            rest = behind;
        }
        assert_eq!(
            asked,
            [
                Asked::Pin { number: 63, high: true },
                Asked::Pin { number: 5, high: false },
                Asked::Wait { ns: 0x0102_0304 },
                Asked::Transfer { chip: 2, bytes: &[1, 2, 3] },
            ]
        );
        assert!(rest.is_empty());
        for length in 0..sent.len() {
            // A prefix is never taken for another transaction.
            let mut rest = &sent[..length];
            let mut found = 0;
            while let Some((one, behind)) = Asked::parse(rest).unwrap() {
                assert_eq!(one, asked[found]);
                found += 1;
                rest = behind;
            }
        }
        assert_eq!(Asked::parse(&[0x55]), Err(UnknownByte(0x55)));
    }

    #[test]
    fn silence_ends_in_an_error_not_in_a_wait() {
        let remote = Remote::new(Ends::default());
        assert_eq!(remote.spi(0).transfer_in_place(&mut [1]), Err(RemoteError::Silent));
        // This byte comes too late: it must not be taken for a reply.
        remote.port.borrow_mut().answers.push_back(7);
        assert_eq!(remote.spi(0).transfer_in_place(&mut [1]), Err(RemoteError::Silent));
        let remote = Remote::new(Ends { deaf: true, ..Ends::default() });
        assert_eq!(remote.pin(1).set_high(), Err(RemoteError::Silent));
        let remote = Remote::new(Ends::default());
        assert_eq!(remote.spi(0).write(&[1]), Err(RemoteError::Unsupported));
        assert_eq!(remote.spi(0).transfer_in_place(&mut [0; 17]), Err(RemoteError::Unsupported));
    }
}

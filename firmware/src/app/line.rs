//! Reports on their way to the host.

use crate::link::message::Report;
use crate::link::{cobs, packet};
use crate::platform::Port;

/// Longest that a report may make no progress; then it is given up.
const STALL_US: u32 = 50_000;

/// The board's serial line, with room for one report.
pub struct Line<'m, P, const BYTES: usize> {
    platform: P,
    buffer: &'m mut [u8; BYTES],
}

impl<'m, P: Port, const BYTES: usize> Line<'m, P, BYTES> {
    pub fn new(platform: P, buffer: &'m mut [u8; BYTES]) -> Self {
        Self { platform, buffer }
    }

    pub fn platform(&mut self) -> &mut P {
        &mut self.platform
    }

    /// Sends one report; `false` if the host's side takes no more bytes.
    #[must_use]
    pub fn send(&mut self, number: u16, report: &Report<'_>) -> bool {
        let Some(bytes) = packet::encode(number, report, self.buffer) else { return false };
        let platform = &mut self.platform;
        cobs::encode(bytes, |byte| {
            if platform.send(byte) {
                return true;
            }
            let start_us = platform.now_us();
            while platform.now_us().wrapping_sub(start_us) < STALL_US {
                if platform.send(byte) {
                    return true;
                }
            }
            false
        })
    }
}

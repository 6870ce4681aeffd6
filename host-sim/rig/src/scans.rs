//! Scans of a sensor as they come, whatever sends them: a Taxel device, or another sensor on a serial line.
//!
//! A [`Source`] takes them in; a [`Listener`] does so in the background, and keeps them until somebody takes them.

use std::time::Instant;

use crate::error::Result;

mod device;
mod lines;
mod marked;
mod listener;

pub use device::{Assembler, DeviceScans, Sent};
pub use lines::NumberLines;
pub use listener::Listener;
pub use marked::MarkedBytes;

/// What a sensor told of one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Its number, which wraps around to 0.
    pub number: u32,
    /// Time at which it began in µs: by the device's clock, or since the source was opened.
    pub start_us: u64,
    /// Time at which it was heard.
    pub heard: Instant,
    /// Readings, row after row, in the sensor's unit; empty if they are not sent.
    pub readings: Vec<f32>,
    /// What the device made of them, if it sends that.
    pub estimate: Option<ScanEstimate>,
    /// Events of touch that the device has told since the scan before, in words.
    pub events: Vec<String>,
}

/// What a device decoded a scan to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScanEstimate {
    /// Outputs, row after row.
    pub outputs: Vec<f32>,
    /// How the decoding of each row ended, as numbers of `docs/link.md`.
    pub row_status: Vec<u8>,
    /// Flags of `docs/link.md`.
    pub flags: u8,
    /// Standard deviation of each output; empty if it is not sent.
    pub deviations: Vec<f32>,
    /// Novelty in nats, if it is sent.
    pub novelty: Option<f32>,
}

impl Scan {
    /// Whether `last`, heard before this one, is of a time before the sender started anew.
    pub fn is_after_restart(&self, last: &Self) -> bool {
        self.number.wrapping_sub(last.number).cast_signed() <= 0 || self.start_us <= last.start_us
    }

    /// Number of scans between `last` and this one that never came; 0 if the sender has started anew.
    pub fn lost_since(&self, last: u32) -> u32 {
        match self.number.wrapping_sub(last).cast_signed() {
            steps @ 1.. => steps.cast_unsigned() - 1,
            _ => 0,
        }
    }
}

/// Where scans come from.
pub trait Source {
    /// Passes scans to `take` until `deadline`.
    ///
    /// # Errors
    /// If the line fails, or work is interrupted.
    fn hear(&mut self, deadline: Instant, take: &mut dyn FnMut(Scan)) -> Result<()>;

    /// Number of bytes that came since the last scan and are none.
    fn refused(&self) -> u64 {
        0
    }

    /// Tells the sensor its readings at rest, one a reading, if it can use them.
    ///
    /// # Errors
    /// If it refuses them, or does not answer.
    fn set_baseline(&mut self, _readings: &[f32]) -> Result<()> {
        Ok(())
    }

    /// Lets the sensor do again what it does without a listener.
    fn close(&mut self) {}
}

#[cfg(test)]
mod tests;

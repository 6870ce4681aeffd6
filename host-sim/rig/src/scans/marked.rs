//! Scans of a sensor that sends two marking bytes and then one byte a reading: FlexiTac's firmware.

use std::time::Instant;

use super::{Scan, Source};
use crate::device::{Wire, look};
use crate::error::Result;

/// What stands in front of each frame.
const MARK: [u8; 2] = [0xAA, 0x55];

/// Frames of FlexiTac's firmware: 0xAA, 0x55, then the upper eight bits of the converter for each reading, row after row.
///
/// The mark may also occur among readings. So a frame is believed only once the next one's mark stands behind it.
pub struct MarkedBytes {
    wire: Box<dyn Wire>,
    pending: Vec<u8>,
    count: usize,
    start: Instant,
    scans: u32,
    refused: u64,
}

impl MarkedBytes {
    /// Frames of `count` readings that come over `wire`.
    pub fn new(mut wire: impl Wire + 'static, count: usize) -> Result<Self> {
        wire.set_read_timeout(look::GLANCE)?;
        let wire = Box::new(wire);
        Ok(Self { wire, pending: vec![], count, start: Instant::now(), scans: 0, refused: 0 })
    }

    /// Takes the next frame out of the bytes that came, and drops what is none.
    fn next_frame(&mut self) -> Option<Vec<f32>> {
        let length = MARK.len() + self.count;
        let is_mark = |at: usize| self.pending[at..].starts_with(&MARK);
        let last = self.pending.len().checked_sub(length + MARK.len())?;
        let start = (0..=last).find(|at| is_mark(*at) && is_mark(at + length));
        let frame = start.map(|start| {
            self.pending[start + MARK.len()..start + length]
                .iter()
                .map(|byte| f32::from(*byte))
                .collect()
        });
        self.refused += start.unwrap_or(last + 1) as u64;
        self.pending.drain(..start.map_or(last + 1, |start| start + length));
        frame
    }
}

impl Source for MarkedBytes {
    fn hear(&mut self, deadline: Instant, take: &mut dyn FnMut(Scan)) -> Result<()> {
        let mut bytes = [0; 4096];
        loop {
            let count = look::read(&mut *self.wire, &mut bytes)?;
            self.pending.extend(&bytes[..count]);
            while let Some(readings) = self.next_frame() {
                // Bytes before it are of frames that are lost, but for those before anybody listened.
                if self.scans > 0 {
                    let length = (MARK.len() + self.count) as f64;
                    let lost = (self.refused as f64 / length).round();
                    self.scans = self.scans.wrapping_add(lost as u32);
                }
                self.refused = 0;
                let heard = Instant::now();
                let start_us = heard.duration_since(self.start).as_micros() as u64;
                take(Scan {
                    number: self.scans,
                    start_us,
                    heard,
                    readings,
                    estimate: None,
                    events: vec![],
                });
                self.scans = self.scans.wrapping_add(1);
            }
            if Instant::now() >= deadline {
                return Ok(());
            }
        }
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}

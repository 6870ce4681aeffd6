//! Scans of a sensor that prints a line of numbers for each.

use std::time::Instant;

use super::{Scan, Source};
use crate::device::{Wire, look};
use crate::error::Result;

/// Longest line in bytes: 255 × 32 readings of 15 characters.
const LONGEST: usize = 128 * 1024;

/// Lines of numbers between commas, semicolons, tabs or blanks. Lines that hold anything else, such as names, and those with
/// another count of numbers are skipped.
pub struct NumberLines {
    wire: Box<dyn Wire>,
    line: Vec<u8>,
    /// Whether the line began while somebody listened.
    is_whole: bool,
    /// Numbers of a line; 0 before two successive ones had as many.
    count: usize,
    /// Numbers of the last line.
    last: usize,
    start: Instant,
    scans: u32,
    refused: u64,
}

impl NumberLines {
    /// Lines that come over `wire`, of `count` numbers each; 0 takes that of two successive lines.
    pub fn new(mut wire: impl Wire + 'static, count: usize) -> Result<Self> {
        wire.set_read_timeout(look::GLANCE)?;
        let wire = Box::new(wire);
        Ok(Self {
            wire,
            line: vec![],
            is_whole: false,
            count,
            last: 0,
            start: Instant::now(),
            scans: 0,
            refused: 0,
        })
    }

    /// The scan of a line that has ended, if it is one.
    fn scan(&mut self) -> Option<Scan> {
        let readings = numbers(str::from_utf8(&self.line).ok()?)?;
        // A sensor may print other numbers while it starts.
        if self.count == 0 && self.last == readings.len() {
            self.count = readings.len();
        }
        self.last = readings.len();
        (readings.len() == self.count).then(|| {
            let number = self.scans;
            self.scans = number.wrapping_add(1);
            let heard = Instant::now();
            let start_us = heard.duration_since(self.start).as_micros() as u64;
            Scan { number, start_us, heard, readings, estimate: None, events: vec![] }
        })
    }
}

impl Source for NumberLines {
    fn hear(&mut self, deadline: Instant, take: &mut dyn FnMut(Scan)) -> Result<()> {
        let mut bytes = [0; 4096];
        loop {
            let count = look::read(&mut *self.wire, &mut bytes)?;
            for byte in &bytes[..count] {
                self.refused += 1;
                if *byte == b'\n' {
                    let is_known = self.count > 0;
                    match self.is_whole.then(|| self.scan()).flatten() {
                        Some(scan) => {
                            self.refused = 0;
                            take(scan);
                        }
                        // A line that is cut or garbled is a scan that is lost.
                        None if self.is_whole && is_known && !self.line.trim_ascii().is_empty() => {
                            self.scans = self.scans.wrapping_add(1);
                        }
                        None => {}
                    }
                    (self.is_whole, self.line) = (true, vec![]);
                } else if self.line.len() < LONGEST {
                    self.line.push(*byte);
                }
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

/// The numbers of a line; `None` if there is none, or something else. An empty field between commas is a missing reading.
fn numbers(line: &str) -> Option<Vec<f32>> {
    let line = line.trim();
    let separator = [',', ';', '\t'].into_iter().find(|it| line.contains(*it));
    let number = |field: &str| match field.trim() {
        "" => Some(f32::NAN),
        text => text.parse().ok(),
    };
    let found: Option<Vec<f32>> = match separator {
        Some(separator) => line.split(separator).map(number).collect(),
        None => line.split_whitespace().map(number).collect(),
    };
    found.filter(|numbers| numbers.iter().any(|number| !number.is_nan()))
}

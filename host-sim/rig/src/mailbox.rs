//! Mailbox: a serial line through memory that this program shares with the image in the emulator.
//!
//! QEMU keeps the machine's PSRAM in a file. This end of the line reads and writes that file; the image's
//! end (`firmware/qemu/src/mailbox.rs`, which has the layout) reads and writes the memory: two rings of bytes, each
//! with the position of its writer and that of its reader.
//!
//! The system may copy the two bytes of a position one after the other. Both ends stay correct all the same:
//!
//! - A position is written in two steps, the lower byte first. In between it is at most the new position, so
//!   the image takes no byte that is not there yet. It may be less than the old position; the image then
//!   waits.
//! - A position is read until two readings agree. The position only grows, and by less than one round
//!   while it is read. So an upper byte that is the same in both readings was valid between them; with the
//!   lower byte of the second reading it makes a position that the image has reached.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::atomic::{Ordering, fence};
use std::thread;
use std::time::{Duration, Instant};

use crate::device::Wire;

/// First bytes of the file, by which the image knows that there is a mailbox.
const MAGIC: [u8; 8] = *b"taxelbox";
/// Size of each ring in bytes: a power of two, at most 2¹⁵.
const CAPACITY: u16 = 0x4000;
/// Size of the machine's PSRAM in bytes, and so of the file.
pub const FILE_BYTES: u64 = 16 << 20;

/// First pause while there is nothing to do; each further pause is twice as long.
const SHORTEST_PAUSE: Duration = Duration::from_micros(20);
/// Longest pause, which delays the first answer after a quiet time.
const LONGEST_PAUSE: Duration = Duration::from_millis(1);

/// Layout of a ring in the file: offsets in bytes.
struct Ring {
    /// Offset of the writer's position.
    written: u64,
    /// Offset of the reader's position.
    read: u64,
    bytes: u64,
}

/// Ring from this program to the image.
const TO_IMAGE: Ring = Ring { written: 0x40, read: 0x80, bytes: 0x1000 };
/// Ring from the image to this program.
const TO_HOST: Ring = Ring { written: 0xC0, read: 0x100, bytes: 0x5000 };

/// Bytes of memory that another program reads and writes at the same time.
pub trait SharedBytes {
    /// Fills `bytes` with the memory from offset `place` on.
    fn read_at(&mut self, bytes: &mut [u8], place: u64) -> io::Result<()>;

    /// Writes `bytes` to the memory from offset `place` on.
    fn write_at(&mut self, bytes: &[u8], place: u64) -> io::Result<()>;
}

impl SharedBytes for File {
    fn read_at(&mut self, bytes: &mut [u8], place: u64) -> io::Result<()> {
        self.seek(SeekFrom::Start(place))?;
        self.read_exact(bytes)
    }

    fn write_at(&mut self, bytes: &[u8], place: u64) -> io::Result<()> {
        self.seek(SeekFrom::Start(place))?;
        self.write_all(bytes)
    }
}

/// Host's end of the line.
#[derive(Debug)]
pub struct Mailbox<S = File> {
    shared: S,
    /// Position up to which bytes were sent.
    written: u16,
    /// Position up to which bytes were received.
    read: u16,
    timeout: Duration,
}

impl Mailbox {
    /// Lays out a mailbox in a new file at `path`, before the emulator is started with it.
    ///
    /// # Errors
    /// Error of the system; a file that exists already is one.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(path)?;
        file.set_len(FILE_BYTES)?;
        Self::new(file)
    }
}

impl<S: SharedBytes> Mailbox<S> {
    /// Lays out a mailbox in `shared`, which holds zeros.
    pub fn new(mut shared: S) -> io::Result<Self> {
        shared.write_at(&MAGIC, 0)?;
        Ok(Self { shared, written: 0, read: 0, timeout: Duration::ZERO })
    }

    /// Reads a position that the image writes.
    fn position(&mut self, place: u64) -> io::Result<u16> {
        let mut read = || {
            let mut bytes = [0; 2];
            self.shared.read_at(&mut bytes, place)?;
            fence(Ordering::SeqCst);
            Ok::<_, io::Error>(u16::from_le_bytes(bytes))
        };
        let mut before = read()?;
        loop {
            let now = read()?;
            if now == before {
                return Ok(now);
            }
            before = now;
        }
    }

    /// Writes a position that the image reads: the lower byte first.
    fn set_position(&mut self, place: u64, position: u16) -> io::Result<()> {
        let [lower, upper] = position.to_le_bytes();
        fence(Ordering::SeqCst);
        self.shared.write_at(&[lower], place)?;
        fence(Ordering::SeqCst);
        self.shared.write_at(&[upper], place + 1)
    }

    /// Number of bytes between two positions of a ring.
    fn between(written: u16, read: u16) -> io::Result<u16> {
        let bytes = written.wrapping_sub(read);
        if bytes > CAPACITY {
            return Err(io::Error::new(
                ErrorKind::InvalidData,
                format!("positions {written} and {read} of the mailbox do not fit together"),
            ));
        }
        Ok(bytes)
    }

    /// Receives the bytes that are there, without waiting.
    fn try_read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let there = Self::between(self.position(TO_HOST.written)?, self.read)?;
        let count = bytes.len().min(there.into());
        let (first, second) = split(count, self.read);
        let (start, rest) = bytes[..count].split_at_mut(first);
        self.shared.read_at(start, TO_HOST.bytes + u64::from(self.read % CAPACITY))?;
        if second > 0 {
            self.shared.read_at(rest, TO_HOST.bytes)?;
        }
        if count > 0 {
            self.read = self.read.wrapping_add(count as u16);
            self.set_position(TO_HOST.read, self.read)?;
        }
        Ok(count)
    }

    /// Sends as many bytes as there is room for, without waiting.
    fn try_write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let there = Self::between(self.written, self.position(TO_IMAGE.read)?)?;
        let count = bytes.len().min((CAPACITY - there).into());
        let (first, second) = split(count, self.written);
        let (start, rest) = bytes[..count].split_at(first);
        self.shared.write_at(start, TO_IMAGE.bytes + u64::from(self.written % CAPACITY))?;
        if second > 0 {
            self.shared.write_at(rest, TO_IMAGE.bytes)?;
        }
        if count > 0 {
            self.written = self.written.wrapping_add(count as u16);
            self.set_position(TO_IMAGE.written, self.written)?;
        }
        Ok(count)
    }

    /// Tries until something was done or the time is over, with growing pauses.
    fn wait(
        &mut self,
        mut attempt: impl FnMut(&mut Self) -> io::Result<usize>,
    ) -> io::Result<usize> {
        let start = Instant::now();
        let mut pause = SHORTEST_PAUSE;
        loop {
            let count = attempt(self)?;
            if count > 0 {
                return Ok(count);
            }
            let left = self.timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            thread::sleep(pause.min(left));
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }
}

/// Splits `count` bytes from `position` on into those before the ring's end and those at its start.
fn split(count: usize, position: u16) -> (usize, usize) {
    let before_end = usize::from(CAPACITY - position % CAPACITY);
    let first = count.min(before_end);
    (first, count - first)
}

impl<S: SharedBytes> Read for Mailbox<S> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if bytes.is_empty() {
            return Ok(0);
        }
        self.wait(|mailbox| mailbox.try_read(bytes))
    }
}

impl<S: SharedBytes> Write for Mailbox<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.is_empty() {
            return Ok(0);
        }
        self.wait(|mailbox| mailbox.try_write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<S: SharedBytes> Wire for Mailbox<S> {
    fn set_read_timeout(&mut self, timeout: Duration) -> io::Result<()> {
        self.timeout = timeout;
        Ok(())
    }
}

#[cfg(test)]
mod tests;

//! Mailbox between two threads, with the image's own code at the device's end.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::{Arc, Mutex};

use taxel_rig::mailbox::{Mailbox, SharedBytes};

#[path = "../../../../firmware/qemu/src/mailbox.rs"]
#[allow(unreachable_pub, reason = "the image's file")]
mod image;

/// Memory that both ends share: the image takes two bytes at once, the host one.
#[derive(Clone)]
pub struct Memory(Arc<Mutex<Vec<u8>>>);

impl SharedBytes for Memory {
    fn read_at(&mut self, bytes: &mut [u8], place: u64) -> io::Result<()> {
        for (byte, place) in bytes.iter_mut().zip(place as usize..) {
            *byte = self.0.lock().unwrap()[place];
        }
        Ok(())
    }

    fn write_at(&mut self, bytes: &[u8], place: u64) -> io::Result<()> {
        for (byte, place) in bytes.iter().zip(place as usize..) {
            self.0.lock().unwrap()[place] = *byte;
        }
        Ok(())
    }
}

impl image::SharedMemory for Memory {
    fn byte(&self, place: usize) -> u8 {
        self.0.lock().unwrap()[place]
    }

    fn set_byte(&mut self, place: usize, byte: u8) {
        self.0.lock().unwrap()[place] = byte;
    }

    fn number(&self, place: usize) -> u16 {
        let memory = self.0.lock().unwrap();
        u16::from_le_bytes([memory[place], memory[place + 1]])
    }

    fn set_number(&mut self, place: usize, number: u16) {
        self.0.lock().unwrap()[place..place + 2].copy_from_slice(&number.to_le_bytes());
    }

    /// Locks keep everything in order.
    fn barrier(&self) {}
}

/// The device's end, whose reads do not block and whose writes do.
pub struct End {
    mailbox: image::Mailbox<Memory>,
    memory: Memory,
}

impl End {
    /// Whether the other end is gone: only the two handles here are left.
    fn is_alone(&self) -> bool {
        Arc::strong_count(&self.memory.0) == 2
    }
}

impl Read for End {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let received = bytes.iter_mut().map_while(|place| {
            *place = self.mailbox.try_read()?;
            Some(())
        });
        match received.count() {
            0 if !self.is_alone() => Err(ErrorKind::WouldBlock.into()),
            count => Ok(count),
        }
    }
}

impl Write for End {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for byte in bytes {
            while !self.mailbox.try_write(*byte) {
                if self.is_alone() {
                    return Err(ErrorKind::BrokenPipe.into());
                }
                std::thread::yield_now();
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Both ends of a mailbox: the host's and the device's.
pub fn pair() -> (Mailbox<Memory>, End) {
    let memory = Memory(Arc::new(Mutex::new(vec![0; 0x9000])));
    let host = Mailbox::new(memory.clone()).unwrap();
    let mailbox = image::Mailbox::find(memory.clone()).expect("the host has laid it out");
    (host, End { mailbox, memory })
}

//! A serial line through memory that the image shares with a program on the host.
//!
//! QEMU's UART moves only one byte in each turn of its main loop; here a message takes no longer than its copy.
//! The memory holds two rings of bytes, one for each direction. Every ring has one writer, one reader and two
//! positions: the bytes written so far, and the bytes read so far, both modulo 2¹⁶, little-endian.
//!
//! The positions are kept in the shared memory alone, so that a restart of the image loses no byte.
//!
//! The host reaches the memory through a file, and its system may copy a position byte by byte. The image
//! can therefore see a position of which only the lower byte is new. Such a position is at most the new one,
//! so no byte is read too early or overwritten too soon. It may be less than the old one: then it lies
//! outside the ring, and the image waits.

/// The first bytes of the memory if the host has laid out a mailbox.
pub const MAGIC: [u8; 8] = *b"taxelbox";
/// Number of bytes that each ring holds: a power of two, at most 2¹⁵.
pub const CAPACITY: u16 = 0x4000;

/// Offsets of a ring's parts in the shared memory.
struct Ring {
    /// Offset of the writer's position.
    written: usize,
    /// Offset of the reader's position.
    read: usize,
    bytes: usize,
}

/// The ring for bytes from the host to the image.
const TO_IMAGE: Ring = Ring { written: 0x40, read: 0x80, bytes: 0x1000 };
/// The ring for bytes from the image to the host.
const TO_HOST: Ring = Ring { written: 0xC0, read: 0x100, bytes: 0x5000 };

impl Ring {
    /// Offset in the shared memory of the byte at `position`.
    fn place(&self, position: u16) -> usize {
        self.bytes + usize::from(position % CAPACITY)
    }
}

/// Memory that another program may read and write at the same time.
pub trait SharedMemory {
    /// Reads the byte at `place`.
    fn byte(&self, place: usize) -> u8;

    /// Writes the byte at `place`.
    fn set_byte(&mut self, place: usize, byte: u8);

    /// Reads the little-endian number at `place`, both bytes at once.
    fn number(&self, place: usize) -> u16;

    /// Writes the little-endian number at `place`, both bytes at once.
    fn set_number(&mut self, place: usize, number: u16);

    /// Keeps accesses in order: those before the barrier happen before those after it.
    fn barrier(&self);
}

/// The image's end of the serial line in shared memory.
pub struct Mailbox<M>(M);

impl<M: SharedMemory> Mailbox<M> {
    /// Finds the mailbox in `memory`; `None` if the host has laid out none.
    pub fn find(memory: M) -> Option<Self> {
        let is_there = MAGIC.iter().enumerate().all(|(place, byte)| memory.byte(place) == *byte);
        is_there.then_some(Self(memory))
    }

    /// Receives the next byte from the host; `None` if there is none yet.
    pub fn try_read(&mut self) -> Option<u8> {
        let memory = &mut self.0;
        let read = memory.number(TO_IMAGE.read);
        let unread = memory.number(TO_IMAGE.written).wrapping_sub(read);
        if unread == 0 || unread > CAPACITY {
            return None;
        }
        memory.barrier();
        let byte = memory.byte(TO_IMAGE.place(read));
        memory.barrier();
        memory.set_number(TO_IMAGE.read, read.wrapping_add(1));
        Some(byte)
    }

    /// Sends `byte`; returns `false`, and sends nothing, while the ring is full.
    #[must_use]
    pub fn try_write(&mut self, byte: u8) -> bool {
        let memory = &mut self.0;
        let written = memory.number(TO_HOST.written);
        let unread = written.wrapping_sub(memory.number(TO_HOST.read));
        if unread >= CAPACITY {
            return false;
        }
        memory.barrier();
        memory.set_byte(TO_HOST.place(written), byte);
        memory.barrier();
        memory.set_number(TO_HOST.written, written.wrapping_add(1));
        true
    }
}

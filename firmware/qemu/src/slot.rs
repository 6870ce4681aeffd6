//! Model slots, which behave as flash does.
//!
//! They lie in code memory, which QEMU lets a program write to. `-device
//! loader,file=model.bin,addr=0x200000,force-raw=on` on QEMU's command line puts a model into slot
//! A.

use board_common::region::Region;
use firmware::store::FlashError;

/// Why a slot was not written as asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum SlotError {
    /// The bytes would reach beyond the slot; none was written.
    OutOfRange,
    /// Bits that were 0 should have become 1, which takes an erase; they are still 0.
    NotErased,
}

/// Room for one model: erased as a whole, to ones; written bit by bit, to zeros.
pub struct Slot(Region);

impl Slot {
    /// Both slots.
    ///
    /// # Safety
    /// To be called once: no two may be the same slot.
    #[must_use]
    pub unsafe fn take() -> [Self; 2] {
        // SAFETY: the caller calls this once.
        unsafe { Region::take() }.map(Self)
    }

    /// All that is in it.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: QEMU lets a program write to code memory.
        unsafe { self.0.bytes_mut() }
    }

    /// Sets all of it to 0xFF.
    pub fn erase(&mut self) {
        self.bytes_mut().fill(0xFF);
    }

    /// Writes `bytes` from `offset` on.
    ///
    /// # Errors
    /// See [`SlotError`].
    pub fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), SlotError> {
        let end = offset.checked_add(bytes.len()).ok_or(SlotError::OutOfRange)?;
        let place = self.bytes_mut().get_mut(offset..end).ok_or(SlotError::OutOfRange)?;
        place.iter_mut().zip(bytes).for_each(|(there, byte)| *there &= byte);
        if place == bytes { Ok(()) } else { Err(SlotError::NotErased) }
    }
}

impl firmware::store::Slot for Slot {
    fn bytes(&self) -> &[u8] {
        self.bytes()
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erase();
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.write(offset, bytes).map_err(|_| FlashError)
    }
}

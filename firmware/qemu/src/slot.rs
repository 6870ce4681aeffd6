//! Model slots and pages of the journal, which behave as flash does.
//!
//! They lie in code memory, which QEMU lets a program write to. `-device
//! loader,file=model.bin,addr=0x200000,force-raw=on` on QEMU's command line puts a model into slot
//! A.

use board_common::region::Region;
use taxel_firmware::store::FlashError;

/// Why a slot could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum SlotError {
    /// The bytes would reach beyond the slot; none was written.
    OutOfRange,
    /// Bits that are 0 should have become 1, which needs an erase; they are still 0.
    NotErased,
}

/// Memory for one model, or one page of the journal. Erasing sets all its bits to 1; writing can only set bits to 0.
pub struct Slot(Region);

impl Slot {
    /// Takes both model slots, and both pages of the journal.
    ///
    /// # Safety
    /// The caller must ensure that this is called only once: no two values may be the same slot.
    pub unsafe fn take() -> ([Self; 2], [Self; 2]) {
        // SAFETY: the caller ensures that this is called only once.
        let (slots, pages) = unsafe { Region::take() };
        (slots.map(Self), pages.map(Self))
    }

    /// All bytes of the slot.
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: QEMU lets a program write to code memory.
        unsafe { self.0.bytes_mut() }
    }

    /// Sets all bytes to 0xFF.
    pub fn erase(&mut self) {
        self.bytes_mut().fill(0xFF);
    }

    /// Writes `bytes` from `offset` on.
    ///
    /// # Errors
    /// Every variant of [`SlotError`].
    pub fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), SlotError> {
        let end = offset.checked_add(bytes.len()).ok_or(SlotError::OutOfRange)?;
        let place = self.bytes_mut().get_mut(offset..end).ok_or(SlotError::OutOfRange)?;
        place.iter_mut().zip(bytes).for_each(|(there, byte)| *there &= byte);
        if place == bytes { Ok(()) } else { Err(SlotError::NotErased) }
    }
}

impl taxel_firmware::store::Slot for Slot {
    fn erase_interval_s(&self) -> u32 {
        0 // memory does not wear
    }

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

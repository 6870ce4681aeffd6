//! Model slots and pages of the journal, in sectors of the flash that regions.x names.

use board_common::region::Region;
use stm32f4xx_hal::pac::FLASH;
use taxel_firmware::store::FlashError;

use crate::flash::{Refused, Unlocked};

/// Why a slot could not be written or erased.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum SlotError {
    /// The bytes would reach beyond the slot; none was written.
    OutOfRange,
    /// The bytes are no whole words at multiples of four; none was written.
    Unaligned,
    /// The flash does not hold the bytes that were written: it was not erased, or is worn out.
    Verify,
    /// The flash controller reported an error, most likely because of write protection.
    Refused,
    /// The supply is too low; nothing was erased or written.
    Supply,
}

/// Flash for one model, or one page of the journal. Erasing sets all its bits to 1; writing can only set bits to 0.
pub struct Slot(Region);

impl Slot {
    /// Takes both model slots, both pages of the journal, and the flash controller, which they share.
    pub(crate) fn all(_: FLASH) -> ([Self; 2], [Self; 2]) {
        // SAFETY: there is only one controller value, so this is called only once.
        let (slots, pages) = unsafe { Region::take() };
        (slots.map(Self), pages.map(Self))
    }

    /// All bytes of the slot.
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    /// Sets all bytes to 0xFF. A slot takes 1 to 2 s, a page up to half a second, in which nothing else runs, not even interrupts.
    ///
    /// # Errors
    /// Every variant of [`SlotError`] but [`SlotError::Unaligned`].
    pub fn erase(&mut self) -> Result<(), SlotError> {
        // SAFETY: `all` took the controller, and no slot keeps it beyond one call.
        let mut flash = unsafe { Unlocked::new() }.ok_or(SlotError::Supply)?;
        let sector = flash.sector(self.0.start()).ok_or(SlotError::OutOfRange)?;
        // SAFETY: the sector is this slot, which is borrowed mutably: nobody reads it.
        let erased = unsafe { flash.erase(sector) };
        drop(flash);
        erased.map_err(|Refused| SlotError::Refused)?;
        if self.bytes().iter().all(|&byte| byte == 0xFF) { Ok(()) } else { Err(SlotError::Verify) }
    }

    /// Writes `bytes` from `offset` on, both multiples of four; takes 16 µs a word, 100 at most.
    ///
    /// # Errors
    /// Every variant of [`SlotError`].
    pub fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), SlotError> {
        let end = offset.checked_add(bytes.len()).ok_or(SlotError::OutOfRange)?;
        if end > self.0.length() {
            return Err(SlotError::OutOfRange);
        }
        let (words, []) = bytes.as_chunks::<4>() else { return Err(SlotError::Unaligned) };
        if !offset.is_multiple_of(4) {
            return Err(SlotError::Unaligned);
        }
        // SAFETY: `all` took the controller, and no slot keeps it beyond one call.
        let mut flash = unsafe { Unlocked::new() }.ok_or(SlotError::Supply)?;
        // SAFETY: the words lie within this slot, which is borrowed mutably: nobody reads it.
        let written = unsafe { flash.write(self.0.start() + offset, words) };
        drop(flash);
        written.map_err(|Refused| SlotError::Refused)?;
        if self.bytes().get(offset..end) == Some(bytes) { Ok(()) } else { Err(SlotError::Verify) }
    }
}

impl taxel_firmware::store::Slot for Slot {
    fn bytes(&self) -> &[u8] {
        self.bytes()
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erase().map_err(failed)
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.write(offset, bytes).map_err(failed)
    }
}

/// Logs the cause, and converts it to the store's error.
fn failed(cause: SlotError) -> FlashError {
    defmt::error!("flash: {}", cause);
    FlashError
}

//! Model slots in sectors 6 and 7 of the flash, and pages of settings in sectors 1 and 2.

use board_common::region::Region;
use firmware::store::FlashError;
use stm32f4xx_hal::flash::{Error, FlashExt};
use stm32f4xx_hal::pac::FLASH;

/// Why a slot could not be written or erased.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum SlotError {
    /// The bytes would reach beyond the slot; none was written.
    OutOfRange,
    /// The flash does not hold the bytes that were written: it was not erased, or is worn out.
    Verify,
    /// The flash controller reported an error, most likely because of write protection.
    Refused,
}

/// Flash for one model, or one page of settings. Erasing sets all its bits to 1; writing can only set bits to 0.
pub struct Slot(Region);

impl Slot {
    /// Takes both model slots, both pages of settings, and the flash controller, which they share.
    pub(crate) fn all(_: FLASH) -> ([Self; 2], [Self; 2]) {
        // SAFETY: there is only one controller value, so this is called only once.
        let (slots, pages) = unsafe { Region::take() };
        (slots.map(Self), pages.map(Self))
    }

    /// All bytes of the slot.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    /// Sets all bytes to 0xFF. Takes 1 to 4 s, in which nothing else runs, not even interrupts.
    ///
    /// # Errors
    /// Every variant of [`SlotError`].
    pub fn erase(&mut self) -> Result<(), SlotError> {
        let mut flash = controller();
        let sector = flash.sector(self.0.start() - flash.address()).ok_or(SlotError::OutOfRange)?;
        let erased = flash.unlocked().erase(sector.number);
        forget_cached(&flash);
        erased.map_err(refused)?;
        if self.bytes().iter().all(|&byte| byte == 0xFF) { Ok(()) } else { Err(SlotError::Verify) }
    }

    /// Writes `bytes` from `offset` on; takes 16 µs a byte.
    ///
    /// # Errors
    /// Every variant of [`SlotError`].
    pub fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), SlotError> {
        let end = offset.checked_add(bytes.len()).ok_or(SlotError::OutOfRange)?;
        if end > self.0.length() {
            return Err(SlotError::OutOfRange);
        }
        let mut flash = controller();
        let place = self.0.start() - flash.address() + offset;
        let written = flash.unlocked().program(place, bytes.iter());
        forget_cached(&flash);
        written.map_err(refused)?;
        if self.bytes().get(offset..end) == Some(bytes) { Ok(()) } else { Err(SlotError::Verify) }
    }
}

impl firmware::store::Slot for Slot {
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

/// The flash controller, with the error flags of earlier operations cleared.
fn controller() -> FLASH {
    // SAFETY: `Slot::all` took the controller, and no slot keeps it beyond one call.
    let flash = unsafe { FLASH::steal() };
    // Flags are cleared by writing ones; bits 1 and 4 to 8 are the errors.
    // SAFETY: no other bit of this register can be written.
    flash.sr().write(|w| unsafe { w.bits(0x1F2) });
    flash
}

fn refused(_: Error) -> SlotError {
    SlotError::Refused
}

/// Empties the data cache, which does not notice that flash has changed.
fn forget_cached(flash: &FLASH) {
    flash.acr().modify(|_, w| w.dcen().clear_bit());
    flash.acr().modify(|_, w| w.dcrst().set_bit());
    flash.acr().modify(|_, w| w.dcrst().clear_bit());
    flash.acr().modify(|_, w| w.dcen().set_bit());
}

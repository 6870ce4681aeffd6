//! The flash controller: erasing a sector, writing words, and the option byte of the brown-out level.
//!
//! 32 bits at once, which 3.3 V allow: the HAL's functions take 8, and twice the time.

use core::ptr;

use stm32f4xx_hal::flash::FlashExt;
use stm32f4xx_hal::pac::FLASH;
use stm32f4xx_hal::pac::flash::cr::PSIZE;

use crate::power;

/// Values that unlock the controller, in this order.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Values that unlock the option bytes, in this order.
const OPTION_KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];

/// Brown-out level 3 in the option bytes: a reset below 2.7 to 2.9 V. A chip comes with none.
const BROWN_OUT_LEVEL_3: u8 = 0;

/// Error flags of the status register, which are cleared by writing ones.
const ERRORS: u32 = 0x1F2;

/// The controller reported an error.
pub(crate) struct Refused;

/// The flash controller, unlocked until this is dropped.
pub(crate) struct Unlocked(FLASH);

impl Unlocked {
    /// Unlocks the controller, and clears the errors of earlier operations. `None`, and nothing is unlocked, while
    /// the supply is too low.
    ///
    /// # Safety
    /// The caller must ensure that nobody else uses the controller meanwhile.
    pub unsafe fn new() -> Option<Self> {
        if power::is_low() {
            return None;
        }
        // SAFETY: the caller ensures that there is no other user.
        let flash = unsafe { FLASH::steal() };
        // SAFETY: no other bit of this register can be written.
        flash.sr().write(|w| unsafe { w.bits(ERRORS) });
        for key in KEYS {
            // SAFETY: the register takes every value.
            flash.keyr().write(|w| unsafe { w.bits(key) });
        }
        Some(Self(flash))
    }

    /// Number of the sector that holds `address`.
    pub fn sector(&self, address: usize) -> Option<u8> {
        let offset = address.checked_sub(self.0.address())?;
        Some(self.0.sector(offset)?.number)
    }

    /// Sets all bytes of a sector to 0xFF.
    ///
    /// # Safety
    /// The sector must hold nothing that is in use.
    pub unsafe fn erase(&mut self, sector: u8) -> Result<(), Refused> {
        self.0.cr().modify(|_, w| {
            // SAFETY: the sector's number fits its field.
            unsafe { w.snb().bits(sector) };
            w.psize().variant(PSIZE::Psize32).ser().set_bit()
        });
        self.0.cr().modify(|_, w| w.strt().set_bit());
        let erased = self.ended();
        self.0.cr().modify(|_, w| w.ser().clear_bit());
        erased
    }

    /// Writes words from `address` on, a multiple of four.
    ///
    /// # Safety
    /// The flash there must hold nothing that is in use, and its address must have been exposed.
    pub unsafe fn write(&mut self, address: usize, words: &[[u8; 4]]) -> Result<(), Refused> {
        self.0.cr().modify(|_, w| w.psize().variant(PSIZE::Psize32).pg().set_bit());
        let mut place = ptr::with_exposed_provenance_mut::<u32>(address);
        let written = words.iter().try_for_each(|word| {
            // SAFETY: the caller answers for the place.
            unsafe { place.write_volatile(u32::from_le_bytes(*word)) };
            place = place.wrapping_add(1);
            self.ended()
        });
        self.0.cr().modify(|_, w| w.pg().clear_bit());
        written
    }

    /// Waits until the operation has ended. Code that must be fetched from flash stands still meanwhile; code in the
    /// instruction cache goes on.
    fn ended(&self) -> Result<(), Refused> {
        while self.0.sr().read().bsy().bit() {}
        if self.0.sr().read().bits() & ERRORS == 0 { Ok(()) } else { Err(Refused) }
    }
}

impl Drop for Unlocked {
    /// Locks the controller, and empties the data cache, which does not notice that flash has changed.
    fn drop(&mut self) {
        self.0.cr().modify(|_, w| w.lock().set_bit());
        self.0.acr().modify(|_, w| w.dcen().clear_bit());
        self.0.acr().modify(|_, w| w.dcrst().set_bit());
        self.0.acr().modify(|_, w| w.dcrst().clear_bit());
        self.0.acr().modify(|_, w| w.dcen().set_bit());
    }
}

/// Makes the chip reset while its supply is too low for 180 MHz and for writing flash, from the next reset on. Returns
/// whether it does: not while the supply is too low. The option byte stays for good; other options stay as they are.
pub(crate) fn set_brown_out_level() -> bool {
    // SAFETY: what erases and writes flash has ended whenever a request is answered.
    let flash = unsafe { FLASH::steal() };
    if flash.optcr().read().bor_lev().bits() == BROWN_OUT_LEVEL_3 {
        return true;
    }
    if power::is_low() {
        return false;
    }
    for key in OPTION_KEYS {
        // SAFETY: the register takes every value.
        flash.optkeyr().write(|w| unsafe { w.bits(key) });
    }
    // SAFETY: the level fits its field.
    flash.optcr().modify(|_, w| unsafe { w.bor_lev().bits(BROWN_OUT_LEVEL_3) });
    flash.optcr().modify(|_, w| w.optstrt().set_bit());
    while flash.sr().read().bsy().bit() {}
    flash.optcr().modify(|_, w| w.optlock().set_bit());
    true
}

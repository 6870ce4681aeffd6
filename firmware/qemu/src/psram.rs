//! The machine's 16 MB of PSRAM, which QEMU can keep in a file that a program on the host writes as well.

use core::ptr;

use crate::mailbox::SharedMemory;

const START: usize = 0x2100_0000;
/// Keeps a place within the memory, and that of a number on an even address.
const WITHIN: usize = 0xFF_FFFF;
const WITHIN_EVEN: usize = 0xFF_FFFE;

/// The memory; the linker places nothing in it.
pub struct Psram(());

impl Psram {
    /// All of it.
    ///
    /// # Safety
    /// To be called once: only this value may write to the memory.
    #[must_use]
    pub const unsafe fn take() -> Self {
        Self(())
    }
}

impl SharedMemory for Psram {
    fn byte(&self, place: usize) -> u8 {
        // SAFETY: the address lies within the memory, which is always there.
        unsafe { ptr::with_exposed_provenance::<u8>(START + (place & WITHIN)).read_volatile() }
    }

    fn set_byte(&mut self, place: usize, byte: u8) {
        let address = ptr::with_exposed_provenance_mut::<u8>(START + (place & WITHIN));
        // SAFETY: as above, and `take` vouches that nobody else writes.
        unsafe { address.write_volatile(byte) }
    }

    fn number(&self, place: usize) -> u16 {
        let address = ptr::with_exposed_provenance::<u16>(START + (place & WITHIN_EVEN));
        // SAFETY: as above; the address is even.
        u16::from_le(unsafe { address.read_volatile() })
    }

    fn set_number(&mut self, place: usize, number: u16) {
        let address = ptr::with_exposed_provenance_mut::<u16>(START + (place & WITHIN_EVEN));
        // SAFETY: as above.
        unsafe { address.write_volatile(number.to_le()) }
    }

    fn barrier(&self) {
        cortex_m::asm::dmb();
    }
}

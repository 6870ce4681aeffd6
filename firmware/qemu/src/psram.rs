//! The machine's 16 MB of PSRAM, which QEMU can keep in a file that a program on the host writes as well.

use core::ptr;

use crate::mailbox::SharedMemory;

const START: usize = 0x2100_0000;
/// Mask that keeps a place within the memory; the mask below also makes it even, for a number.
const WITHIN: usize = 0xFF_FFFF;
const WITHIN_EVEN: usize = 0xFF_FFFE;

/// The machine's PSRAM, in which the linker places nothing.
pub struct Psram(());

impl Psram {
    /// Takes the whole memory.
    ///
    /// # Safety
    /// The caller must ensure that this is called only once, because only one value may write to the memory.
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
        // SAFETY: the address lies within the memory, and `take` ensures that no other value writes.
        unsafe { address.write_volatile(byte) }
    }

    fn number(&self, place: usize) -> u16 {
        let address = ptr::with_exposed_provenance::<u16>(START + (place & WITHIN_EVEN));
        // SAFETY: the address lies within the memory, and is even.
        u16::from_le(unsafe { address.read_volatile() })
    }

    fn set_number(&mut self, place: usize, number: u16) {
        let address = ptr::with_exposed_provenance_mut::<u16>(START + (place & WITHIN_EVEN));
        // SAFETY: the address lies within the memory and is even, and no other value writes.
        unsafe { address.write_volatile(number.to_le()) }
    }

    fn barrier(&self) {
        cortex_m::asm::dmb();
    }
}

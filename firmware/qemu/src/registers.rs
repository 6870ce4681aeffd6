//! Registers of a peripheral.

/// A peripheral's registers, by their offset in bytes.
#[derive(Clone, Copy)]
pub struct Registers(usize);

impl Registers {
    /// Those at `base`.
    ///
    /// # Safety
    /// A peripheral must lie there, and only its driver may use this.
    pub const unsafe fn at(base: usize) -> Self {
        Self(base)
    }

    pub fn read(self, offset: usize) -> u32 {
        // SAFETY: `at` vouches for the address.
        unsafe { core::ptr::with_exposed_provenance::<u32>(self.0 + offset).read_volatile() }
    }

    pub fn write(self, offset: usize, value: u32) {
        let register = core::ptr::with_exposed_provenance_mut::<u32>(self.0 + offset);
        // SAFETY: `at` vouches for the address.
        unsafe { register.write_volatile(value) }
    }
}

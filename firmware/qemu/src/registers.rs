//! Registers of a peripheral.

/// A peripheral's registers, by their offset in bytes.
#[derive(Clone, Copy)]
pub struct Registers(usize);

impl Registers {
    /// The registers of the peripheral at the address `base`.
    ///
    /// # Safety
    /// The caller must ensure that a peripheral lies at `base`, and that only its driver uses the value.
    pub const unsafe fn at(base: usize) -> Self {
        Self(base)
    }

    pub fn read(self, offset: usize) -> u32 {
        // SAFETY: the caller of `at` has ensured that the address is a peripheral's.
        unsafe { core::ptr::with_exposed_provenance::<u32>(self.0 + offset).read_volatile() }
    }

    pub fn write(self, offset: usize, value: u32) {
        let register = core::ptr::with_exposed_provenance_mut::<u32>(self.0 + offset);
        // SAFETY: the caller of `at` has ensured that the address is a peripheral's.
        unsafe { register.write_volatile(value) }
    }
}

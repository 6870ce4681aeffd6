//! Where the linker put the model slots.

use core::{ptr, slice};

unsafe extern "C" {
    static _slot_a_start: u8;
    static _slot_a_end: u8;
    static _slot_b_start: u8;
    static _slot_b_end: u8;
}

/// One slot's memory. Whoever has it is alone with it.
#[derive(Debug)]
pub struct Region {
    start: usize,
    length: usize,
}

impl Region {
    /// The regions of both slots.
    ///
    /// # Safety
    /// To be called once: no two may be the same region.
    #[must_use]
    pub unsafe fn take() -> [Self; 2] {
        let region = |start: *const u8, end: *const u8| Self {
            start: start.expose_provenance(),
            length: end.addr() - start.addr(),
        };
        [
            region(&raw const _slot_a_start, &raw const _slot_a_end),
            region(&raw const _slot_b_start, &raw const _slot_b_end),
        ]
    }

    /// The address of the first byte.
    #[must_use]
    pub fn start(&self) -> usize {
        self.start
    }

    /// How many bytes there are.
    #[must_use]
    pub fn length(&self) -> usize {
        self.length
    }

    /// All that is in it.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: the linker keeps the slot free of anything else, and only who has `self` writes to it.
        unsafe { slice::from_raw_parts(ptr::with_exposed_provenance(self.start), self.length) }
    }

    /// All that is in it, to be written.
    ///
    /// # Safety
    /// The slot lies in memory that a program may write to.
    #[must_use]
    pub unsafe fn bytes_mut(&mut self) -> &mut [u8] {
        let start = ptr::with_exposed_provenance_mut(self.start);
        // SAFETY: as for `bytes`; `self` is borrowed mutably, and the caller vouches that it can be written.
        unsafe { slice::from_raw_parts_mut(start, self.length) }
    }
}

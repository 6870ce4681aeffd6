//! Memory regions of the model slots, of the journal, and of weights in RAM, as the linker placed them.

use core::{ptr, slice};

unsafe extern "C" {
    // Mutable, because erasing and writing change what stands there.
    static mut _slot_a_start: u8;
    static mut _slot_a_end: u8;
    static mut _slot_b_start: u8;
    static mut _slot_b_end: u8;
    static mut _journal_start: u8;
    static mut _journal_end: u8;
    static mut _weights_start: u32;
    static mut _weights_end: u32;
}

/// Takes the RAM to which a model's blob is copied.
///
/// # Safety
/// The caller must ensure that this is called only once: no two values may be the same memory.
pub unsafe fn take_weights() -> &'static mut [u32] {
    let (start, end) = (&raw mut _weights_start, &raw mut _weights_end);
    let words = (end.addr() - start.addr()) / size_of::<u32>();
    // SAFETY: the linker places nothing else there, and the caller ensures that nobody else has it. Every bit
    // pattern that RAM holds at power-on is a number. The region is not of Rust's making, so its provenance is exposed.
    unsafe {
        slice::from_raw_parts_mut(
            ptr::with_exposed_provenance_mut(start.expose_provenance()),
            words,
        )
    }
}

/// Memory of one model slot, or one page of the journal, with exclusive access.
#[derive(Debug)]
pub struct Region {
    start: usize,
    length: usize,
}

impl Region {
    /// Takes the regions of both slots, and of both pages of the journal.
    ///
    /// # Safety
    /// The caller must ensure that this is called only once: no two values may be the same region.
    pub unsafe fn take() -> ([Self; 2], [Self; 2]) {
        let region = |start: *const u8, end: *const u8| Self {
            start: start.expose_provenance(),
            length: end.addr() - start.addr(),
        };
        let slots = [
            region(&raw const _slot_a_start, &raw const _slot_a_end),
            region(&raw const _slot_b_start, &raw const _slot_b_end),
        ];
        let journal = region(&raw const _journal_start, &raw const _journal_end);
        let length = journal.length / 2;
        let pages = [0, length].map(|offset| Self { start: journal.start + offset, length });
        (slots, pages)
    }

    /// Address of the region's first byte.
    pub fn start(&self) -> usize {
        self.start
    }

    /// Length of the region in bytes.
    pub fn length(&self) -> usize {
        self.length
    }

    /// All bytes of the region.
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: the linker places nothing else in the slot, and only the owner of `self` writes to it.
        unsafe { slice::from_raw_parts(ptr::with_exposed_provenance(self.start), self.length) }
    }

    /// All bytes of the region, to be written.
    ///
    /// # Safety
    /// The caller must ensure that the slot lies in memory that a program may write to.
    pub unsafe fn bytes_mut(&mut self) -> &mut [u8] {
        let start = ptr::with_exposed_provenance_mut(self.start);
        // SAFETY: as in `bytes`; `self` is borrowed mutably, and the caller ensures that the memory can be
        // written.
        unsafe { slice::from_raw_parts_mut(start, self.length) }
    }
}

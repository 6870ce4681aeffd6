//! Values that are opaque to the optimiser, and a panic handler that does not link.

use core::panic::PanicInfo;
use core::{ptr, slice};

unsafe extern "C" {
    /// A function that is defined nowhere: a program that can reach it does not link.
    fn taxel_reachable_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never runs, since it never links.
    unsafe { taxel_reachable_panic() }
}

/// Returns `value`, hidden from the optimiser, which must compute it and can assume nothing about it.
#[inline(never)]
pub fn opaque<T: Copy>(value: T) -> T {
    // SAFETY: a reference is valid for reads.
    unsafe { ptr::read_volatile(&raw const value) }
}

/// A flash slot of unknown address, length and content.
pub fn slot() -> &'static [u8] {
    let (address, length) = opaque((0x0806_0000_usize, 0x2_0000_usize));
    // SAFETY: address and length are those of the last sector of a board's flash.
    unsafe { slice::from_raw_parts(ptr::with_exposed_provenance(address), length) }
}

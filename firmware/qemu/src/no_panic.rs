//! Proof by linking that no panic can be reached: the handler calls a function that is defined nowhere, so a program links
//! only if the optimiser has removed every panic. Nothing is logged, since logging may panic.
//!
//! To find a panic that `cargo xtask firmware` reports, link anyway with `-C link-arg=--unresolved-symbols=ignore-all`, and
//! disassemble: code that branches to a function of `core::panicking` is the source.

use core::panic::PanicInfo;

use defmt::{Logger, global_logger};

unsafe extern "C" {
    /// A function that is defined nowhere.
    fn taxel_reachable_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never runs, since it never links.
    unsafe { taxel_reachable_panic() }
}

/// A logger that drops everything.
#[global_logger]
struct Nothing;

// SAFETY: it does nothing.
unsafe impl Logger for Nothing {
    fn acquire() {}

    unsafe fn flush() {}

    unsafe fn release() {}

    unsafe fn write(_: &[u8]) {}
}

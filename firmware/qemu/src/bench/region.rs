//! Regions whose instructions `cargo xtask cycles` counts.

use core::arch::{asm, naked_asm};

use defmt::info;

/// Where it returns, a region starts. Unlike its counterpart in code, so that no linker makes one of
/// the two.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn region_begin() {
    naked_asm!("nop", "bx lr")
}

/// Where it is called, a region ends.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn region_end() {
    naked_asm!("bx lr")
}

/// Runs `work` as a region, and says in the log what it is: `xtask` counts regions, and finds their
/// names there in the same order.
#[inline(always)]
#[expect(clippy::inline_always, reason = "the work itself must stand between the two calls")]
pub fn region(kernel: &str, scope: &str, work: impl FnOnce()) {
    info!("region {=str} {=str}", kernel, scope);
    region_begin();
    work();
    region_end();
}

/// Regions whose cost is known: nothing, and a loop that was counted by hand.
pub fn calibrate() {
    region("calibration", "empty", || ());
    region("calibration", "loop", || {
        // SAFETY: changes r0 and the flags alone.
        unsafe {
            asm!("mov.w r0, #1000", "2:", "subs r0, #1", "bne 2b", out("r0") _, options(nomem, nostack));
        }
    });
}

//! Regions whose instructions `cargo xtask cycles` counts.

use core::arch::{asm, naked_asm};

use defmt::info;

/// Starts a region where it returns. Its code differs from that of [`region_end`], so that no linker merges the
/// two.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn region_begin() {
    naked_asm!("nop", "bx lr")
}

/// Ends a region where it is called.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn region_end() {
    naked_asm!("bx lr")
}

/// Runs `work` as a region, and logs the region's name. `xtask` counts the regions, and reads their names from the
/// log in the same order.
#[inline(always)]
#[expect(clippy::inline_always, reason = "the work itself must stand between the two calls")]
pub fn region(name: &str, work: impl FnOnce()) {
    info!("region {=str}", name);
    region_begin();
    work();
    region_end();
}

/// Runs regions whose cost is known: an empty one, and a loop that was counted by hand.
pub fn calibrate() {
    region("empty", || ());
    region("loop", || {
        // SAFETY: the code changes only r0 and the flags.
        unsafe {
            asm!("mov.w r0, #1000", "2:", "subs r0, #1", "bne 2b", out("r0") _, options(nomem, nostack));
        }
    });
}

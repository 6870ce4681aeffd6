//! A fault is logged with its place and cause, and fails the run.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
// The fault handler.
use qemu_image as _;

#[entry]
fn main() -> ! {
    // SAFETY: none is needed; nothing lies at this address, so that the jump must fault.
    unsafe { core::arch::asm!("bx {}", in(reg) 0x6000_0001, options(noreturn)) }
}

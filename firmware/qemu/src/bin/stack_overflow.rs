//! A stack overflow is caught as soon as it happens, before it reaches a variable.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::info;
use qemu_image::{exit, memory};

/// Uses at least so many bytes of stack. Ends the run without logging anything if the stack has that many.
fn take(bytes: usize) -> usize {
    let room = black_box([0_u32; 4]);
    if bytes < size_of_val(&room) {
        exit::success();
    }
    take(bytes - size_of_val(&room)) + black_box(room).len()
}

#[entry]
fn main() -> ! {
    info!("taking more than there is");
    take(memory::stack_bytes());
    exit::success()
}

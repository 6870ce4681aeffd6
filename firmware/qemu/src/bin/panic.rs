//! A panic is logged and fails the run.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
// The panic handler.
use qemu_image as _;

#[entry]
fn main() -> ! {
    panic!("on purpose");
}

//! Trains by recursive least squares; `firmware/tests/bit_for_bit.rs` checks that the host gives the same
//! bits.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use qemu_image::{checks, exit};

#[entry]
fn main() -> ! {
    info!("recursion: {=u32:08x}", unwrap!(checks::recursion()));
    exit::success()
}

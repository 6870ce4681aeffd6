//! Decodes with the hand-made model; `firmware/tests/bit_for_bit.rs` checks that the host gives the same bits.
//! Decoding uses little of 8 KiB of RAM, stack included, and leaves most of it to the rest of a device's work.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{assert, debug, info, unwrap};
use qemu_image::memory::{Sections, stack_high_water_bytes};
use qemu_image::{checks, exit};
use taxel_core::Aligned;

static MODEL: Aligned<[u8; include_bytes!("../../../../testdata/hand-made.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/hand-made.bin"));

#[entry]
fn main() -> ! {
    info!("decoding: {=u32:08x}", unwrap!(checks::decoding(&MODEL.0)));
    let ram_bytes = Sections::linked().ram() + stack_high_water_bytes();
    debug!("{=usize} bytes of RAM", ram_bytes);
    assert!(ram_bytes <= 4096, "{=usize}", ram_bytes);
    info!("within 4 KiB of RAM");
    exit::success()
}

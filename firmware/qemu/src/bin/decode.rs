//! Decodes with every exponential; `firmware/tests/bit_for_bit.rs` checks that the host gives the same bits.
//! Decoding uses little of 8 KiB of RAM, stack included, and leaves most of it to the rest of a device's work.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{assert, debug, info, unwrap};
use qemu_image::memory::{Sections, stack_high_water_bytes};
use qemu_image::{checks, exit};
use taxel_core::Aligned;
use taxel_core::exp::{ExpKernel, Libm, Micromath, Polynomial};

static MODEL: Aligned<[u8; include_bytes!("../../../../testdata/hand-made.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/hand-made.bin"));

#[inline(never)] // so that the stack holds one decoder at a time, as on a device
fn decode<E: ExpKernel>() {
    info!("decoding with {=str}: {=u32:08x}", E::NAME, unwrap!(checks::decoding::<E>(&MODEL.0)));
}

#[entry]
fn main() -> ! {
    decode::<Polynomial>();
    decode::<Libm>();
    decode::<Micromath>();
    let ram_bytes = Sections::linked().ram() + stack_high_water_bytes();
    debug!("{=usize} bytes of RAM", ram_bytes);
    assert!(ram_bytes <= 4096, "{=usize}", ram_bytes);
    info!("within 4 KiB of RAM");
    exit::success()
}

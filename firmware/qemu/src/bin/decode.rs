//! Decodes with every exp kernel; `firmware/tests/bit_for_bit.rs` holds the host to the same bits.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use model_core::Aligned;
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use qemu_image::{checks, exit};

static MODEL: Aligned<[u8; include_bytes!("../../../../testdata/hand-made.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/hand-made.bin"));

fn decode<E: ExpKernel>() {
    info!("decoding with {=str}: {=u32:08x}", E::NAME, unwrap!(checks::decoding::<E>(&MODEL.0)));
}

#[entry]
fn main() -> ! {
    decode::<Polynomial>();
    decode::<Libm>();
    decode::<Micromath>();
    exit::success()
}

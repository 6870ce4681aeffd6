//! Decodes frames by networks of fixed size and by their blobs, which must give the same bits;
//! `firmware/tests/bit_for_bit.rs` checks that the host gives them too.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use model_core::Aligned;
use qemu_image::exit;
use qemu_image::fixed::{self, Compared, FRAMES};

static HAND_MADE: Aligned<[u8; include_bytes!("../../../../testdata/hand-made.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/hand-made.bin"));
static ROW4: Aligned<[u8; include_bytes!("../../../../testdata/row4.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/row4.bin"));

fn log(name: &str, compared: Compared) {
    let (Compared { crc, different }, same) = (compared, FRAMES - compared.different);
    info!(
        "{=str}: {=usize} of {=usize} frames bit-identical to the blob's: {=u32:08x}",
        name, same, FRAMES, crc
    );
    defmt::assert_eq!(different, 0);
}

#[entry]
fn main() -> ! {
    log("hand-made", unwrap!(fixed::hand_made(&HAND_MADE.0)));
    log("row4", unwrap!(fixed::row4(&ROW4.0)));
    exit::success()
}

//! Decodes frames by models of fixed size and by their blobs, which must give the same bits;
//! `firmware/tests/bit_for_bit.rs` checks that the host gives them too.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{Display2Format, info, unwrap};
use qemu_image::{exit, fixed};
use taxel_core::Aligned;

static HAND_MADE: Aligned<[u8; include_bytes!("../../../../testdata/hand-made.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/hand-made.bin"));
static ROW4: Aligned<[u8; include_bytes!("../../../../testdata/row4.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/row4.bin"));
static TOUCH: Aligned<[u8; include_bytes!("../../../../testdata/array-touch.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/array-touch.bin"));

#[entry]
fn main() -> ! {
    let mut say = |line: core::fmt::Arguments<'_>| info!("{}", Display2Format(&line));
    unwrap!(fixed::compare_all([&HAND_MADE.0, &ROW4.0, &TOUCH.0], &mut say));
    exit::success()
}

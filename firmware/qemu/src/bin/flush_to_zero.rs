//! Decodes frames with readings that no sensor gives in every number format, first with subnormals kept, then with
//! them flushed to zero. `firmware/tests/bit_for_bit.rs` checks that the host gives the same bits.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{assert_eq, info, unwrap};
use model_core::Aligned;
use model_core::rbf::Format;
use qemu_image::{checks, exit};

/// Bytes of a model in testdata, aligned.
macro_rules! model {
    ($name:literal) => {{
        static MODEL: Aligned<[u8; include_bytes!(concat!("../../../../testdata/", $name)).len()]> =
            Aligned(*include_bytes!(concat!("../../../../testdata/", $name)));
        &MODEL.0
    }};
}

/// Bit of FPSCR that flushes subnormals to zero.
const FLUSH_TO_ZERO: u32 = 1 << 24;

/// Sets or clears flush-to-zero in the floating-point unit.
fn flush_to_zero(flush: bool) {
    let mut fpscr: u32;
    // SAFETY: reading the status has no effect.
    unsafe { core::arch::asm!("vmrs {}, fpscr", out(reg) fpscr) };
    fpscr = if flush { fpscr | FLUSH_TO_ZERO } else { fpscr & !FLUSH_TO_ZERO };
    // SAFETY: the mode changes results of floating-point instructions alone, which is what is tested.
    unsafe { core::arch::asm!("vmsr fpscr, {}", in(reg) fpscr) };
}

fn decode(format: Format, blob: &[u8]) {
    let crc = unwrap!(checks::decoding_extremes::<{ checks::ROWS }>(blob));
    info!("{=str}: {=u32:08x}", format.name(), crc);
}

#[entry]
fn main() -> ! {
    for (mode, flush) in [("kept", false), ("flushed to zero", true)] {
        flush_to_zero(flush);
        let half = black_box(f32::MIN_POSITIVE) * black_box(0.5);
        assert_eq!(half.to_bits() == 0, flush);
        info!("subnormals {=str}", mode);
        decode(Format::F32, model!("kernels-f32.bin"));
        decode(Format::Fixed16, model!("kernels-fixed16.bin"));
        decode(Format::F32Direct, model!("kernels-f32-direct.bin"));
    }
    exit::success()
}

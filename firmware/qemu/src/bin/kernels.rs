//! Decodes 10,000 frames with every number format, with readings within and far beyond the
//! training range, tells their novelty and deviations, and filters as many estimates in time. At last
//! decodes readings that no sensor gives, with subnormals kept and with them flushed to zero. `firmware/tests/bit_for_bit.rs` checks that the host gives the same
//! bits: it runs the compiled twins of the assembly routines.
#![no_std]
#![no_main]

use core::fmt::Arguments;
use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{Display2Format, assert_eq, info, unwrap};
use qemu_image::{checks, exit};
use taxel_core::Aligned;

/// Makes `model`, which gives the bytes of these models in testdata, aligned.
macro_rules! models {
    ($($name:literal)*) => {
        fn model(name: &str) -> &'static [u8] {
            match name {
                $($name => {
                    static MODEL: Aligned<
                        [u8; include_bytes!(concat!("../../../../testdata/", $name)).len()],
                    > = Aligned(*include_bytes!(concat!("../../../../testdata/", $name)));
                    &MODEL.0
                })*
                _ => &[],
            }
        }
    };
}
models! {
    "kernels-f32.bin" "kernels-fixed16.bin" "array-f32.bin" "array-fixed16.bin" "array-fixed16-no-tail.bin"
    "array-fixed16-confidence.bin" "array-touch.bin"
}

fn say(line: Arguments<'_>) {
    info!("{}", Display2Format(&line));
}

/// Bit of FPSCR that flushes subnormals to zero.
const FLUSH_TO_ZERO: u32 = 1 << 24;
/// Bits of FPSCR: alternative half precision, default NaN, flush to zero, rounding mode.
const MODES: u32 = 1 << 26 | 1 << 25 | FLUSH_TO_ZERO | 3 << 22;

/// The modes of the floating-point unit.
fn modes() -> u32 {
    let fpscr: u32;
    // SAFETY: reading the status has no effect.
    unsafe { core::arch::asm!("vmrs {}, fpscr", out(reg) fpscr) };
    fpscr & MODES
}

/// Decodes readings that no sensor gives, in these modes of the floating-point unit.
fn extremes(mode: &str, bits: u32) {
    // SAFETY: the mode changes results of floating-point instructions alone, which is what is tested.
    unsafe { core::arch::asm!("vmsr fpscr, {}", in(reg) bits) };
    let half = black_box(f32::MIN_POSITIVE) * black_box(0.5);
    assert_eq!(half.to_bits() == 0, bits == FLUSH_TO_ZERO);
    unwrap!(checks::extremes(mode, &model, &mut say));
    assert_eq!(modes(), bits);
}

#[entry]
fn main() -> ! {
    assert_eq!(modes(), 0);
    unwrap!(checks::kernels(&model, &mut say));
    extremes("kept", 0);
    extremes("flushed to zero", FLUSH_TO_ZERO);
    exit::success()
}

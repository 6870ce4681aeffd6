//! The floating-point unit computes as the host's does: it keeps subnormals and rounds to nearest.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{assert_eq, info};
use qemu_image::exit;

/// Bits of FPSCR: alternative half precision, default NaN, flush to zero, rounding mode.
const MODES: u32 = 1 << 26 | 1 << 25 | 1 << 24 | 3 << 22;

#[entry]
fn main() -> ! {
    let fpscr: u32;
    // SAFETY: reading the status has no effect.
    unsafe { core::arch::asm!("vmrs {}, fpscr", out(reg) fpscr) };
    assert_eq!(fpscr & MODES, 0);

    let smallest_normal = black_box(f32::MIN_POSITIVE);
    let half = smallest_normal * black_box(0.5);
    assert_eq!(half.to_bits(), 0x0040_0000);
    assert_eq!((half + half).to_bits(), smallest_normal.to_bits());
    // One and a half units in the last place round to the nearest number, and a tie to the even one.
    assert_eq!((black_box(1.0_f32) + black_box(1.5 * f32::EPSILON)).to_bits(), 0x3F80_0002);
    assert_eq!((black_box(1.0_f32) + black_box(0.5 * f32::EPSILON)).to_bits(), 0x3F80_0000);
    info!("subnormals are kept, sums rounded to nearest");
    exit::success()
}

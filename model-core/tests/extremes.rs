//! The exponential over the numbers that it is for: some blocks of them, or all by `TAXEL_CASES=20000`.

use crate::table::hold;
use taxel_core::exp::exp;

/// Consecutive numbers of one case.
const BLOCK: u32 = 1 << 16;
/// Bits of −0, which larger bits are farther from, and of −87.
const ENDS: [u32; 2] = [0x8000_0000, (-87.0_f32).to_bits()];

/// Results are positive normal numbers, and fall but for their last place.
#[test]
fn the_exponential_is_within_2_ulp_from_0_to_minus_87() {
    let blocks = ENDS.map(|end| u64::from(end / BLOCK));
    hold("exp", 2.0, 300, |seed| {
        // An odd step visits each block once.
        let block = blocks[0] + seed * 20_011 % (blocks[1] + 1 - blocks[0]);
        let first = block as u32 * BLOCK;
        let (mut worst, mut before) = (0.0_f64, 1.0_f32);
        for x in (first..=(first + (BLOCK - 1)).min(ENDS[1])).map(f32::from_bits) {
            let (y, truth) = (exp(x), f64::from(x).exp());
            assert!(y.is_normal() && y > 0.0 && y <= before.next_up(), "e^{x:e} is {y:e}");
            let ulp = f64::from((truth as f32).next_up() - truth as f32);
            worst = worst.max((f64::from(y) - truth).abs() / ulp);
            before = y;
        }
        Some(worst)
    });
}

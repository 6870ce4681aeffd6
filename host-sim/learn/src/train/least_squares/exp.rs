//! Exponentials e^x of many x ≤ 0 at once, in plain f64 operations that compilers turn into vector
//! instructions. They give the same result on every machine.

use std::f64::consts::LOG2_E;

/// First part of ln 2, with 21 zero bits at its end, so that k times it is exact.
const LN_2_HIGH: f64 = f64::from_bits(0x3FE6_2E42_FEE0_0000);
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Number whose addition leaves a whole number in the last bits of the sum.
const ROUNDER: f64 = 6_755_399_441_055_744.0; // 1.5·2⁵²
/// Least x whose e^x needs no subnormal numbers.
const LEAST: f64 = -708.0;
/// Coefficients 1/13! … 1/0!: the rest of the series is below 5e-18 for |r| ≤ ln 2/2.
const SERIES: [f64; 14] = [
    1.605_904_383_682_161_3e-10,
    2.087_675_698_786_81e-9,
    2.505_210_838_544_172e-8,
    2.755_731_922_398_589e-7,
    2.755_731_922_398_589e-6,
    2.480_158_730_158_73e-5,
    1.984_126_984_126_984e-4,
    1.388_888_888_888_889e-3,
    8.333_333_333_333_333e-3,
    4.166_666_666_666_666_4e-2,
    1.666_666_666_666_666_6e-1,
    0.5,
    1.0,
    1.0,
];

/// Replaces every x ≤ 0 by e^x, to within 4e-16 of the value; by 0 below −708.
///
/// x = k·ln 2 + r with a whole k (Cody & Waite, *Software Manual for the Elementary Functions*, 1980),
/// then the series of e^r, times 2^k put together from its bits. The loop has no branch, so the compiler
/// makes vectors of it, several at a time.
#[inline(always)]
pub(crate) fn exponentiate_non_positive(values: &mut [f64]) {
    for value in values {
        let kept = if *value > LEAST { *value } else { LEAST };
        let shifted = kept * LOG2_E + ROUNDER;
        let k = shifted - ROUNDER;
        let r = (kept - k * LN_2_HIGH) - k * LN_2_LOW;
        let mut series = SERIES[0];
        for term in &SERIES[1..] {
            series = series * r + term;
        }
        let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
        *value = if *value > LEAST { series * power } else { 0.0 };
    }
}

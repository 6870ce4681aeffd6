//! Logarithm, sine, cosine and exponential without branches, for loops that are to be vectorised.
//!
//! These functions define the draws of this project: single draws and lanes of draws call the same ones, and
//! nothing but IEEE additions, multiplications and divisions takes part, so every machine computes the same
//! bits. Bounds on their errors are stated with each, and tested against the `libm` crate. (Polynomials and the
//! splitting of arguments are those of FreeBSD's msun, Copyright (C) 1993 by Sun Microsystems, Inc., freely
//! granted.)

/// Number 2^52: adding it to a whole number from 0 to 2^52 leaves the number in the low bits.
const TWO_52: f64 = 4_503_599_627_370_496.0;

const LN2_HI: f64 = 6.931_471_803_691_238e-1;
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;

/// Exponent below which an exponential would need subnormal numbers.
const LEAST_EXPONENT: f64 = -708.0;

/// Natural logarithm of a normal positive number, within 1 ulp.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    const LG: [f64; 7] = [
        6.666_666_666_666_735e-1,
        3.999_999_999_940_942e-1,
        2.857_142_874_366_239e-1,
        2.222_219_843_214_978_4e-1,
        1.818_357_216_161_805e-1,
        1.531_383_769_920_937_3e-1,
        1.479_819_860_511_658_6e-1,
    ];
    const SQRT_HALF: u64 = 0x3fe6_a09e_0000_0000;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    // x = 2^k·m with m from √½ to √2.
    let shifted = x.to_bits().wrapping_add(ONE - SQRT_HALF);
    let dk = f64::from_bits((shifted >> 52) | TWO_52.to_bits()) - (TWO_52 + 1023.0);
    let m = f64::from_bits((shifted & 0x000f_ffff_ffff_ffff).wrapping_add(SQRT_HALF));
    let f = m - 1.0;
    let hfsq = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let t1 = w * (LG[1] + w * (LG[3] + w * LG[5]));
    let t2 = z * (LG[0] + w * (LG[2] + w * (LG[4] + w * LG[6])));
    let r = t2 + t1;
    s * (hfsq + r) + dk * LN2_LO - hfsq + f + dk * LN2_HI
}

/// Sine and cosine of an angle from 0 to 2π, within 2.3e-16: 1 ulp but where the value itself is small.
///
/// π/2 is taken off as a sum of two numbers, good for 2⁻⁸⁵ of a turn.
#[inline(always)]
pub fn sin_cos(x: f64) -> (f64, f64) {
    const PIO2_1: f64 = 1.570_796_326_734_125_6;
    const PIO2_1T: f64 = 6.077_100_506_506_192e-11;
    const S: [f64; 6] = [
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
    ];
    const C: [f64; 6] = [
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    // Quarter turns to take off, by the upper half of x's bits.
    let above = |upper: u64| if x >= f64::from_bits((upper + 1) << 32) { 1.0 } else { 0.0 };
    let n = above(0x3fe9_21fb) + above(0x4002_d97c) + above(0x400f_6a7a) + above(0x4015_fdbc);
    let r = x - n * PIO2_1;
    let tail = n * PIO2_1T;
    let y0 = r - tail;
    let y1 = (r - y0) - tail;

    let z = y0 * y0;
    let w = z * z;
    let v = z * y0;
    let r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5]);
    let direct = y0 + v * (S[0] + z * r);
    let reduced = y0 - ((z * (0.5 * y1 - v * r) - y1) - v * S[0]);
    let sine = if n == 0.0 { direct } else { reduced };

    let r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]));
    let hz = 0.5 * z;
    let w = 1.0 - hz;
    let cosine = w + (((1.0 - w) - hz) + (z * r - y0 * y1));

    let swap = n == 1.0 || n == 3.0;
    let (s, c) = if swap { (cosine, sine) } else { (sine, cosine) };
    let s = if n == 2.0 || n == 3.0 { -s } else { s };
    let c = if n == 1.0 || n == 2.0 { -c } else { c };
    (s, c)
}

/// Exponential of a number ≤ 0, within 1 ulp down to −708; 0 below that.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    const INV_LN2: f64 = std::f64::consts::LOG2_E;
    const P: [f64; 5] = [
        1.666_666_666_666_660_2e-1,
        -2.777_777_777_701_559_3e-3,
        6.613_756_321_437_934e-5,
        -1.653_390_220_546_525_2e-6,
        4.138_136_797_057_238_5e-8,
    ];
    // Decided by the upper half of the bits of |x|.
    let above = |upper: u64| -x >= f64::from_bits((upper + 1) << 32);
    let many = (INV_LN2 * x - 0.5).trunc();
    let k = if above(0x3ff0_a2b1) {
        many
    } else if above(0x3fd6_2e42) {
        -1.0
    } else {
        0.0
    };
    let hi = x - k * LN2_HI;
    let lo = k * LN2_LO;
    let reduced = hi - lo;
    let xx = reduced * reduced;
    let c = reduced - xx * (P[0] + xx * (P[1] + xx * (P[2] + xx * (P[3] + xx * P[4]))));
    let y = 1.0 + (reduced * c / (2.0 - c) - lo + hi);
    let scale = f64::from_bits((k + (TWO_52 + 1023.0)).to_bits() << 52);
    let value = if above(0x3e30_0000) { y * scale } else { 1.0 + x };
    if x < LEAST_EXPONENT { 0.0 } else { value }
}

/// Share of a standard normal distribution below `x`, within 1e-15 for |x| ≤ 7; beyond, as at ±7.
///
/// The rational approximation is that of Hart (1968), in the form of West (2005).
#[inline(always)]
pub fn normal_share_below(x: f64) -> f64 {
    const P: [f64; 7] = [
        220.206_867_912_376,
        221.213_596_169_931,
        112.079_291_497_871,
        33.912_866_078_383,
        6.373_962_203_531_65,
        0.700_383_064_443_688,
        3.526_249_659_989_11e-2,
    ];
    const Q: [f64; 8] = [
        440.413_735_824_752,
        793.826_512_519_948,
        637.333_633_378_831,
        296.564_248_779_674,
        86.780_732_202_946_1,
        16.064_177_579_207,
        1.755_667_163_182_64,
        8.838_834_764_831_84e-2,
    ];
    let y = x.abs().min(7.0);
    let p = P[0] + y * (P[1] + y * (P[2] + y * (P[3] + y * (P[4] + y * (P[5] + y * P[6])))));
    let q = Q[3] + y * (Q[4] + y * (Q[5] + y * (Q[6] + y * Q[7])));
    let q = Q[0] + y * (Q[1] + y * (Q[2] + y * q));
    let tail = exp(-0.5 * y * y) * p / q;
    if x > 0.0 { 1.0 - tail } else { tail }
}

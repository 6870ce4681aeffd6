//! The exponential of the Gaussian activation in `f32`.
//!
//! It gives the same bits on host and target, because it uses plain `f32` arithmetic.

/// 1.5·2^23: adding and subtracting it rounds to the nearest integer, which the sum's low bits then hold.
pub const ROUND: f32 = 12_582_912.0;

/// Two numbers whose sum is ln 2. The first has 10 significant bits, so that its product with any integer in
/// the range of [`exp`] is exact.
pub const LN_2_PARTS: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// Coefficients of [`exp`] for e^r on |r| ≤ ½ ln 2, from degree 6 down to 0.
pub const EXP_COEFFICIENTS: [f32; 7] =
    [0.001_384_461, 0.008_374_151, 0.041_667_98, 0.166_664_32, 0.499_999_94, 1.0, 1.0];

/// e^`x` for `x` ≤ 87, by a polynomial: within 2 ulp on [−87, 0] (tested), no division, no table.
///
/// Range reduction x = n·ln 2 + r by Cody and Waite (Software Manual for the Elementary
/// Functions, 1980, ch. 6), then a degree-6 minimax polynomial for e^r on |r| ≤ ½ ln 2 whose
/// relative error is 2.0e-9; the power of two goes straight into the exponent bits.
/// `exp(0)` is exactly 1; below −87 the result is 0, so that no subnormal is ever produced.
///
/// The activation's argument −‖x − c‖²/(2σ²) is never positive; those of a contact's form are not large. The results for
/// larger numbers and for NaN are not defined ([`Decoder`](crate::Decoder) marks rows with NaN readings instead).
#[inline]
pub fn exp(x: f32) -> f32 {
    let [high, low] = LN_2_PARTS;
    let [c6, c5, c4, c3, c2, c1, c0] = EXP_COEFFICIENTS;

    if x < -87.0 {
        return 0.0;
    }
    let rounded = x * core::f32::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    let r = (x - n * high) - n * low;
    let mantissa = (((((c6 * r + c5) * r + c4) * r + c3) * r + c2) * r + c1) * r + c0;
    mantissa * f32::from_bits(rounded.to_bits().wrapping_add(127) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_underflows_to_zero_and_never_panics() {
        for x in [-87.1, -1e3, -1e30, f32::NEG_INFINITY] {
            assert_eq!(exp(x), 0.0, "exp({x})");
        }
        assert_eq!(exp(0.0), 1.0);
        for x in [f32::NAN, f32::INFINITY, f32::MAX, 1e10, 89.0] {
            let _ = exp(x);
        }
    }
}

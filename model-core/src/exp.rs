//! Exponentials for the Gaussian activation, to choose from.
//!
//! Every exponential is a zero-sized type, so that a device links only the one it names. Each gives the
//! same bits on host and target, because it uses plain `f32` arithmetic or a pure-Rust library. Two different
//! exponentials do not give the same bits.

/// An exponential of non-positive numbers.
///
/// The activation's argument −‖x − c‖²/(2σ²) is never positive, so no other argument is needed. The results for
/// positive numbers and for NaN are not defined ([`Decoder`](crate::Decoder) marks rows with NaN readings instead).
/// None panics there, but for an assertion of micromath's own above 88 in debug builds.
pub trait ExpKernel: Copy + Default {
    /// Name of the exponential, as users choose it.
    const NAME: &'static str;
    /// e^`x` for `x` ≤ 0.
    fn exp(x: f32) -> f32;
}

/// `libm::expf`: within 1 ulp on [−87, 0] (tested), the most accurate, and the reference for the others.
#[derive(Debug, Clone, Copy, Default)]
pub struct Libm;

/// `micromath`'s exponential, a feature of its name: relative error up to 2.4e-3 on [−30, 0], and not even faster on a Cortex-M4F.
///
/// It is here so that users can compare it. Below −80 it is wrong by orders of magnitude, so such arguments
/// give 0.
#[cfg(feature = "micromath")]
#[derive(Debug, Clone, Copy, Default)]
pub struct Micromath;

/// The default exponential, a polynomial: within 2 ulp on [−87, 0] (tested), no division, no table.
///
/// Range reduction x = n·ln 2 + r by Cody and Waite (Software Manual for the Elementary
/// Functions, 1980, ch. 6), then a degree-6 minimax polynomial for e^r on |r| ≤ ½ ln 2 whose
/// relative error is 2.0e-9; the power of two goes straight into the exponent bits.
/// `exp(0)` is exactly 1; below −87 the result is 0, so that no subnormal is ever produced.
#[derive(Debug, Clone, Copy, Default)]
pub struct Polynomial;

impl ExpKernel for Libm {
    const NAME: &'static str = "libm";
    #[inline]
    fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
}

#[cfg(feature = "micromath")]
impl ExpKernel for Micromath {
    const NAME: &'static str = "micromath";
    #[inline]
    fn exp(x: f32) -> f32 {
        if x < -80.0 {
            return 0.0;
        }
        // Called through the wrapper type: if a dependency turns on `std`, its `exp` takes precedence over the
        // extension trait's, and host and device would disagree.
        micromath::F32(x).exp().0
    }
}

/// 1.5·2^23: adding and subtracting it rounds to the nearest integer, which the sum's low bits then hold.
pub const ROUND: f32 = 12_582_912.0;

/// Two numbers whose sum is ln 2. The first has 10 significant bits, so that its product with any integer in
/// the range of [`Polynomial`] is exact.
pub const LN_2_PARTS: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// Coefficients of [`Polynomial`] for e^r on |r| ≤ ½ ln 2, from degree 6 down to 0.
pub const EXP_COEFFICIENTS: [f32; 7] =
    [0.001_384_461, 0.008_374_151, 0.041_667_98, 0.166_664_32, 0.499_999_94, 1.0, 1.0];

/// Coefficients of [`exp2`] for 2^f on |f| ≤ ½, from degree 5 down to 0.
pub const EXP2_COEFFICIENTS: [f32; 6] =
    [0.001_317_25, 0.009_672_681, 0.055_510_68, 0.240_222_17, 0.693_146_7, 1.0];

impl ExpKernel for Polynomial {
    const NAME: &'static str = "polynomial";
    #[inline]
    fn exp(x: f32) -> f32 {
        let [high, low] = LN_2_PARTS;
        let [c6, c5, c4, c3, c2, c1, c0] = EXP_COEFFICIENTS;

        if x < -87.0 {
            return 0.0;
        }
        let n = (x * core::f32::consts::LOG2_E + ROUND) - ROUND;
        let r = (x - n * high) - n * low;
        let mantissa = (((((c6 * r + c5) * r + c4) * r + c3) * r + c2) * r + c1) * r + c0;
        mantissa * f32::from_bits(((n as i32).wrapping_add(127) as u32) << 23)
    }
}

/// 2^`u` for `u` from −126 to 1, within 2 ulp (tested); elsewhere the result is meaningless. It is the exponential
/// of networks with [expanded distances](crate::rbf::expanded).
///
/// A degree-5 polynomial for 2^f on |f| ≤ ½, fitted so that its error and that of rounding stay below 1.9 ulp
/// together; the power of two goes straight into the exponent bits. Base 2 needs no reduction by ln 2, so that
/// 13 operations suffice.
#[inline]
pub fn exp2(u: f32) -> f32 {
    let [c5, c4, c3, c2, c1, c0] = EXP2_COEFFICIENTS;

    let rounded = u + ROUND;
    let f = u - (rounded - ROUND);
    let p = ((((f * c5 + c4) * f + c3) * f + c2) * f + c1) * f + c0;
    f32::from_bits(p.to_bits().wrapping_add(rounded.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error over `lo..=0`, in units in the last place of the true value.
    fn worst_ulp<E: ExpKernel>(lo: f32) -> f64 {
        let steps = 4_000_000;
        (0..=steps)
            .map(|i| {
                let x = lo * (i as f32 / steps as f32);
                let truth = f64::from(x).exp();
                let ulp = f64::from((truth as f32).next_up() - truth as f32);
                (f64::from(E::exp(x)) - truth).abs() / ulp
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn polynomial_is_within_two_ulp_down_to_minus_87() {
        let worst = worst_ulp::<Polynomial>(-87.0);
        assert!(worst <= 2.0, "{worst} ulp");
    }

    #[test]
    fn libm_is_within_one_ulp_down_to_minus_87() {
        let worst = worst_ulp::<Libm>(-87.0);
        assert!(worst <= 1.0, "{worst} ulp");
    }

    #[test]
    fn micromath_keeps_its_stated_bound_and_is_no_better() {
        let worst = (0..=300_000)
            .map(|i| {
                let x = -30.0 * (i as f32 / 300_000.0);
                (f64::from(Micromath::exp(x)) / f64::from(x).exp() - 1.0).abs()
            })
            .fold(0.0, f64::max);
        assert!((1e-4..=2.5e-3).contains(&worst), "{worst}");
    }

    #[test]
    fn every_kernel_is_finite_and_ends_at_zero_for_huge_distances() {
        for x in [-80.1, -87.0, -87.1, -1e3, -1e30, f32::NEG_INFINITY] {
            for y in [Libm::exp(x), Micromath::exp(x), Polynomial::exp(x)] {
                assert!((0.0..1e-34).contains(&y), "exp({x}) = {y}");
            }
        }
        assert_eq!(Polynomial::exp(0.0), 1.0);
    }

    #[test]
    fn libm_and_the_polynomials_panic_for_no_argument() {
        for x in [f32::NAN, f32::INFINITY, f32::MAX, 1e10, 89.0] {
            let results = [Libm::exp(x), Polynomial::exp(x), exp2(x)];
            assert!(results[0].is_nan() || results[0].is_infinite() || x < 90.0, "{results:?}");
        }
    }

    #[test]
    fn polynomial_never_makes_a_subnormal() {
        for i in 0..200_000 {
            let y = Polynomial::exp(-86.9 - i as f32 * 1e-6);
            assert!(y == 0.0 || y.is_normal());
        }
    }
}

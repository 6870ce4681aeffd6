//! The exponential of the Gaussian activation, as a choice of kernels.
//!
//! Every kernel is a zero-sized type, so that a device links only the one it names. All agree
//! between host and target bit for bit, because each uses plain `f32` arithmetic or a
//! pure-Rust library; they do not agree with one another.

/// The exponential of a non-positive number.
///
/// The activation's argument −‖x − c‖²/(2σ²) is never positive: that is all a kernel must
/// serve. A NaN argument has no defined result (inference refuses NaN readings before).
pub trait ExpKernel: Copy + Default {
    /// The kernel's name, as users choose it.
    const NAME: &'static str;
    /// e^`x` for `x` ≤ 0.
    fn exp(x: f32) -> f32;
}

/// `libm::expf`: within 1 ulp, the most accurate and the reference for the others.
#[derive(Debug, Clone, Copy, Default)]
pub struct Libm;

/// `micromath`: relative error up to 2.4e-3 on [−30, 0] and not even faster on a Cortex-M4F;
/// here so that users can see it measured. Below −80 it is wrong by orders of magnitude, so
/// such arguments give 0.
#[derive(Debug, Clone, Copy, Default)]
pub struct Micromath;

/// Own polynomial: within 2 ulp on [−87, 0] (tested), no division, no table. The default.
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

impl ExpKernel for Micromath {
    const NAME: &'static str = "micromath";
    #[inline]
    fn exp(x: f32) -> f32 {
        if x < -80.0 {
            return 0.0;
        }
        // Through the wrapper type: the extension trait's `exp` gives way to std's as soon as a
        // dependency turns std on, and host and device would then disagree.
        micromath::F32(x).exp().0
    }
}

/// Adding and subtracting 1.5·2^23 rounds to the nearest integer, which the sum's low bits then hold.
pub const ROUND: f32 = 12_582_912.0;

/// ln 2 in two parts: their sum is ln 2. The first has 10 significant bits, so that its product with a whole
/// number of [`Polynomial`]'s range is exact.
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
        mantissa * f32::from_bits(((n as i32 + 127) as u32) << 23)
    }
}

/// 2^`u`, for `u` from −126 to 1: the exponential of networks with
/// [expanded distances](crate::rbf::expanded), within 2 ulp (tested). Elsewhere the result is meaningless.
///
/// A degree-5 polynomial for 2^f on |f| ≤ ½, fitted so that its error and that of rounding stay below 1.9 ulp
/// together; the power of two goes straight into the exponent bits. In the logarithm to base 2 there is
/// no reduction by ln 2, and 13 operations are all.
#[inline]
#[must_use]
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
    fn polynomial_never_makes_a_subnormal() {
        for i in 0..200_000 {
            let y = Polynomial::exp(-86.9 - i as f32 * 1e-6);
            assert!(y == 0.0 || y.is_normal());
        }
    }
}

//! Readings relative to the baseline: R/R₀, dimensionless.
//!
//! A drift of the gain multiplies all readings of a session, those of the baseline too. It cancels in R/R₀.
//! A model says whether it takes such inputs ([`Metadata::relative_inputs`](crate::blob::Metadata::relative_inputs)).
//!
//! These two functions are the contract between host and device. Both compute in `f32`: one division for each
//! channel when a baseline comes into force, and one multiplication for each reading. So both get the same bits.

/// Reciprocal 1/R₀ of a channel's `baseline`, in one over the reading's unit.
///
/// NaN for a baseline that is missing (NaN), zero, negative or infinite, or so small that 1/R₀ is beyond `f32`. The
/// channel is missing then: [`relative`] is NaN whatever its reading is.
///
/// ```
/// use taxel_core::relative::reciprocal;
/// assert_eq!(reciprocal(64.0), 0.015625);
/// assert!([f32::NAN, 0.0, -64.0, f32::INFINITY, 1e-45].into_iter().all(|baseline| reciprocal(baseline).is_nan()));
/// ```
#[inline]
pub fn reciprocal(baseline: f32) -> f32 {
    let reciprocal = 1.0 / baseline;
    let is_level = baseline > 0.0 && baseline.is_finite();
    if is_level && reciprocal.is_finite() { reciprocal } else { f32::NAN }
}

/// Reading relative to its baseline, R/R₀, from the `reading` R and the [`reciprocal`] of its baseline.
///
/// A missing reading (NaN), or one without a baseline, gives NaN. This is a product, not a quotient: the last bit
/// may differ from that of R/R₀.
///
/// ```
/// use taxel_core::relative::{reciprocal, relative};
/// let per_baseline = reciprocal(64.0);
/// assert_eq!(relative(48.0, per_baseline), 0.75);
/// // Twice the gain, and twice the baseline: the same input.
/// assert_eq!(relative(96.0, reciprocal(128.0)), 0.75);
/// assert!(relative(48.0, reciprocal(0.0)).is_nan() && relative(f32::NAN, per_baseline).is_nan());
/// ```
#[inline]
pub fn relative(reading: f32, reciprocal: f32) -> f32 {
    reading * reciprocal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_with_the_reciprocal_is_within_two_roundings() {
        let mut differs = 0;
        for step in 0..20_000_u16 {
            let (reading, baseline) =
                (30.0 + f32::from(step) * 0.01, 90.0 - f32::from(step) * 0.003);
            let (found, exact) =
                (relative(reading, reciprocal(baseline)), f64::from(reading) / f64::from(baseline));
            // Half a unit in the last place for each of two roundings.
            assert!((f64::from(found) / exact - 1.0).abs() <= 1.01 * f64::from(f32::EPSILON));
            differs += usize::from(found.to_bits() != (reading / baseline).to_bits());
        }
        assert!(differs > 1000, "the contract is the product: {differs} quotients differ from it");
    }
    #[test]
    fn a_baseline_that_is_none_has_no_reciprocal() {
        let none = [f32::NAN, 0.0, -0.0, f32::INFINITY, 1e-45];
        assert!(none.into_iter().all(|baseline| reciprocal(baseline).is_nan()));
    }
}

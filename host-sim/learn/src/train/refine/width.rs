//! The narrowest Gaussians that a number format holds.

use std::f64::consts::LOG2_E;

use taxel_core::rbf::Format;
use taxel_core::rbf::fixed16::{DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS};
use taxel_core::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP};

/// Part by which widths stay above the limit, since centres and widths are rounded.
const MARGIN: f64 = 2e-4;

/// Largest exponent, in powers of two, that fixed16 holds for any reading. The format f32 holds 125, but
/// narrower Gaussians need large weights, and then its fast distances are not accurate enough.
const LARGEST_EXPONENT: f64 = 64.0;

/// Width to which a width that starts at `start` may shrink, at most: the least that the format needs. Networks in
/// f32 may stay narrower if they start so, with exact distances where fast ones do not serve.
pub(super) fn floor_at_most(format: Format, start: f64) -> f64 {
    match format {
        Format::F32Direct => 0.0,
        Format::F32 => start,
        Format::Fixed16 => f64::INFINITY,
    }
}

/// Least width σ with which a `format` of 16-bit exponents holds Gaussians at `centres` (`centres × inputs`).
///
/// Inputs are clamped to a box about the middle of their training `ranges`, which all have the widest one's span
/// and the clamp's margin. In a corner of it log₂e·‖x − c‖²/2σ² must not pass [`LARGEST_EXPONENT`]. With few
/// inputs that is near, and fixed16 then ends where its decay no longer fits 32 bits.
pub(super) fn least(format: Format, centres: &[f64], ranges: &[[f64; 2]]) -> f64 {
    let span = ranges.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    let half = f64::from(HALF_RANGE) * span;
    let reach = |centre: &[f64]| -> f64 {
        let inputs = centre.iter().zip(ranges);
        inputs.map(|(c, [low, high])| ((c - 0.5 * (low + high)).abs() + half).powi(2)).sum()
    };
    let farthest = centres.chunks_exact(ranges.len()).map(reach).fold(0.0, f64::max);
    let mut square = LOG2_E * farthest / (2.0 * LARGEST_EXPONENT);
    if format == Format::Fixed16 {
        square = square.max(least_square_of_fixed16());
    }
    square.sqrt() * (1.0 + MARGIN)
}

/// Least σ² whose decay fits the 32 bits that fixed16 has for it.
fn least_square_of_fixed16() -> f64 {
    let step = f64::from(HALF_RANGE) / f64::from(UNITS) * f64::from(UNITS_PER_STEP);
    let one = 2_f64.powi((DECAY_FRACTION_BITS + EXPONENT_FRACTION_BITS).cast_signed());
    LOG2_E / 2.0 * step * step * one / f64::from(u32::MAX)
}

//! The narrowest Gaussians that fixed16 holds.

use std::f64::consts::LOG2_E;

use taxel_core::rbf::fixed16::{DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS};
use taxel_core::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP};

/// Part by which widths stay above the limit, since centres and widths are rounded.
const MARGIN: f64 = 2e-4;

/// Largest exponent, in powers of two, that fixed16 holds for any reading.
const LARGEST_EXPONENT: f64 = 64.0;

/// Least width σ with which fixed16 holds Gaussians at `centres` (`centres × inputs`).
///
/// Inputs are clamped to a box about the middle of their training `ranges`, which all have the widest one's span
/// and the clamp's margin. In a corner of it log₂e·‖x − c‖²/2σ² must not pass 64. With few inputs that is near, and the
/// format then ends where its decay no longer fits 32 bits.
pub fn least(centres: &[f64], ranges: &[[f64; 2]]) -> f64 {
    let span = ranges.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    let half = f64::from(HALF_RANGE) * span;
    let reach = |centre: &[f64]| -> f64 {
        let inputs = centre.iter().zip(ranges);
        inputs.map(|(c, [low, high])| ((c - 0.5 * (low + high)).abs() + half).powi(2)).sum()
    };
    let farthest = centres.chunks_exact(ranges.len()).map(reach).fold(0.0, f64::max);
    let square = LOG2_E * farthest / (2.0 * LARGEST_EXPONENT);
    square.max(least_square_of_decay()).sqrt() * (1.0 + MARGIN)
}

/// Least σ² whose decay fits the 32 bits that fixed16 has for it.
fn least_square_of_decay() -> f64 {
    let step = f64::from(HALF_RANGE) / f64::from(UNITS) * f64::from(UNITS_PER_STEP);
    let one = 2_f64.powi((DECAY_FRACTION_BITS + EXPONENT_FRACTION_BITS).cast_signed());
    LOG2_E / 2.0 * step * step * one / f64::from(u32::MAX)
}

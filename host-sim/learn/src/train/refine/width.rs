//! The narrowest Gaussians that a number format holds.

use model_core::rbf::Format;
use model_core::scale::HALF_RANGE;

/// Part by which widths stay above the limit, since centres and widths are rounded.
const MARGIN: f64 = 2e-4;

/// Largest exponent, in powers of two, that fixed16 holds for any reading. The format f32 holds 125, but
/// narrower Gaussians need large weights, and then its fast distances are not accurate enough.
const LARGEST_EXPONENT: f64 = 64.0;

/// Least width σ with which `format` holds Gaussians at `centres` (`centres × inputs`); 0 for no limit.
///
/// Inputs are clamped to a box about the middle of their training `ranges`, which all have the widest one's span
/// and the clamp's margin. In a corner of it log₂e·‖x − c‖²/2σ² must not pass [`LARGEST_EXPONENT`].
pub(super) fn least(format: Format, centres: &[f64], ranges: &[[f64; 2]]) -> f64 {
    if format == Format::F32Direct {
        return 0.0;
    }
    let span = ranges.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    let half = f64::from(HALF_RANGE) * span;
    let reach = |centre: &[f64]| -> f64 {
        let inputs = centre.iter().zip(ranges);
        inputs.map(|(c, [low, high])| ((c - 0.5 * (low + high)).abs() + half).powi(2)).sum()
    };
    let farthest = centres.chunks_exact(ranges.len()).map(reach).fold(0.0, f64::max);
    (std::f64::consts::LOG2_E * farthest / (2.0 * LARGEST_EXPONENT)).sqrt() * (1.0 + MARGIN)
}

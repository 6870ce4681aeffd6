//! Form of a contact: how deep it is at a place.
//!
//! Δz = d·exp(−v^p) with v = q/2s² and q = a·u² + 2b·u·w + w²/a, where (u, w) lead from the centre to the place: a Gaussian dent of
//! radius s for a = 1, b = 0 and p = 1; an ellipse for other a and b; flatter for a larger exponent p, with a longer tail for a
//! smaller one. Latents are ln a/2, b and ln p.

use super::walk::Latents;
use crate::exp::exp;

/// Latents that the depth of a place depends on, by their places in [`Latents`]: all but the shear.
pub const OF_DEPTH: [usize; 7] = [0, 1, 2, 3, 6, 7, 8];

/// Least q in mm², so that its logarithm is finite.
const LEAST_SQUARE: f32 = 1e-6;

/// A contact at one moment.
pub struct Dent {
    centre_mm: [f32; 2],
    depth_mm: f32,
    radius_mm: f32,
    /// a and 1/a.
    stretch: [f32; 2],
    turn: f32,
    exponent: f32,
}

/// Depth of a place, and its derivatives by the latents [`OF_DEPTH`].
pub struct Depth {
    pub mm: f32,
    pub slopes: [f32; 7],
}

impl Dent {
    pub fn new([x, y, depth_mm, radius_mm, _, _, stretch, turn, form]: Latents) -> Self {
        Self {
            centre_mm: [x, y],
            depth_mm,
            radius_mm,
            stretch: [exponential(2.0 * stretch), exponential(-2.0 * stretch)],
            turn,
            exponent: exponential(form),
        }
    }

    /// Depth at a place.
    pub fn at(&self, [x, y]: [f32; 2]) -> Depth {
        let Self { depth_mm, radius_mm, stretch: [a, c], turn: b, exponent: p, .. } = *self;
        let [u, w] = [x - self.centre_mm[0], y - self.centre_mm[1]];
        let square = (a * u * u + 2.0 * b * u * w + c * w * w).max(LEAST_SQUARE);
        let logarithm = libm::logf(square / (2.0 * radius_mm * radius_mm));
        let power = exponential(p * logarithm);
        let share = exp(-power);
        let mm = depth_mm * share;
        // −∂Δz/∂ln v
        let fall = mm * p * power;
        let along = 2.0 * fall / square;
        Depth {
            mm,
            slopes: [
                along * (a * u + b * w),
                along * (b * u + c * w),
                share,
                2.0 * fall / radius_mm,
                -along * (a * u * u - c * w * w),
                -along * u * w,
                -fall * logarithm,
            ],
        }
    }
}

/// e^`x` for any sign; as large as a number can be where it would overflow.
fn exponential(x: f32) -> f32 {
    if x > 0.0 { 1.0 / exp(-x).max(f32::MIN_POSITIVE) } else { exp(x) }
}

//! Form of a contact: how deep it is at a place.
//!
//! Δz = d·exp(−v^p) with v = q/2s² and q = a·u² + 2b·u·w + w²/a, where (u, w) lead from the centre to the place: a Gaussian dent of
//! radius s for a = 1, b = 0 and p = 1; an ellipse for other a and b; flatter for a larger exponent p, with a longer tail for a
//! smaller one. Latents are ln a/2, b and ln p.

use core::f32::consts::LN_2;

use super::walk::Latents;
use crate::exp::exp;

/// Latents that the depth of a place depends on, by their places in [`Latents`]: all but the shear.
pub const OF_DEPTH: [usize; 7] = [0, 1, 2, 3, 6, 7, 8];

/// Least q in mm², so that its logarithm is finite.
const LEAST_SQUARE: f32 = 1e-6;

/// Largest logarithm of v^p: a dent is 0 long before.
const MOST_LOGARITHM: f32 = 20.0;

/// What a contact has of its latents but its place and its depth, which differ from row to row.
pub struct Form {
    /// a and 1/a.
    stretch: [f32; 2],
    turn: f32,
    exponent: f32,
    /// 1/2s² and 2/s.
    inverse_square: f32,
    twice_inverse: f32,
}

/// Depth of a place, and its derivatives by the latents [`OF_DEPTH`].
pub struct Depth {
    pub mm: f32,
    pub slopes: [f32; 7],
}

impl Form {
    pub fn new([_, _, _, radius_mm, _, _, stretch, turn, form]: Latents) -> Self {
        let a = exp(2.0 * stretch);
        Self {
            stretch: [a, 1.0 / a],
            turn,
            exponent: exp(form),
            inverse_square: 0.5 / (radius_mm * radius_mm),
            twice_inverse: 2.0 / radius_mm,
        }
    }

    /// Depth at a place under a contact of this form, and its derivatives.
    #[inline(never)] // in one place, and small
    pub fn at(&self, latents: &Latents, place_mm: [f32; 2]) -> Depth {
        let Self { stretch: [a, c], exponent: p, twice_inverse, .. } = *self;
        let Falloff { away: [u, w], slope, square, logarithm, power, share } =
            self.falloff(latents, place_mm);
        let mm = latents[2] * share;
        // −∂Δz/∂ln v
        let fall = mm * p * power;
        let along = 2.0 * fall / square;
        let slopes = [
            along * slope[0],
            along * slope[1],
            share,
            twice_inverse * fall,
            -along * (a * u * u - c * w * w),
            -along * u * w,
            -fall * logarithm,
        ];
        Depth { mm, slopes }
    }

    /// Depth at a place alone.
    pub fn mm(&self, latents: &Latents, place_mm: [f32; 2]) -> f32 {
        latents[2] * self.falloff(latents, place_mm).share
    }

    #[inline(always)]
    fn falloff(&self, [centre_x, centre_y, ..]: &Latents, [x, y]: [f32; 2]) -> Falloff {
        let Self { stretch: [a, c], turn: b, exponent: p, inverse_square, .. } = *self;
        let away = [x - centre_x, y - centre_y];
        let slope = [a * away[0] + b * away[1], b * away[0] + c * away[1]];
        let square = slope[0] * away[0] + slope[1] * away[1];
        let square = if square > LEAST_SQUARE { square } else { LEAST_SQUARE };
        let logarithm = logarithm(square * inverse_square);
        let of_power = p * logarithm;
        let power = exp(if of_power < MOST_LOGARITHM { of_power } else { MOST_LOGARITHM });
        Falloff { away, slope, square, logarithm, power, share: exp(-power) }
    }
}

/// Way from the centre to a place, q with half its slope, ln v, v^p, and the depth over the deepest.
struct Falloff {
    away: [f32; 2],
    slope: [f32; 2],
    square: f32,
    logarithm: f32,
    power: f32,
    share: f32,
}

/// Natural logarithm of a positive normal number, within 1 ppm of the larger of itself and 1. By the series of
/// ln m = 2·artanh((m − 1)/(m + 1)) for a fraction m from √½ to √2.
fn logarithm(x: f32) -> f32 {
    const ROOT_HALF: u32 = 0x3F35_04F3;
    let exponent = x.to_bits().wrapping_sub(ROOT_HALF).cast_signed() >> 23;
    let fraction = f32::from_bits(x.to_bits().wrapping_sub(exponent.cast_unsigned() << 23));
    let ratio = (fraction - 1.0) / (fraction + 1.0);
    let square = ratio * ratio;
    let series = 1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0)));
    exponent as f32 * LN_2 + 2.0 * ratio * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_are_natural_ones() {
        let mut x = f32::MIN_POSITIVE;
        while x < 1e38 {
            let expected = f64::from(x).ln();
            let error = (f64::from(logarithm(x)) - expected) / expected.abs().max(1.0);
            assert!(error.abs() < 1e-6, "{x}: {error}");
            x *= 1.0007;
        }
    }
}

//! What stands before a network that sees whole frames, on lines side by side: operations and their order are those of
//! [`taxel_core::touch`] and [`taxel_core::projection`].

use taxel_core::projection::Projection;
use taxel_core::touch::{Touch, binary_logarithm, twice_beyond};
use taxel_data::simd::LANES;

use super::column::Column;
use super::float32::add_terms;

/// Turns columns of readings, and one more, into the shape of a touch and the logarithm of its strength. Returns the
/// strength.
#[inline(always)]
pub(super) fn apply(touch: Touch<'_>, columns: &mut [Column]) -> Column {
    let of = touch.strengths();
    let (shape, logarithm) = columns.split_at_mut(touch.readings());
    let mut strength = Column([0.0; LANES]);
    for (column, [level, threshold]) in shape.iter_mut().zip(touch.pairs()) {
        for (input, sum) in column.0.iter_mut().zip(&mut strength.0) {
            let [twice, signed] = twice_beyond(*input - level, *threshold, of.side);
            *sum += twice;
            *input = signed;
        }
    }
    let mut scale = Column([0.0; LANES]);
    for (strength, scale) in strength.0.iter_mut().zip(&mut scale.0) {
        *strength = 0.5 * *strength + of.floor;
        *scale = 0.5 / *strength;
    }
    for column in shape {
        for (input, scale) in column.0.iter_mut().zip(&scale.0) {
            *input *= scale;
        }
    }
    for column in logarithm {
        for (input, strength) in column.0.iter_mut().zip(&strength.0) {
            *input = binary_logarithm(strength + of.logarithm_floor);
        }
    }
    strength
}

/// Projects columns of readings to columns of features.
#[inline(always)]
pub(super) fn project(projection: Projection<'_>, readings: &[Column], features: &mut [Column]) {
    let (start, parts) = projection.block().split_at(features.len());
    for (feature, start) in features.iter_mut().zip(start) {
        feature.0.fill(*start);
    }
    add_terms(readings, parts, features);
}

/// Makes outputs of a network what they are at this `strength` of the touch.
#[inline(always)]
pub(super) fn with_strength(touch: Touch<'_>, strength: &Column, outputs: &mut [Column]) {
    let mut factor = Column([0.0; LANES]);
    for (factor, strength) in factor.0.iter_mut().zip(&strength.0) {
        *factor = touch.factor(*strength).unwrap_or(f32::NAN);
    }
    for column in outputs {
        for (output, factor) in column.0.iter_mut().zip(&factor.0) {
            *output *= factor;
        }
    }
}

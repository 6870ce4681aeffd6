//! Inference of a network in 16-bit fixed point on lines side by side, in the integers of [`taxel_core::rbf::fixed16`].

use taxel_core::exp::ROUND;
use taxel_core::rbf::Shape;
use taxel_core::rbf::fixed16::{CENTRES_AT_ONCE, Network, power, shared_term, words_at_once};
use taxel_core::scale::{UNITS, UNITS_PER_STEP};
use taxel_data::simd::LANES;

use super::column::Column;
use super::pairs::add_products;

/// Number of pairs in a group of centres.
const PAIRS_AT_ONCE: usize = CENTRES_AT_ONCE / 2;

/// Working space: pairs of inputs, and sums.
pub(super) struct Scratch {
    pairs: Vec<Column<u32>>,
    sums: Vec<Column<i32>>,
}

impl Scratch {
    pub(super) fn new(Shape { inputs, outputs, .. }: Shape) -> Self {
        Self { pairs: Column::zeros(inputs.div_ceil(2)), sums: Column::zeros(outputs) }
    }
}

/// Infers columns of outputs from columns of readings.
#[inline(always)]
pub(super) fn infer(
    network: &Network<'_>,
    readings: &[Column],
    scratch: &mut Scratch,
    outputs: &mut [Column],
) {
    let (p, shape) = (network.parameters(), network.shape());
    let Scratch { pairs: x, sums } = scratch;
    let mut squares = Column([0_u64; LANES]);
    let limits = p.input_midpoint.chunks(2).zip(p.input_per_unit.chunks(2));
    for ((x, readings), (midpoints, per_units)) in x.iter_mut().zip(readings.chunks(2)).zip(limits)
    {
        x.0.fill(0);
        let halves = readings.iter().zip(midpoints.iter().zip(per_units)).zip([0, 16]);
        for ((readings, (midpoint, per_unit)), places) in halves {
            for ((x, reading), square) in x.0.iter_mut().zip(&readings.0).zip(&mut squares.0) {
                let steps = steps((reading - midpoint) * per_unit);
                *square += u64::from((steps * steps) as u32);
                *x |= (steps as u32 & 0xFFFF) << places;
            }
        }
    }
    let mut shared = Column([0; LANES]);
    for (shared, square) in shared.0.iter_mut().zip(squares.0) {
        *shared = shared_term(p.decay, square, shape.inputs);
    }
    for (sum, bias) in sums.iter_mut().zip(p.bias) {
        sum.0.fill(*bias);
    }
    if network.has_affine_tail() {
        add_products(x, p.affine, sums);
    }
    let line = 1 + x.len();
    let mut exponents = [Column([0_i32; LANES]); CENTRES_AT_ONCE];
    let mut activations = [Column([0_u32; LANES]); PAIRS_AT_ONCE];
    for group in p.centres.chunks_exact(words_at_once(shape)) {
        let (lines, weights) = group.split_at(CENTRES_AT_ONCE * line);
        for (exponent, line) in exponents.iter_mut().zip(lines.chunks_exact(line)) {
            for (v, shared) in exponent.0.iter_mut().zip(&shared.0) {
                *v = line[0].wrapping_add(*shared).cast_signed();
            }
        }
        add_products(x, lines, &mut exponents);
        for (pair, exponents) in activations.iter_mut().zip(exponents.as_chunks::<2>().0) {
            let [low, high] = exponents;
            for (pair, (low, high)) in pair.0.iter_mut().zip(low.0.iter().zip(&high.0)) {
                *pair = power(*low as u32) as u32 | (power(*high as u32) as u32) << 16;
            }
        }
        add_products(&activations, weights, sums);
    }
    for ((y, sum), scale) in outputs.iter_mut().zip(&*sums).zip(p.output_scale) {
        for (y, sum) in y.0.iter_mut().zip(&sum.0) {
            *y = *sum as f32 * scale;
        }
    }
}

/// [Steps](taxel_core::scale::clamp_steps) of a scaled reading, by operations that every vector unit has.
#[inline(always)]
fn steps(scaled: f32) -> i32 {
    let most = UNITS / UNITS_PER_STEP;
    let steps = (scaled.trunc() / UNITS_PER_STEP).floor();
    let above = if steps > -most { steps } else { -most };
    let clamped = if above < most { above } else { most - 1.0 };
    let clamped = if scaled.is_nan() { 0.0 } else { clamped };
    (clamped + ROUND).to_bits().wrapping_sub(ROUND.to_bits()).cast_signed()
}

//! Networks in 16-bit fixed point: a pair of factors in each 32-bit lane, as the device's SMLAD takes
//! them.
//!
//! The operations are those of `model_core::rbf::fixed16`; sums of integers may be taken in any order.
//! AVX2 multiplies and adds such pairs in one instruction; without it there is no vectorised form.

use model_core::rbf::Shape;
use model_core::rbf::fixed16::{
    CENTRES_AT_ONCE, CUBIC, DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS, Network, Parameters,
    square_shift, words_at_once,
};
use model_core::scale::UNITS;
use pulp::x86::V3;
use pulp::{NullaryFnOnce, f32x8, i32x8, u32x8};

use super::aligned::Aligned;
use super::lines::{Lines, VECTORS, Values};
use super::tiles::{Accumulate, CENTRES, OfLines, Weights, accumulate, in_fours};

/// Pairs of the centres that are stored together.
const PAIRS: usize = CENTRES_AT_ONCE / 2;
/// Pairs of centres whose exponents (4 KiB) and then activations (2 KiB) stay in the first cache until
/// the outputs take them.
const KEPT: usize = 32;

/// Network laid out for computing several lines at once, and the proof that this machine has AVX2.
#[derive(Debug)]
pub(in crate::infer) struct Fixed16<'a> {
    simd: V3,
    shape: Shape,
    parameters: Parameters<'a>,
    /// Parameters of [`CENTRES`] centres at a time: b, and then pairs of a.
    centres: Vec<[u32; CENTRES]>,
    /// Weights of pairs of centres, and of pairs of inputs.
    weights: Weights<u32>,
    affine: Weights<u32>,
}

impl<'a> Fixed16<'a> {
    /// Network laid out, if this machine has AVX2.
    pub(super) fn of(network: &Network<'a>) -> Option<Self> {
        let (simd, shape, p) = (V3::try_new()?, network.shape(), network.parameters());
        let Shape { inputs, outputs, .. } = shape;
        let line = 1 + inputs.div_ceil(2);
        let groups = p.centres.chunks_exact(words_at_once(shape));
        let groups = groups.map(|words| words.split_at(CENTRES_AT_ONCE * line));
        let lines = groups.clone().flat_map(|(lines, _)| lines.chunks_exact(line));
        let weights: Vec<u32> =
            groups.flat_map(|(_, weights)| transposed(weights, PAIRS)).collect();
        let affine: Vec<u32> = transposed(p.affine, inputs.div_ceil(2)).collect();
        Some(Self {
            simd,
            shape,
            parameters: p,
            centres: in_fours(line, lines.map(|line| line.iter().copied())),
            weights: Weights::of(&weights, outputs),
            affine: Weights::of(&affine, outputs),
        })
    }

    /// Infers the outputs of `lines`; NaN for a line where a reading is missing.
    pub(super) fn infer(&self, lines: Lines<'_>) {
        self.simd.vectorize(Work { network: self, lines });
    }
}

/// Columns of `values` one after the other, in lines of so many numbers.
fn transposed(values: &[u32], length: usize) -> impl Iterator<Item = u32> {
    (0..length).flat_map(move |column| values.iter().skip(column).step_by(length).copied())
}

struct Work<'a> {
    network: &'a Fixed16<'a>,
    lines: Lines<'a>,
}

impl NullaryFnOnce for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Fixed16 { simd, shape, parameters: p, .. } = *self.network;
        let Shape { inputs, outputs, .. } = shape;
        let (pairs, how) = (inputs.div_ceil(2), Products(simd));
        let (mut readings, mut y) = (Values::zeroed(inputs), Values::zeroed(outputs));
        let mut x = Aligned::<OfLines<Products>>::zeroed(pairs);
        let mut sums = Aligned::<OfLines<Products>>::zeroed(outputs);
        let mut exponents = Aligned::<OfLines<Products>>::zeroed(2 * KEPT);
        let mut activations = Aligned::<OfLines<Products>>::zeroed(KEPT);
        for mut part in self.lines.parts::<V3>() {
            let poison = readings.take(simd, &part);
            let readings = readings.columns_mut();
            let scaled = readings.iter_mut().zip(p.input_midpoint).zip(p.input_per_unit);
            for ((reading, &from), &by) in scaled {
                let (from, by) = (simd.splat_f32x8(from), simd.splat_f32x8(by));
                for x in reading {
                    *x = clamp(simd, simd.mul_f32x8(simd.sub_f32x8(*x, from), by));
                }
            }
            for (x, two) in x.iter_mut().zip(readings.chunks(2)) {
                for (v, x) in x.iter_mut().enumerate() {
                    *x = in_pairs(simd, two[0][v], two.get(1).map(|high| high[v]));
                }
            }

            for (sums, &bias) in sums.iter_mut().zip(p.bias) {
                *sums = [simd.splat_i32x8(bias); VECTORS];
            }
            self.network.affine.accumulate(how, 0, &x, &mut sums);
            let shared = shared_term(simd, p.decay, p.input_midpoint.len(), &x);
            let mut first = 0;
            for centres in self.network.centres.chunks(KEPT / (CENTRES / 2) * (1 + pairs)) {
                let tiles = centres.chunks_exact(1 + pairs);
                for (tile, places) in tiles.zip(exponents.as_chunks_mut::<CENTRES>().0) {
                    *places = exponents_of(how, tile, &x, shared);
                }
                let count = centres.len() / (1 + pairs) * (CENTRES / 2);
                for (pair, two) in activations[..count].iter_mut().zip(exponents.as_chunks().0) {
                    *pair = powers(simd, two);
                }
                self.network.weights.accumulate(how, first, &activations[..count], &mut sums);
                first += count;
            }

            for ((y, sums), &scale) in y.columns_mut().iter_mut().zip(&*sums).zip(p.output_scale) {
                let scale = simd.splat_f32x8(scale);
                for (y, &sum) in y.iter_mut().zip(sums) {
                    *y = simd.mul_f32x8(simd.convert_i32x8_to_f32x8(sum), scale);
                }
            }
            y.give(simd, &mut part, poison);
        }
    }
}

/// Accumulation of products of pairs.
#[derive(Clone, Copy)]
struct Products(V3);

impl Accumulate for Products {
    type Shared = u32;
    type Register = i32x8;

    #[inline(always)]
    fn splat(self, shared: u32) -> i32x8 {
        self.0.splat_i32x8(shared.cast_signed())
    }

    #[inline(always)]
    fn accumulate(self, sum: i32x8, factor: i32x8, shared: i32x8) -> i32x8 {
        let (factor, shared) = (bytemuck::cast(factor), bytemuck::cast(shared));
        let products = self.0.multiply_wrapping_add_adjacent_i16x16(factor, shared);
        self.0.wrapping_add_i32x8(sum, products)
    }
}

/// Clamps scaled inputs as `model_core::scale::clamp_steps` saturates: the steps below [`UNITS`] are the
/// last.
#[inline(always)]
fn clamp(simd: V3, scaled: f32x8) -> f32x8 {
    // NaN, which is not equal to itself, counts as 0.
    let number = simd.cmp_eq_f32x8(scaled, scaled);
    let number = simd.and_u32x8(bytemuck::cast(scaled), bytemuck::cast(number));
    let above = simd.max_f32x8(bytemuck::cast(number), simd.splat_f32x8(-UNITS));
    simd.min_f32x8(above, simd.splat_f32x8(UNITS.next_down()))
}

/// Pairs of steps, the upper halves of the integers that [`clamp`] leaves. A last odd input is paired
/// with 0.
#[inline(always)]
fn in_pairs(simd: V3, low: f32x8, high: Option<f32x8>) -> i32x8 {
    let integers =
        |x: f32x8| -> u32x8 { bytemuck::cast(simd.avx._mm256_cvttps_epi32(bytemuck::cast(x))) };
    let mut pairs = simd.shr_const_u32x8::<16>(integers(low));
    if let Some(high) = high {
        let high = simd.and_u32x8(integers(high), simd.splat_u32x8(0xFFFF_0000));
        pairs = simd.or_u32x8(pairs, high);
    }
    bytemuck::cast(pairs)
}

/// Exponents of the centres of a tile.
#[inline(always)]
fn exponents_of(
    how: Products,
    tile: &[[u32; CENTRES]],
    x: &[OfLines<Products>],
    shared: OfLines<Products>,
) -> [OfLines<Products>; CENTRES] {
    let Products(simd) = how;
    let mut v = [shared; CENTRES];
    for (v, &b) in v.iter_mut().zip(&tile[0]) {
        let b = how.splat(b);
        v.iter_mut().for_each(|v| *v = simd.wrapping_add_i32x8(*v, b));
    }
    accumulate(how, x, &tile[1..], &mut v);
    v
}

/// Pairs of 2^−v in Q15 of two centres, step by step: one register alone would wait for every operation.
#[inline(always)]
fn powers(simd: V3, two: &[OfLines<Products>; 2]) -> OfLines<Products> {
    let v: [i32x8; 2 * VECTORS] = bytemuck::cast(*two);
    let fraction = simd.splat_i32x8((1 << EXPONENT_FRACTION_BITS) - 1);
    let mut p = [simd.splat_i32x8(CUBIC[0]); 2 * VECTORS];
    for &c in &CUBIC[1..] {
        let c = simd.splat_i32x8(c);
        for (p, &v) in p.iter_mut().zip(&v) {
            let (_, high) = simd.widening_mul_i32x8(simd.and_i32x8(v, fraction), *p);
            *p = simd.wrapping_add_i32x8(high, c);
        }
    }
    for (p, &v) in p.iter_mut().zip(&v) {
        // p is positive, and the shift leaves 0 where there are more than 31 places.
        let places =
            simd.shr_const_u32x8::<{ EXPONENT_FRACTION_BITS.cast_signed() }>(bytemuck::cast(v));
        *p = bytemuck::cast(simd.shr_dyn_u32x8(bytemuck::cast(*p), places));
    }
    let [low, high]: [OfLines<Products>; 2] = bytemuck::cast(p);
    let mut pairs = low;
    for (pair, high) in pairs.iter_mut().zip(high) {
        *pair = simd.or_i32x8(*pair, simd.shl_const_i32x8::<16>(high));
    }
    pairs
}

/// Term g‖x‖² that all centres share.
#[inline(always)]
fn shared_term(simd: V3, decay: u32, inputs: usize, x: &[OfLines<Products>]) -> OfLines<Products> {
    // The square of a pair is up to 2³¹. Halves of 16 bits are added separately, so that neither sum leaves 32 bits;
    // nor does their whole after the shift.
    let zero = [simd.splat_u32x8(0); VECTORS];
    let (mut low, mut high) = (zero, zero);
    for x in x {
        for ((low, high), &x) in low.iter_mut().zip(&mut high).zip(x) {
            let square = Products(simd).accumulate(simd.splat_i32x8(0), x, x);
            let square: u32x8 = bytemuck::cast(square);
            let below = simd.and_u32x8(square, simd.splat_u32x8(0xFFFF));
            *low = simd.wrapping_add_u32x8(*low, below);
            *high = simd.wrapping_add_u32x8(*high, simd.shr_const_u32x8::<16>(square));
        }
    }
    let mut shared = zero;
    let shift = square_shift(inputs);
    let by = |places: u32| simd.splat_u32x8(places);
    for ((shared, low), high) in shared.iter_mut().zip(low).zip(high) {
        let low = simd.shr_dyn_u32x8(low, by(shift));
        let high = simd.shl_dyn_u32x8(high, by(16 - shift));
        let square = simd.wrapping_add_u32x8(low, high);
        let (low, high) = simd.widening_mul_u32x8(square, simd.splat_u32x8(decay));
        let low = simd.shr_dyn_u32x8(low, by(DECAY_FRACTION_BITS - shift));
        *shared = simd.or_u32x8(low, simd.shl_dyn_u32x8(high, by(shift - 2)));
    }
    bytemuck::cast(shared)
}

//! Networks in 16-bit fixed point: a pair of factors in each 32-bit lane, as the device's SMLAD takes them.
//!
//! The operations are those of `model_core::rbf::fixed16`; that sums are integers makes their order free.
//! AVX2 multiplies and adds such pairs in one instruction; without it there is no vectorised form.

use model_core::rbf::Shape;
use model_core::rbf::fixed16::{
    CENTRES_AT_ONCE, CUBIC, EXPONENT_FRACTION_BITS, Network, Parameters, words_at_once,
};
use model_core::scale::UNITS;
use pulp::x86::V3;
use pulp::{NullaryFnOnce, f32x8, i32x8, u32x8};

use super::lines::{Lines, VECTORS};
use super::tiles::{Accumulate, CENTRES, OfLines, Weights, accumulate, in_fours};

/// Lines of a block.
const LANES: usize = 8 * VECTORS;
/// Pairs of the centres that are stored together.
const PAIRS: usize = CENTRES_AT_ONCE / 2;
/// Pairs of centres whose activations are kept until the outputs take them: 2 KiB, in the first cache.
const KEPT: usize = 32;

/// A network laid out for blocks of lines, and the proof that this machine has the instructions.
#[derive(Debug)]
pub(in crate::infer) struct Fixed16<'a> {
    simd: V3,
    shape: Shape,
    parameters: Parameters<'a>,
    /// [`CENTRES`] at a time: b, and then pairs of a.
    centres: Vec<[u32; CENTRES]>,
    /// Of pairs of centres, and of inputs.
    weights: Weights<u32>,
    affine: Weights<u32>,
}

impl<'a> Fixed16<'a> {
    /// The network's layout, if this machine has the instructions.
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

    /// Infers the outputs of `lines`, all NaN where a reading is missing.
    pub(super) fn infer(&self, lines: Lines<'_>) {
        self.simd.vectorize(Work { network: self, lines });
    }
}

/// Columns of lines of that length after the other.
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
        let mut readings = vec![[simd.splat_f32x8(0.0); VECTORS]; inputs];
        let mut x = vec![[simd.splat_i32x8(0); VECTORS]; pairs];
        let mut sums = vec![[simd.splat_i32x8(0); VECTORS]; outputs];
        let mut y = vec![[simd.splat_f32x8(0.0); VECTORS]; outputs];
        let mut activations = [[simd.splat_i32x8(0); VECTORS]; KEPT];
        for block in self.lines.blocks::<V3>() {
            let poison = block.take(simd, &mut readings);
            let scaled = readings.iter_mut().zip(p.input_midpoint).zip(p.input_per_unit);
            for ((reading, &from), &by) in scaled {
                let values: &mut [f32] = bytemuck::cast_slice_mut(reading);
                values.iter_mut().for_each(|x| *x = clamp((*x - from) * by));
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
            let shared = shared_term(simd, p.decay, &x);
            let mut first = 0;
            for centres in self.network.centres.chunks(KEPT / (CENTRES / 2) * (1 + pairs)) {
                let tiles = centres.chunks_exact(1 + pairs);
                let places = activations.as_chunks_mut::<{ CENTRES / 2 }>().0;
                for (tile, places) in tiles.zip(places) {
                    *places = activations_of(how, tile, &x, shared);
                }
                let count = centres.len() / (1 + pairs) * (CENTRES / 2);
                self.network.weights.accumulate(how, first, &activations[..count], &mut sums);
                first += count;
            }

            for ((y, sums), &scale) in y.iter_mut().zip(&sums).zip(p.output_scale) {
                let scale = simd.splat_f32x8(scale);
                for (y, &sum) in y.iter_mut().zip(sums) {
                    *y = simd.mul_f32x8(simd.convert_i32x8_to_f32x8(sum), scale);
                }
            }
            block.give(simd, &y, poison);
        }
    }
}

/// Adds the products of pairs.
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

/// As `model_core::scale::clamp_steps` saturates: the steps below [`UNITS`] are the last.
#[inline(always)]
fn clamp(scaled: f32) -> f32 {
    let number = if scaled.is_nan() { 0.0 } else { scaled };
    let above = if number > -UNITS { number } else { -UNITS };
    if above < UNITS { above } else { UNITS.next_down() }
}

/// Steps, the upper halves of the integers that [`clamp`] leaves; a last odd input is paired with 0.
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

/// The activations of the centres of a tile, in pairs.
#[inline(always)]
fn activations_of(
    how: Products,
    tile: &[[u32; CENTRES]],
    x: &[OfLines<Products>],
    shared: OfLines<Products>,
) -> [OfLines<Products>; CENTRES / 2] {
    let Products(simd) = how;
    let mut v = [shared; CENTRES];
    for (v, &b) in v.iter_mut().zip(&tile[0]) {
        let b = how.splat(b);
        v.iter_mut().for_each(|v| *v = simd.wrapping_add_i32x8(*v, b));
    }
    accumulate(how, x, &tile[1..], &mut v);
    let [first, second, third, fourth] = v;
    [powers(simd, first, second), powers(simd, third, fourth)]
}

/// Pairs of 2^−v in Q15 of two centres, step by step: a register by itself would wait for every operation.
#[inline(always)]
fn powers(simd: V3, low: OfLines<Products>, high: OfLines<Products>) -> OfLines<Products> {
    let v: [i32x8; 2 * VECTORS] = bytemuck::cast([low, high]);
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
        // p is positive and of 16 bits: more than 31 places leave no less of it than 31 do.
        let whole =
            simd.shr_const_u32x8::<{ EXPONENT_FRACTION_BITS.cast_signed() }>(bytemuck::cast(v));
        let places = simd.min_u32x8(whole, simd.splat_u32x8(31));
        *p = bytemuck::cast(simd.shr_dyn_u32x8(bytemuck::cast(*p), places));
    }
    let [low, high]: [OfLines<Products>; 2] = bytemuck::cast(p);
    let mut pairs = low;
    for (pair, high) in pairs.iter_mut().zip(high) {
        *pair = simd.or_i32x8(*pair, simd.shl_const_i32x8::<16>(high));
    }
    pairs
}

/// g‖x‖²
#[inline(always)]
fn shared_term(simd: V3, decay: u32, x: &[OfLines<Products>]) -> OfLines<Products> {
    let mut squares = [0_u64; LANES];
    for x in x {
        let mut of_pair = [simd.splat_i32x8(0); VECTORS];
        for (square, &x) in of_pair.iter_mut().zip(x) {
            *square = Products(simd).accumulate(*square, x, x);
        }
        // Up to 2³¹, without a sign.
        let of_pair: &[u32] = bytemuck::cast_slice(&of_pair);
        squares.iter_mut().zip(of_pair).for_each(|(sum, &square)| *sum += u64::from(square));
    }
    let mut shared = [0; LANES];
    for (place, square) in shared.iter_mut().zip(squares) {
        *place = (((square >> 4) * u64::from(decay)) >> 30) as u32;
    }
    bytemuck::cast(shared)
}

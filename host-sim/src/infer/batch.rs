//! Many lines at once, in vector instructions: every lane computes one line, by the operations of
//! `model_core::rbf` in their order, so that answers stay the same bit for bit.
//!
//! A block is as many lines as fill [`VECTORS`] registers; what belongs to one input, centre or output lies
//! side by side. Exponents of four centres, and then six outputs, are added up in registers. No
//! multiplication is contracted with an addition: the device does not.

#![expect(clippy::inline_always, reason = "what pulp dispatches must be inlined into it")]

use core::f32::consts::LOG2_E;

use model_core::rbf::Network;
use model_core::rbf::Shape;
use model_core::scale::{CLAMP, UNITS};
use pulp::{Simd, WithSimd};

use super::Kernel;

/// Registers that hold one value of every line of a block.
const VECTORS: usize = 2;
/// Centres whose exponents are computed at a time.
const CENTRES: usize = 4;
/// Outputs that are accumulated at a time.
const OUTPUTS: usize = 6;
/// Centres whose activations are kept until the outputs take them: 4 KiB, in the first cache.
const KEPT: usize = 64;
/// Registers that are exponentiated side by side: a polynomial by itself would wait for every operation.
const ABREAST: usize = 4;

/// One value of every line of a block.
type Lanes<S> = [<S as Simd>::f32s; VECTORS];

/// A network laid out for blocks of lines.
#[derive(Debug)]
pub(super) struct Batch {
    shape: Shape,
    form: Form,
    /// What is subtracted from each input, and what it is then multiplied by.
    scale: Vec<[f32; 2]>,
    /// [`CENTRES`] at a time: b or −d, and then a or c, in the order of the [partial sums](interleaved).
    centres: Vec<[f32; CENTRES]>,
    weights: Weights,
    affine: Weights,
    bias: Vec<f32>,
}

/// How an exponent follows from inputs.
#[derive(Debug, Clone, Copy)]
enum Form {
    /// b + a·x − g‖x‖², with this g.
    Expanded(f32),
    /// −d‖x − c‖²
    Direct,
}

impl Batch {
    /// The network's layout, if there is a vectorised form of it.
    pub(super) fn of(network: &Network<'_>, kernel: Kernel) -> Option<Self> {
        let shape = network.shape();
        let scale = |from: &[f32], by: &[f32]| from.iter().zip(by).map(|(m, u)| [*m, *u]).collect();
        match (network, kernel) {
            (Network::F32(inner), _) => {
                let p = inner.parameters();
                let lines: Vec<&[f32]> = p.exponents.chunks_exact(1 + shape.inputs).collect();
                let heads = lines.iter().map(|line| line[0]);
                let places = lines.iter().map(|line| &line[1..]);
                Some(Self {
                    shape,
                    form: Form::Expanded(p.decay),
                    scale: scale(p.input_midpoint, p.input_per_unit),
                    centres: in_fours(shape.inputs, heads.zip(places)),
                    weights: Weights::of(p.output_weights, shape.outputs),
                    affine: Weights::of(p.affine, shape.outputs),
                    bias: p.bias.to_vec(),
                })
            }
            (Network::F32Direct(inner), Kernel::Polynomial) => {
                let p = inner.parameters();
                let heads = p.decay.iter().cycle().map(|decay| -decay);
                let places = p.centres.chunks_exact(shape.inputs);
                Some(Self {
                    shape,
                    form: Form::Direct,
                    scale: scale(p.input_minimum, p.input_per_span),
                    centres: in_fours(shape.inputs, heads.zip(places)),
                    weights: Weights::of(p.output_weights, shape.outputs),
                    affine: Weights::of(p.affine, shape.outputs),
                    bias: p.bias.to_vec(),
                })
            }
            _ => None,
        }
    }

    /// Infers the outputs for lines of readings, all NaN where a reading is missing or an output overflows.
    /// Each line of the network starts `readings_step` (`outputs_step`) values after the one before.
    pub(super) fn infer(
        &self,
        readings: &[f64],
        readings_step: usize,
        outputs: &mut [f64],
        outputs_step: usize,
    ) {
        pulp::Arch::new().dispatch(Work {
            batch: self,
            readings,
            readings_step,
            outputs,
            outputs_step,
        });
    }
}

/// The order in which inputs enter the four partial sums: every fourth, from each of the first four.
fn interleaved(inputs: usize) -> impl Iterator<Item = usize> {
    (0..4).flat_map(move |sum| (sum..inputs).step_by(4))
}

/// Heads and places of centres, [`CENTRES`] at a time; fill is 0.
fn in_fours<'a>(
    inputs: usize,
    centres: impl Iterator<Item = (f32, &'a [f32])>,
) -> Vec<[f32; CENTRES]> {
    let mut fours = Vec::new();
    for (k, (head, place)) in centres.enumerate() {
        let tile = k / CENTRES * (1 + inputs);
        fours.resize(tile + 1 + inputs, [0.0; CENTRES]);
        let values = [head].into_iter().chain(interleaved(inputs).map(|i| place[i]));
        for (four, value) in fours[tile..].iter_mut().zip(values) {
            four[k % CENTRES] = value;
        }
    }
    fours
}

/// Weights of each factor (a centre or an input) in each output, [`OUTPUTS`] at a time.
#[derive(Debug)]
struct Weights {
    factors: usize,
    whole: Vec<[f32; OUTPUTS]>,
    /// Of the outputs that are left, factor after factor.
    rest: Vec<f32>,
}

impl Weights {
    fn of(values: &[f32], outputs: usize) -> Self {
        let tiles = outputs / OUTPUTS;
        let mut whole = Vec::with_capacity(values.len() / OUTPUTS);
        for tile in 0..tiles {
            let lines = values.chunks_exact(outputs);
            whole.extend(lines.map(|line| line.as_chunks::<OUTPUTS>().0[tile]));
        }
        let rest = values.chunks_exact(outputs).flat_map(|line| &line[tiles * OUTPUTS..]);
        Self { factors: values.len() / outputs, whole, rest: rest.copied().collect() }
    }

    /// Adds the products of `factors`, from the one of that number on, to `sums`, one after the other.
    #[inline(always)]
    fn accumulate<S: Simd>(
        &self,
        simd: S,
        first: usize,
        factors: &[Lanes<S>],
        sums: &mut [Lanes<S>],
    ) {
        let (tiles, rest) = sums.as_chunks_mut::<OUTPUTS>();
        for (sums, weights) in tiles.iter_mut().zip(self.whole.chunks_exact(self.factors.max(1))) {
            accumulate_tile(simd, factors, &weights[first..], sums);
        }
        match rest.len() {
            1 => self.accumulate_rest::<S, 1>(simd, first, factors, rest),
            2 => self.accumulate_rest::<S, 2>(simd, first, factors, rest),
            3 => self.accumulate_rest::<S, 3>(simd, first, factors, rest),
            4 => self.accumulate_rest::<S, 4>(simd, first, factors, rest),
            5 => self.accumulate_rest::<S, 5>(simd, first, factors, rest),
            _ => (),
        }
    }

    #[inline(always)]
    fn accumulate_rest<S: Simd, const N: usize>(
        &self,
        simd: S,
        first: usize,
        factors: &[Lanes<S>],
        sums: &mut [Lanes<S>],
    ) {
        let Some(sums) = sums.first_chunk_mut::<N>() else { return };
        accumulate_tile(simd, factors, &self.rest.as_chunks::<N>().0[first..], sums);
    }
}

#[inline(always)]
fn accumulate_tile<S: Simd, const N: usize>(
    simd: S,
    factors: &[Lanes<S>],
    weights: &[[f32; N]],
    sums: &mut [Lanes<S>; N],
) {
    let mut accumulated = *sums;
    for (factor, weights) in factors.iter().zip(weights) {
        for (sums, &weight) in accumulated.iter_mut().zip(weights) {
            let weight = simd.splat_f32s(weight);
            for (sum, &factor) in sums.iter_mut().zip(factor) {
                *sum = simd.add_f32s(*sum, simd.mul_f32s(factor, weight));
            }
        }
    }
    *sums = accumulated;
}

struct Work<'a> {
    batch: &'a Batch,
    readings: &'a [f64],
    readings_step: usize,
    outputs: &'a mut [f64],
    outputs_step: usize,
}

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.batch.form {
            Form::Expanded(decay) => self.run(simd, &Expanded { decay }),
            Form::Direct => self.run(simd, &Direct),
        }
    }
}

impl Work<'_> {
    #[inline(always)]
    fn run<S: Simd, E: Exponent>(self, simd: S, exponent: &E) {
        let Self { batch, readings, readings_step, outputs, outputs_step } = self;
        let Shape { inputs, outputs: outputs_of_line, .. } = batch.shape;
        let lanes = VECTORS * S::F32_LANES;
        let zero = [simd.splat_f32s(0.0); VECTORS];
        let mut x = vec![zero; inputs];
        let mut x_interleaved = vec![zero; inputs];
        let mut y = vec![zero; outputs_of_line];
        let mut activations = [zero; KEPT];
        let lines = readings.chunks(readings_step * lanes);
        for (readings, outputs) in lines.zip(outputs.chunks_mut(outputs_step * lanes)) {
            // Lanes of no line keep what they had.
            let values = bytemuck::cast_slice_mut::<_, f32>(&mut x);
            for (lane, line) in readings.chunks(readings_step).enumerate() {
                for (lanes_of_input, reading) in values.chunks_exact_mut(lanes).zip(&line[..inputs])
                {
                    lanes_of_input[lane] = *reading as f32;
                }
            }
            // Becomes NaN where a reading is not finite.
            let mut poison = zero;
            for x in &x {
                add_difference_to_itself(simd, &mut poison, x);
            }
            let values = bytemuck::cast_slice_mut::<_, f32>(&mut x);
            for (values, &[from, by]) in values.chunks_exact_mut(lanes).zip(&batch.scale) {
                values.iter_mut().for_each(|x| *x = exponent.clamp((*x - from) * by));
            }
            for (to, from) in x_interleaved.iter_mut().zip(interleaved(inputs)) {
                *to = x[from];
            }

            y.fill(zero);
            batch.affine.accumulate(simd, 0, &x, &mut y);
            let opened = exponent.open(simd, &x_interleaved);
            let mut first = 0;
            for centres in batch.centres.chunks(KEPT / CENTRES * (1 + inputs)) {
                let tiles = centres.chunks_exact(1 + inputs);
                for (tile, places) in tiles.zip(activations.as_chunks_mut::<CENTRES>().0) {
                    *places = exponent.exponents(simd, &opened, tile, &x_interleaved);
                }
                let tiles = centres.len() / (1 + inputs);
                let values = activations[..tiles * CENTRES].as_flattened_mut();
                for values in values.as_chunks_mut::<ABREAST>().0 {
                    E::powers(simd, values);
                }
                let count = (tiles * CENTRES).min(batch.weights.factors - first);
                batch.weights.accumulate(simd, first, &activations[..count], &mut y);
                first += count;
            }
            for (y, &bias) in y.iter_mut().zip(&batch.bias) {
                let bias = simd.splat_f32s(bias);
                for y in &mut *y {
                    *y = simd.add_f32s(*y, bias);
                }
                add_difference_to_itself(simd, &mut poison, y);
            }

            let poison = bytemuck::cast_slice::<_, f32>(&poison);
            let values = bytemuck::cast_slice::<_, f32>(&y);
            for ((lane, line), poison) in outputs.chunks_mut(outputs_step).enumerate().zip(poison) {
                for (place, values) in
                    line[..outputs_of_line].iter_mut().zip(values.chunks_exact(lanes))
                {
                    *place = f64::from(if poison.is_nan() { f32::NAN } else { values[lane] });
                }
            }
        }
    }
}

/// Adds 0 where `value` is finite, and NaN elsewhere.
#[inline(always)]
fn add_difference_to_itself<S: Simd>(simd: S, sum: &mut Lanes<S>, value: &Lanes<S>) {
    for (sum, &value) in sum.iter_mut().zip(value) {
        *sum = simd.add_f32s(*sum, simd.sub_f32s(value, value));
    }
}

/// What differs between the forms of exponents.
trait Exponent {
    /// Clamps a scaled input.
    fn clamp(&self, scaled: f32) -> f32;
    /// What one input adds to a sum.
    fn term<S: Simd>(simd: S, x: S::f32s, centre: S::f32s) -> S::f32s;
    /// What the centres share: the second partial sum's start.
    fn open<S: Simd>(&self, simd: S, x: &[Lanes<S>]) -> Lanes<S>;
    /// Exponents of the centres of a `tile`.
    fn exponents<S: Simd>(
        &self,
        simd: S,
        opened: &Lanes<S>,
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES];

    /// Makes activations of exponents.
    fn powers<S: Simd>(simd: S, exponents: &mut [S::f32s; ABREAST]);

    /// Four partial sums of each centre, from their starts, added pairwise.
    #[inline(always)]
    fn four_sums<S: Simd>(
        &self,
        simd: S,
        starts: [[Lanes<S>; CENTRES]; 4],
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES] {
        let [mut first, mut second, mut third, mut fourth] = starts;
        let (x_first, x_rest) = x.split_at(x.len().div_ceil(4));
        let (x_second, x_rest) = x_rest.split_at((x.len() + 2) / 4);
        let (x_third, x_fourth) = x_rest.split_at((x.len() + 1) / 4);
        let (tile_first, rest) = tile.split_at(x_first.len());
        let (tile_second, rest) = rest.split_at(x_second.len());
        let (tile_third, tile_fourth) = rest.split_at(x_third.len());
        Self::add_terms(simd, &mut first, tile_first, x_first);
        Self::add_terms(simd, &mut second, tile_second, x_second);
        add(simd, &mut first, &second);
        Self::add_terms(simd, &mut third, tile_third, x_third);
        Self::add_terms(simd, &mut fourth, tile_fourth, x_fourth);
        add(simd, &mut third, &fourth);
        add(simd, &mut first, &third);
        first
    }

    #[inline(always)]
    fn add_terms<S: Simd>(
        simd: S,
        sums: &mut [Lanes<S>; CENTRES],
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) {
        let mut accumulated = *sums;
        for (x, centres) in x.iter().zip(tile) {
            for (sums, &centre) in accumulated.iter_mut().zip(centres) {
                let centre = simd.splat_f32s(centre);
                for (sum, &x) in sums.iter_mut().zip(x) {
                    *sum = simd.add_f32s(*sum, Self::term(simd, x, centre));
                }
            }
        }
        *sums = accumulated;
    }
}

#[inline(always)]
fn add<S: Simd>(simd: S, to: &mut [Lanes<S>; CENTRES], what: &[Lanes<S>; CENTRES]) {
    for (to, what) in to.iter_mut().zip(what) {
        for (to, &what) in to.iter_mut().zip(what) {
            *to = simd.add_f32s(*to, what);
        }
    }
}

/// See `model_core::rbf::expanded`.
struct Expanded {
    decay: f32,
}

impl Exponent for Expanded {
    /// As `model_core::scale::clamp_units` (tested), without an integer.
    #[inline(always)]
    fn clamp(&self, scaled: f32) -> f32 {
        let number = if scaled.is_nan() { 0.0 } else { scaled };
        let above = if number > -UNITS { number } else { -UNITS };
        let inside = if above < UNITS { above } else { UNITS };
        inside.trunc() + 0.0 // −0 becomes 0
    }

    #[inline(always)]
    fn term<S: Simd>(simd: S, x: S::f32s, centre: S::f32s) -> S::f32s {
        simd.mul_f32s(x, centre)
    }

    #[inline(always)]
    fn open<S: Simd>(&self, simd: S, x: &[Lanes<S>]) -> Lanes<S> {
        let zero = [simd.splat_f32s(0.0); VECTORS];
        let mut sums = [zero; 4];
        let mut rest = x;
        for (number, sums) in sums.iter_mut().enumerate() {
            let (now, later) = rest.split_at((x.len() + 3 - number) / 4);
            rest = later;
            for x in now {
                for (sum, &x) in sums.iter_mut().zip(x) {
                    *sum = simd.add_f32s(*sum, simd.mul_f32s(x, x));
                }
            }
        }
        let decay = simd.splat_f32s(self.decay);
        let mut opened = zero;
        for (v, opened) in opened.iter_mut().enumerate() {
            let first = simd.add_f32s(sums[0][v], sums[1][v]);
            let square = simd.add_f32s(first, simd.add_f32s(sums[2][v], sums[3][v]));
            *opened = simd.neg_f32s(simd.mul_f32s(decay, square));
        }
        opened
    }

    #[inline(always)]
    fn exponents<S: Simd>(
        &self,
        simd: S,
        opened: &Lanes<S>,
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES] {
        let zero = [simd.splat_f32s(0.0); VECTORS];
        let mut heads = [zero; CENTRES];
        for (place, &head) in heads.iter_mut().zip(&tile[0]) {
            *place = [simd.splat_f32s(head); VECTORS];
        }
        let starts = [heads, [*opened; CENTRES], [zero; CENTRES], [zero; CENTRES]];
        self.four_sums(simd, starts, &tile[1..], x)
    }

    #[inline(always)]
    fn powers<S: Simd>(simd: S, exponents: &mut [S::f32s; ABREAST]) {
        exp2(simd, exponents);
    }
}

/// See `model_core::rbf::direct`.
struct Direct;

impl Exponent for Direct {
    #[inline(always)]
    fn clamp(&self, scaled: f32) -> f32 {
        scaled.clamp(CLAMP[0], CLAMP[1])
    }

    #[inline(always)]
    fn term<S: Simd>(simd: S, x: S::f32s, centre: S::f32s) -> S::f32s {
        let d = simd.sub_f32s(x, centre);
        simd.mul_f32s(d, d)
    }

    #[inline(always)]
    fn open<S: Simd>(&self, simd: S, _: &[Lanes<S>]) -> Lanes<S> {
        [simd.splat_f32s(0.0); VECTORS]
    }

    #[inline(always)]
    fn exponents<S: Simd>(
        &self,
        simd: S,
        opened: &Lanes<S>,
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES] {
        let mut values = self.four_sums(simd, [[*opened; CENTRES]; 4], &tile[1..], x);
        for (values, &decay) in values.iter_mut().zip(&tile[0]) {
            let decay = simd.splat_f32s(decay);
            for value in values {
                *value = simd.mul_f32s(decay, *value);
            }
        }
        values
    }

    #[inline(always)]
    fn powers<S: Simd>(simd: S, exponents: &mut [S::f32s; ABREAST]) {
        exp(simd, exponents);
    }
}

/// Adding and subtracting 1.5·2^23 rounds to the nearest integer, which the sum's low bits then hold.
const ROUND: f32 = 12_582_912.0;

/// ((c₀·r + c₁)·r + …)
#[inline(always)]
fn polynomial<S: Simd>(
    simd: S,
    r: &[S::f32s; ABREAST],
    coefficients: &[f32],
) -> [S::f32s; ABREAST] {
    let mut p = [simd.splat_f32s(coefficients[0]); ABREAST];
    for &c in &coefficients[1..] {
        let c = simd.splat_f32s(c);
        for (p, &r) in p.iter_mut().zip(r) {
            *p = simd.add_f32s(simd.mul_f32s(*p, r), c);
        }
    }
    p
}

/// As `model_core::exp::exp2`.
#[inline(always)]
fn exp2<S: Simd>(simd: S, values: &mut [S::f32s; ABREAST]) {
    const C: [f32; 6] = [0.001_317_25, 0.009_672_681, 0.055_510_68, 0.240_222_17, 0.693_146_7, 1.0];
    let round = simd.splat_f32s(ROUND);
    let (mut rounded, mut f) = (*values, *values);
    for (rounded, f) in rounded.iter_mut().zip(&mut f) {
        *rounded = simd.add_f32s(*rounded, round);
        *f = simd.sub_f32s(*f, simd.sub_f32s(*rounded, round));
    }
    let p = polynomial(simd, &f, &C);
    let places = simd.splat_u32s(23);
    for ((value, &p), &rounded) in values.iter_mut().zip(&p).zip(&rounded) {
        let power = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(rounded), places);
        *value = simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(p), power));
    }
}

/// As `model_core::exp::Polynomial`.
#[inline(always)]
fn exp<S: Simd>(simd: S, values: &mut [S::f32s; ABREAST]) {
    const LN2_HI: f32 = 0.693_359_4;
    const LN2_LO: f32 = -2.121_944_4e-4;
    const C: [f32; 7] =
        [0.001_384_461, 0.008_374_151, 0.041_667_98, 0.166_664_32, 0.499_999_94, 1.0, 1.0];
    let round = simd.splat_f32s(ROUND);
    let (log2_e, high, low) =
        (simd.splat_f32s(LOG2_E), simd.splat_f32s(LN2_HI), simd.splat_f32s(LN2_LO));
    let (mut rounded, mut r) = (*values, *values);
    for (rounded, r) in rounded.iter_mut().zip(&mut r) {
        *rounded = simd.add_f32s(simd.mul_f32s(*rounded, log2_e), round);
        let n = simd.sub_f32s(*rounded, round);
        *r = simd.sub_f32s(*r, simd.mul_f32s(n, high));
        *r = simd.sub_f32s(*r, simd.mul_f32s(n, low));
    }
    let p = polynomial(simd, &r, &C);
    let (bias, places) = (simd.splat_u32s(127), simd.splat_u32s(23));
    let (least, zero) = (simd.splat_f32s(-87.0), simd.splat_f32s(0.0));
    for ((value, &p), &rounded) in values.iter_mut().zip(&p).zip(&rounded) {
        // The low bits of `rounded` hold n.
        let exponent = simd.add_u32s(simd.transmute_u32s_f32s(rounded), bias);
        let power = simd.wrapping_dyn_shl_u32s(exponent, places);
        let power = simd.mul_f32s(p, simd.transmute_f32s_u32s(power));
        *value = simd.select_f32s(simd.less_than_f32s(*value, least), zero, power);
    }
}

#[cfg(test)]
mod tests;

//! Networks in single precision, by the operations of `model_core::rbf` in their order.
//!
//! Exponents of four centres, and then six outputs, are added up in registers. No multiplication is
//! contracted with an addition, since the device does not either.

use model_core::rbf::{Network, Shape};
use pulp::{Simd, WithSimd};

use super::aligned::Aligned;
use super::exponent::{Direct, Expanded, Exponent, Terms};
use super::lines::{ABREAST, Lines, VECTORS, Values};
use super::tiles::{CENTRES, Weights, in_fours};
use crate::infer::Exponential;

/// Centres whose activations stay in the first cache (4 KiB) until the outputs take them.
const KEPT: usize = 64;

/// Network laid out for computing several lines at once.
#[derive(Debug)]
pub(in crate::infer) struct Floats<'a> {
    shape: Shape,
    form: Form,
    /// Offset subtracted from each input, and factor that it is then multiplied by.
    scale: Vec<[f32; 2]>,
    /// Parameters of [`CENTRES`] centres at a time: b or −d, and then a or c, in the order of the
    /// [partial sums](interleaved).
    centres: Vec<[f32; CENTRES]>,
    weights: Weights<f32>,
    affine: Weights<f32>,
    bias: &'a [f32],
}

/// Form in which an exponent is computed from inputs.
#[derive(Debug, Clone, Copy)]
enum Form {
    /// Exponent b + a·x − g‖x‖², with this g.
    Expanded(f32),
    /// Exponent −d‖x − c‖².
    Direct,
}

impl<'a> Floats<'a> {
    /// Network laid out, if there is a vectorised form of it.
    pub(super) fn of(network: &Network<'a>, exponential: Exponential) -> Option<Self> {
        let shape = network.shape();
        let scale = |from: &[f32], by: &[f32]| from.iter().zip(by).map(|(m, u)| [*m, *u]).collect();
        match (network, exponential) {
            (Network::F32(inner), _) => {
                let p = inner.parameters();
                let lines = p.exponents.chunks_exact(1 + shape.inputs);
                let lines = lines.map(|line| in_order(line[0], &line[1..]));
                Some(Self {
                    shape,
                    form: Form::Expanded(p.decay),
                    scale: scale(p.input_midpoint, p.input_per_unit),
                    centres: in_fours(1 + shape.inputs, lines),
                    weights: Weights::of(p.output_weights, shape.outputs),
                    affine: Weights::of(p.affine, shape.outputs),
                    bias: p.bias,
                })
            }
            (Network::F32Direct(inner), Exponential::Polynomial) => {
                let p = inner.parameters();
                let centres = p.centres.chunks_exact(shape.inputs);
                let lines = p.decay.iter().cycle().zip(centres);
                let lines = lines.map(|(decay, centre)| in_order(-decay, centre));
                Some(Self {
                    shape,
                    form: Form::Direct,
                    scale: scale(p.input_minimum, p.input_per_span),
                    centres: in_fours(1 + shape.inputs, lines),
                    weights: Weights::of(p.output_weights, shape.outputs),
                    affine: Weights::of(p.affine, shape.outputs),
                    bias: p.bias,
                })
            }
            _ => None,
        }
    }

    /// Infers the outputs of `lines`; NaN for a line where a reading is missing or an output overflows.
    pub(super) fn infer(&self, lines: Lines<'_>) {
        pulp::Arch::new().dispatch(Work { network: self, lines });
    }

    /// Infers the outputs of `lines` in the vectors of `simd`.
    #[inline(always)]
    pub(super) fn infer_in<S: Simd>(&self, simd: S, lines: Lines<'_>) {
        match self.form {
            Form::Expanded(decay) => self.run(simd, &Expanded { decay }, lines),
            Form::Direct => self.run(simd, &Direct, lines),
        }
    }

    #[inline(always)]
    fn run<S: Simd, E: Exponent>(&self, simd: S, exponent: &E, lines: Lines<'_>) {
        let Shape { inputs, outputs, .. } = self.shape;
        let zero = [simd.splat_f32s(0.0); VECTORS];
        let (mut x, mut y) = (Values::zeroed(inputs), Values::zeroed(outputs));
        let mut x_interleaved = Aligned::zeroed(inputs);
        let mut activations = Aligned::zeroed(KEPT);
        for mut part in lines.parts::<S>() {
            let poison = x.take(simd, &part);
            let (x, sums) = (x.columns_mut(), y.columns_mut());
            for (x, &[from, by]) in x.iter_mut().zip(&self.scale) {
                let (from, by) = (simd.splat_f32s(from), simd.splat_f32s(by));
                x.iter_mut().for_each(|x| *x = simd.mul_f32s(simd.sub_f32s(*x, from), by));
            }
            // One flat loop: the compiler turns nested ones into slow gathers.
            let values = bytemuck::cast_slice_mut::<_, f32>(x);
            values.iter_mut().for_each(|x| *x = exponent.clamp(*x));
            for (to, from) in x_interleaved.iter_mut().zip(interleaved(inputs)) {
                *to = x[from];
            }

            sums.fill(zero);
            self.affine.accumulate(Terms::<_, false>(simd), 0, x, sums);
            let opened = exponent.open(simd, &x_interleaved);
            let mut first = 0;
            for centres in self.centres.chunks(KEPT / CENTRES * (1 + inputs)) {
                let tiles = centres.chunks_exact(1 + inputs);
                for (tile, places) in tiles.zip(activations.as_chunks_mut::<CENTRES>().0) {
                    *places = exponent.exponents(simd, &opened, tile, &x_interleaved);
                }
                let tiles = centres.len() / (1 + inputs);
                let values = activations[..tiles * CENTRES].as_flattened_mut();
                for values in values.as_chunks_mut::<ABREAST>().0 {
                    E::powers(simd, values);
                }
                let count = (tiles * CENTRES).min(self.weights.factors() - first);
                self.weights.accumulate(
                    Terms::<_, false>(simd),
                    first,
                    &activations[..count],
                    sums,
                );
                first += count;
            }
            for (y, &bias) in sums.iter_mut().zip(self.bias) {
                let bias = simd.splat_f32s(bias);
                y.iter_mut().for_each(|y| *y = simd.add_f32s(*y, bias));
            }
            y.give(simd, &mut part, poison);
        }
    }
}

/// Parameters of a centre: its head, then its place in the order of the partial sums.
fn in_order(head: f32, place: &[f32]) -> impl Iterator<Item = f32> {
    [head].into_iter().chain(interleaved(place.len()).map(|i| place[i]))
}

/// Order in which inputs enter the four partial sums: every fourth, from each of the first four.
fn interleaved(inputs: usize) -> impl Iterator<Item = usize> {
    (0..4).flat_map(move |sum| (sum..inputs).step_by(4))
}

struct Work<'a> {
    network: &'a Floats<'a>,
    lines: Lines<'a>,
}

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.network.infer_in(simd, self.lines);
    }
}

//! A network as a smooth function: in f32 whatever its format, without the clamp, with its slopes.
//!
//! Recalibration asks how outputs change with inputs, also far beyond the training range, where decoding clamps.
//! Nothing here is made for speed, nor for the same bits as decoding.

use core::f32::consts::LN_2;

use super::fixed16::{self, CENTRES_AT_ONCE, HIGHEST_ACTIVATION};
use super::{Network, Shape, direct, expanded};
use crate::exp::{ExpKernel, Polynomial};
use crate::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP};

/// One of [`UNITS`], in spans of the training range.
const SPANS_PER_UNIT: f32 = HALF_RANGE / UNITS;
/// One step of the 16-bit format, in spans.
const SPANS_PER_STEP: f32 = SPANS_PER_UNIT * UNITS_PER_STEP;
/// 2⁻⁶⁰: the last place of the decay in 16-bit fixed point.
const DECAY_PLACE: f32 = 1.0 / 1_152_921_504_606_846_976.0;
/// 2⁻²⁶: the last place of an exponent in 16-bit fixed point.
const EXPONENT_PLACE: f32 = 1.0 / 67_108_864.0;

/// A network whose inputs are in spans of the training range, and may be any.
pub(crate) struct Smooth<'a> {
    shape: Shape,
    terms: Terms<'a>,
}

/// The parameters of a network in its own format.
enum Terms<'a> {
    Direct(direct::Parameters<'a>),
    F32(expanded::Parameters<'a>),
    Fixed16(fixed16::Parameters<'a>),
}

impl<'a> Smooth<'a> {
    pub fn of(network: &Network<'a>) -> Self {
        let terms = match network {
            Network::F32Direct(inner) => Terms::Direct(*inner.parameters()),
            Network::F32(inner) => Terms::F32(inner.parameters()),
            Network::Fixed16(inner) => Terms::Fixed16(inner.parameters()),
        };
        Self { shape: network.shape(), terms }
    }

    /// The zero of `input` in its unit, and the spans in one unit: 0 for an input that never changed in training.
    ///
    /// The zero is the lowest reading of training, or the middle. Whatever it is, the network's block begins with the
    /// zeros of all inputs.
    pub fn scale_of(&self, input: usize) -> (f32, f32) {
        let (zeros, per_unit, spans) = match &self.terms {
            Terms::Direct(p) => (p.input_minimum, p.input_per_span, 1.0),
            Terms::F32(p) => (p.input_midpoint, p.input_per_unit, SPANS_PER_UNIT),
            Terms::Fixed16(p) => (p.input_midpoint, p.input_per_unit, SPANS_PER_UNIT),
        };
        (at(zeros, input), at(per_unit, input) * spans)
    }

    /// Infers the outputs from `first` on into `values`, as many as there is room for, from inputs `x`. With room for
    /// them, `slopes` get the change of each of these outputs with each input, output after output.
    /// `difference` is working space of one value an input.
    pub fn infer(
        &self,
        x: &[f32],
        first: usize,
        values: &mut [f32],
        slopes: &mut [f32],
        difference: &mut [f32],
    ) {
        let inputs = x.len().max(1);
        for (o, value) in values.iter_mut().enumerate() {
            *value = self.bias(first + o);
            for (i, &x) in x.iter().enumerate() {
                *value += x * self.affine(i, first + o);
            }
        }
        for (o, slopes) in slopes.chunks_exact_mut(inputs).enumerate() {
            for (i, slope) in slopes.iter_mut().enumerate() {
                *slope = self.affine(i, first + o);
            }
        }
        for k in 0..self.shape.centres {
            let mut square = 0.0;
            for ((i, d), &x) in difference.iter_mut().enumerate().zip(x) {
                *d = x - self.centre(k, i);
                square += *d * *d;
            }
            let decay = self.decay(k);
            let activation = Polynomial::exp(-decay * square);
            for (o, value) in values.iter_mut().enumerate() {
                *value += self.weight(k, first + o) * activation;
            }
            for (o, slopes) in slopes.chunks_exact_mut(inputs).enumerate() {
                let factor = -2.0 * decay * self.weight(k, first + o) * activation;
                for (slope, d) in slopes.iter_mut().zip(&*difference) {
                    *slope += factor * d;
                }
            }
        }
    }

    /// Number of centres.
    pub fn centres(&self) -> usize {
        self.shape.centres
    }

    /// Decay 1/(2σ²) of a centre, on inputs in spans.
    fn decay(&self, k: usize) -> f32 {
        match &self.terms {
            Terms::Direct(p) if p.decay.len() == 1 => at(p.decay, 0),
            Terms::Direct(p) => at(p.decay, k),
            Terms::F32(p) => p.decay * LN_2 / (SPANS_PER_UNIT * SPANS_PER_UNIT),
            Terms::Fixed16(p) => {
                p.decay as f32 * DECAY_PLACE * LN_2 / (SPANS_PER_STEP * SPANS_PER_STEP)
            }
        }
    }

    /// Coordinate `i` of a centre, in spans.
    pub fn centre(&self, k: usize, i: usize) -> f32 {
        let inputs = self.shape.inputs;
        match &self.terms {
            Terms::Direct(p) => at(p.centres, k * inputs + i),
            // a = 2g·c
            Terms::F32(p) => {
                at(p.exponents, k * (1 + inputs) + 1 + i) / (2.0 * p.decay) * SPANS_PER_UNIT
            }
            // a = −2g·c
            Terms::Fixed16(p) => {
                let line = 1 + inputs.div_ceil(2);
                let start = self.group(k) + k % CENTRES_AT_ONCE * line + 1;
                let twice = 2.0 * p.decay as f32 * DECAY_PLACE;
                -half(p.centres, start, i) * EXPONENT_PLACE / twice * SPANS_PER_STEP
            }
        }
    }

    fn weight(&self, k: usize, o: usize) -> f32 {
        let outputs = self.shape.outputs;
        match &self.terms {
            Terms::Direct(p) => at(p.output_weights, k * outputs + o),
            Terms::F32(p) => at(p.output_weights, k * outputs + o),
            Terms::Fixed16(p) => {
                let exponents = CENTRES_AT_ONCE * (1 + self.shape.inputs.div_ceil(2));
                let start = self.group(k) + exponents + o * (CENTRES_AT_ONCE / 2);
                let weight = half(p.centres, start, k % CENTRES_AT_ONCE);
                weight * HIGHEST_ACTIVATION as f32 * at(p.output_scale, o)
            }
        }
    }

    /// First word of the group of a centre in 16-bit fixed point.
    fn group(&self, k: usize) -> usize {
        k / CENTRES_AT_ONCE * fixed16::words_at_once(self.shape)
    }

    fn affine(&self, i: usize, o: usize) -> f32 {
        let Shape { inputs, outputs, .. } = self.shape;
        match &self.terms {
            // Without a tail, nothing is there.
            Terms::Direct(p) => at(p.affine, i * outputs + o),
            Terms::F32(p) => at(p.affine, i * outputs + o) / SPANS_PER_UNIT,
            Terms::Fixed16(p) => {
                let tail = half(p.affine, o * inputs.div_ceil(2), i);
                tail * at(p.output_scale, o) / SPANS_PER_STEP
            }
        }
    }

    fn bias(&self, o: usize) -> f32 {
        match &self.terms {
            Terms::Direct(p) => at(p.bias, o),
            Terms::F32(p) => at(p.bias, o),
            Terms::Fixed16(p) => {
                let bias = p.bias.get(o).copied().unwrap_or_default();
                bias as f32 * at(p.output_scale, o)
            }
        }
    }
}

fn at(values: &[f32], index: usize) -> f32 {
    values.get(index).copied().unwrap_or(0.0)
}

/// Half number `index` of the pairs that begin with word `start`.
fn half(words: &[u32], start: usize, index: usize) -> f32 {
    let pair = words.get(start + index / 2).copied().unwrap_or_default();
    f32::from(if index.is_multiple_of(2) { pair as i16 } else { (pair >> 16) as i16 })
}

#[cfg(test)]
mod tests;

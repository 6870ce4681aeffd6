//! A network of any number format as a smooth function in f64: without the clamp, with its slopes.

use std::f64::consts::LN_2;

use taxel_core::rbf::fixed16::{
    CENTRES_AT_ONCE, DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS, HIGHEST_ACTIVATION, words_at_once,
};
use taxel_core::rbf::{Network, Shape, fixed16, float32};
use taxel_core::scale::{CLAMP, HALF_RANGE, UNITS, UNITS_PER_STEP};

/// One of [`UNITS`], in spans of the training range.
const SPANS_PER_UNIT: f64 = HALF_RANGE as f64 / UNITS as f64;
/// One step of the 16-bit format, in spans.
const SPANS_PER_STEP: f64 = SPANS_PER_UNIT * UNITS_PER_STEP as f64;

/// A network whose inputs are in spans of the training range, and may be any.
pub struct Smooth {
    pub shape: Shape,
    /// Zero of each input in its unit: the lowest reading of training, or the middle.
    pub zeros: Vec<f64>,
    /// Spans in one unit of each input; 0 for an input that never changed in training.
    pub per_unit: Vec<f64>,
    /// Range that a device clamps inputs to, in spans from the zeros.
    clamp: [f64; 2],
    /// Centres in spans from the zeros: `[centres × inputs]`.
    pub centres: Vec<f64>,
    /// 1/(2σ²) of each centre.
    decay: Vec<f64>,
    /// Output weights: `[centres × outputs]`.
    weights: Vec<f64>,
    bias: Vec<f64>,
    /// Affine tail: `[inputs × outputs]`, or empty.
    affine: Vec<f64>,
}

impl Smooth {
    pub fn new(network: &Network<'_>) -> Self {
        let shape = network.shape();
        match network {
            Network::F32(network) => Self::from_float32(shape, network.parameters()),
            Network::Fixed16(network) => Self::from_fixed16(shape, &network.parameters()),
        }
    }

    fn from_float32(shape: Shape, p: &float32::Parameters<'_>) -> Self {
        Self {
            shape,
            zeros: scaled(p.input_minimum, 1.0),
            per_unit: scaled(p.input_per_span, 1.0),
            clamp: CLAMP.map(f64::from),
            centres: scaled(p.centres, 1.0),
            decay: scaled(p.decay, 1.0),
            weights: scaled(p.output_weights, 1.0),
            bias: scaled(p.bias, 1.0),
            affine: scaled(p.affine, 1.0),
        }
    }

    fn from_fixed16(shape: Shape, p: &fixed16::Parameters<'_>) -> Self {
        let Shape { inputs, centres, outputs } = shape;
        let power = |bits: u32| f64::from(bits).exp2().recip();
        let decay = f64::from(p.decay) * power(EXPONENT_FRACTION_BITS + DECAY_FRACTION_BITS);
        // a = −2g·c stands behind b.
        let per_half = power(EXPONENT_FRACTION_BITS) / (-2.0 * decay) * SPANS_PER_STEP;
        let scale = scaled(p.output_scale, 1.0);
        let pairs = inputs.div_ceil(2);
        let mut smooth = Self {
            shape,
            zeros: scaled(p.input_midpoint, 1.0),
            per_unit: scaled(p.input_per_unit, SPANS_PER_UNIT),
            clamp: [-1.0, 1.0].map(|end| end * f64::from(HALF_RANGE)),
            centres: Vec::with_capacity(centres * inputs),
            decay: vec![decay * LN_2 / SPANS_PER_STEP.powi(2); centres],
            weights: vec![0.0; centres * outputs],
            bias: p.bias.iter().zip(&scale).map(|(b, scale)| f64::from(*b) * scale).collect(),
            affine: vec![0.0; if p.affine.is_empty() { 0 } else { inputs * outputs }],
        };
        for (group, words) in p.centres.chunks_exact(words_at_once(shape)).enumerate() {
            let (exponents, weights) = words.split_at(CENTRES_AT_ONCE * (1 + pairs));
            let first = group * CENTRES_AT_ONCE;
            for line in exponents.chunks_exact(1 + pairs).take(centres - first) {
                smooth.centres.extend(halves(&line[1..]).take(inputs).map(|a| a * per_half));
            }
            for (o, line) in weights.chunks_exact(CENTRES_AT_ONCE / 2).enumerate() {
                for (k, weight) in halves(line).take(centres - first).enumerate() {
                    smooth.weights[(first + k) * outputs + o] =
                        weight * f64::from(HIGHEST_ACTIVATION) * scale[o];
                }
            }
        }
        for (o, line) in p.affine.chunks_exact(pairs).enumerate() {
            for (i, part) in halves(line).take(inputs).enumerate() {
                smooth.affine[i * outputs + o] = part * scale[o] / SPANS_PER_STEP;
            }
        }
        smooth
    }

    /// Outputs at the inputs `x` as a device decodes them: with its clamp.
    pub fn decode(&self, x: &[f64]) -> Vec<f64> {
        let [low, high] = self.clamp;
        self.infer(&x.iter().map(|x| x.clamp(low, high)).collect::<Vec<_>>(), &mut [])
    }

    /// Outputs at the inputs `x`. Adds to `slopes` (`[outputs × inputs]`, or empty) the change of each output with each
    /// input.
    pub fn infer(&self, x: &[f64], slopes: &mut [f64]) -> Vec<f64> {
        let Shape { inputs, outputs, .. } = self.shape;
        let mut values = self.bias.clone();
        for (i, (x, parts)) in x.iter().zip(self.affine.chunks_exact(outputs)).enumerate() {
            values.iter_mut().zip(parts).for_each(|(value, part)| *value += x * part);
            let column = slopes.iter_mut().skip(i).step_by(inputs);
            column.zip(parts).for_each(|(slope, part)| *slope += part);
        }
        let mut difference = vec![0.0; inputs];
        let lines = self.centres.chunks_exact(inputs).zip(self.weights.chunks_exact(outputs));
        for ((centre, weights), decay) in lines.zip(&self.decay) {
            let mut square = 0.0;
            for ((d, x), c) in difference.iter_mut().zip(x).zip(centre) {
                *d = x - c;
                square += *d * *d;
            }
            let activation = (-decay * square).exp();
            values.iter_mut().zip(weights).for_each(|(value, w)| *value += w * activation);
            for (slopes, weight) in slopes.chunks_exact_mut(inputs).zip(weights) {
                let factor = -2.0 * decay * weight * activation;
                slopes.iter_mut().zip(&difference).for_each(|(slope, d)| *slope += factor * d);
            }
        }
        values
    }
}

fn scaled(values: &[f32], factor: f64) -> Vec<f64> {
    values.iter().map(|value| f64::from(*value) * factor).collect()
}

/// The `i16` of pairs, the low half of each first.
fn halves(pairs: &[u32]) -> impl Iterator<Item = f64> {
    pairs.iter().flat_map(|pair| [*pair as i16, (pair >> 16) as i16].map(f64::from))
}

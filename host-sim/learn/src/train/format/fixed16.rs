//! Fit of networks in 16-bit fixed point.
//!
//! Weights are rounded during back substitution. Each is rounded as soon as it is solved for, and the
//! weights solved after it compensate for that (Babai's nearest plane, Combinatorica 6, 1986). Gaussians
//! of neighbouring centres are nearly alike, so they compensate for nearly all of it.

use core::f64::consts::{LN_2, LOG2_E};

use taxel_core::rbf::fixed16::{
    CENTRES_AT_ONCE, DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS, EXPONENT_MARGIN,
    HIGHEST_ACTIVATION, MOST_INPUTS, Network, Parameters,
};
use taxel_core::rbf::{Format, NetworkError, Shape};
use taxel_core::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP, clamp_steps};
use taxel_data::BadValue;

use super::super::least_squares::Factor;
use super::super::samples::CentredScale;
use super::super::tasks::Factors;
use super::super::{HiddenLayer, Options, Samples, squared_distance};
use super::{FittedNetwork, Held, Targets, Write};
use crate::error::{Error, Result, parameter_not_held};

/// One step of inputs, in spans of the training range.
const STEP: f64 = HALF_RANGE as f64 / UNITS as f64 * UNITS_PER_STEP as f64;
/// Fixed-point number that stands for 1 in activations, and for half a range in inputs.
const ONE: f64 = 32_768.0;
/// Largest error of an activation against the Gaussian that its exponent stands for. It covers the
/// cubic, and truncation of the exponent, of the cubic's steps and of the shift.
const ACTIVATION_ERROR: f64 = 2.0e-4;
/// Largest magnitude of a 16-bit weight.
const MOST: f64 = 32_767.0;
/// Inputs with which exponents stay small at usual widths.
const FEW_INPUTS: usize = 16;
/// Largest magnitude of a sum: a little below 2³¹.
const MOST_SUM: f64 = 2_147_000_000.0;

/// Gaussians as this format holds them.
pub(super) struct Exponents {
    shape: Shape,
    scale: CentredScale,
    decay: u32,
    /// Lines of b and pairs of a, K' of them.
    lines: Vec<u32>,
    /// Centres that the lines stand for, in steps.
    centres: Vec<f64>,
    affine_tail: bool,
    /// Words of the network without weights.
    without_weights: Vec<u32>,
}

impl Exponents {
    pub(super) fn new(
        samples: &Samples<'_>,
        layer: &HiddenLayer,
        options: &Options,
    ) -> Result<Self> {
        let (centres, spread) = (&layer.centres, layer.spread);
        let (inputs, outputs) = (samples.inputs(), samples.table.outputs.names.len());
        let refused = |why: String| {
            let rule = format!("{why}; give a larger spread, or another format (f32)");
            Error::from(BadValue::new("spread", spread, rule))
        };
        if inputs > MOST_INPUTS {
            return Err(Error::unfit(format!(
                "{inputs} inputs a row: the format fixed16 holds at most {MOST_INPUTS}; give another format (f32)"
            )));
        }
        let exponent_per_step = LOG2_E / (2.0 * spread.powi(2)) * STEP * STEP;
        let bits = EXPONENT_FRACTION_BITS + DECAY_FRACTION_BITS;
        let decay = (exponent_per_step * 2_f64.powi(bits.cast_signed())).round();
        if decay < 1.0 {
            let rule = "the format fixed16 cannot represent so wide a Gaussian; give a smaller spread, or another format \
                        (f32)";
            return Err(BadValue::new("spread", spread, rule).into());
        }
        if decay > f64::from(u32::MAX) {
            return Err(refused("the format fixed16 cannot represent so narrow a Gaussian".into()));
        }
        let scale = CentredScale::new(samples.table);
        let per_step = decay / 2_f64.powi(DECAY_FRACTION_BITS.cast_signed());
        let count = centres.len() / inputs;
        let pairs = inputs.div_ceil(2);
        let mut lines = Vec::new();
        let mut rounded = Vec::with_capacity(centres.len());
        for centre in centres.chunks_exact(inputs) {
            let mut a = vec![0_i32; 2 * pairs];
            let of_input = a.iter_mut().zip(centre).zip(scale.never_changes());
            for ((a, c), still) in of_input {
                let c = if still { 0.0 } else { (c - 0.5) / STEP };
                *a = (-2.0 * per_step * c).round() as i32;
                if i16::try_from(*a).is_err() {
                    return Err(refused("a centre does not fit the 16 bits of fixed16".into()));
                }
                rounded.push(-f64::from(*a) / (2.0 * per_step));
            }
            let square: u64 = a.iter().map(|a| u64::from(a.unsigned_abs()).pow(2)).sum();
            let b = (u128::from(square) << 32).div_ceil(decay as u128) as u64;
            let b = u32::try_from(b + u64::from(EXPONENT_MARGIN) + 1);
            let too_far = |_| {
                let fewer = if options.features.is_some() || inputs <= FEW_INPUTS {
                    String::new()
                } else {
                    format!(" (--features {FEW_INPUTS} gives the network fewer inputs)")
                };
                refused(format!("exponents of fixed16 are at most 64{fewer}"))
            };
            lines.push(b.map_err(too_far)?);
            lines.extend(a.as_chunks::<2>().0.iter().map(|[low, high]| pair(*low, *high)));
        }
        let mut fill = vec![0; 1 + pairs];
        fill[0] = EXPONENT_MARGIN + 1;
        for _ in count..count.next_multiple_of(CENTRES_AT_ONCE) {
            lines.extend_from_slice(&fill);
        }
        let shape = Shape { inputs, centres: count, outputs };
        let affine_tail = options.affine_tail;
        let (decay, centres, without_weights) = (decay as u32, rounded, vec![]);
        let mut this = Self { shape, scale, decay, lines, centres, affine_tail, without_weights };
        this.without_weights = this.words(None);
        // The format itself checks whether exponents can leave their range.
        match Network::try_new(shape, false, &this.without_weights) {
            Ok(_) => Ok(this),
            Err(NetworkError::ExponentOutOfRange { .. }) => Err(refused(
                "a reading could drive an exponent beyond 64, the limit of fixed16".into(),
            )),
            Err(cause) => Err(parameter_not_held(Format::Fixed16, cause)),
        }
    }

    /// Words of the network with these weights, or without weights.
    fn words(&self, weights: Option<&Rounded>) -> Vec<u32> {
        let Shape { inputs, outputs, .. } = self.shape;
        let blank = Rounded::blank(self.shape);
        let weights = weights.unwrap_or(&blank);
        let line = 1 + inputs.div_ceil(2);
        let mut centres = Vec::new();
        for (group, lines) in self.lines.chunks_exact(CENTRES_AT_ONCE * line).enumerate() {
            centres.extend_from_slice(lines);
            for output in 0..outputs {
                let weight = |k: usize| weights.of_centre(group * CENTRES_AT_ONCE + k, output);
                let words =
                    (0..CENTRES_AT_ONCE / 2).map(|p| pair(weight(2 * p), weight(2 * p + 1)));
                centres.extend(words);
            }
        }
        let parameters = Parameters {
            input_midpoint: &self.scale.midpoint,
            input_per_unit: &self.scale.per_unit,
            decay: self.decay,
            bias: &weights.bias,
            output_scale: &weights.scale,
            affine: &weights.affine_pairs(inputs),
            centres: &centres,
        };
        parameters.words().collect()
    }

    /// Norm ‖f‖ of every output's sum of Gaussians, in the Hilbert space whose reproducing function k is
    /// the Gaussian.
    ///
    /// No reading makes the sum larger, since |f(x)| = |⟨f, k(x, ·)⟩| ≤ ‖f‖·k(x, x)^½ and k(x, x) = 1.
    fn norms(&self, weights: &[f64]) -> Vec<f64> {
        let Shape { inputs, outputs, .. } = self.shape;
        let bits = EXPONENT_FRACTION_BITS + DECAY_FRACTION_BITS;
        let decay = f64::from(self.decay) / 2_f64.powi(bits.cast_signed()) * LN_2;
        let mut squares = vec![0.0; outputs];
        let lines = || self.centres.chunks_exact(inputs).zip(weights.chunks_exact(outputs));
        for (c, w) in lines() {
            for (d, v) in lines() {
                let kernel = (-decay * squared_distance(c, d)).exp();
                let terms = w.iter().zip(v).map(|(w, v)| w * v * kernel);
                squares.iter_mut().zip(terms).for_each(|(square, term)| *square += term);
            }
        }
        squares.into_iter().map(|square| square.max(0.0).sqrt()).collect()
    }
}

fn pair(low: i32, high: i32) -> u32 {
    (low.cast_unsigned() & 0xFFFF) | high.cast_unsigned() << 16
}

/// Weights rounded to integers.
struct Rounded {
    outputs: usize,
    centres: Vec<i32>,
    affine: Vec<i32>,
    bias: Vec<i32>,
    scale: Vec<f32>,
}

impl Rounded {
    fn blank(shape: Shape) -> Self {
        let Shape { outputs, .. } = shape;
        Self {
            outputs,
            centres: vec![],
            affine: vec![],
            bias: vec![0; outputs],
            scale: vec![0.0; outputs],
        }
    }

    /// Weight of a centre for an output; 0 for fill.
    fn of_centre(&self, centre: usize, output: usize) -> i32 {
        self.centres.get(centre * self.outputs + output).copied().unwrap_or(0)
    }

    fn affine_pairs(&self, inputs: usize) -> Vec<u32> {
        if self.affine.is_empty() {
            return Vec::new();
        }
        let at = |input: usize, output: usize| {
            if input < inputs { self.affine[input * self.outputs + output] } else { 0 }
        };
        let of_output = |output| {
            (0..inputs.div_ceil(2)).map(move |p| pair(at(2 * p, output), at(2 * p + 1, output)))
        };
        (0..self.outputs).flat_map(of_output).collect()
    }
}

impl Held for Exponents {
    /// Activations, inputs in half ranges, and 1, as the device computes them.
    fn regressors(&self) -> (usize, Write<'_>) {
        let Shape { inputs, centres, .. } = self.shape;
        let network = Network::try_new(self.shape, false, &self.without_weights);
        let network = network.expect("checked when made");
        let count = centres + if self.affine_tail { inputs } else { 0 } + 1;
        let write = move |readings: &[f64], values: &mut [f64]| {
            let steps: Vec<i32> = self.scale.units(readings).map(clamp_steps).collect();
            for (steps, row) in steps.chunks_exact(inputs).zip(values.chunks_exact_mut(count)) {
                let (activations, rest) = row.split_at_mut(centres);
                let places = activations.chunks_mut(CENTRES_AT_ONCE);
                for (places, found) in places.zip(network.activations(steps)) {
                    let numbers = places.iter_mut().zip(found);
                    numbers.for_each(|(place, q)| *place = f64::from(q) / ONE);
                }
                let (one, tail) = rest.split_last_mut().expect("at least the bias");
                tail.iter_mut().zip(steps).for_each(|(place, x)| *place = f64::from(*x) / ONE);
                *one = 1.0;
            }
        };
        (count, Box::new(write))
    }

    fn network(&self, factors: &Factors, targets: &Targets<'_>) -> Result<FittedNetwork> {
        let rounded = round(factors, self, targets, self.affine_tail)?;
        let words = self.words(Some(&rounded));
        FittedNetwork::try_new(self.shape, Format::Fixed16, self.affine_tail, words)
    }
}

/// Rounds the solution of `factors`, with the finest scale that each output's weights and sums fit.
fn round(
    factors: &Factors,
    exponents: &Exponents,
    targets: &Targets<'_>,
    affine: bool,
) -> Result<Rounded> {
    let Shape { inputs, centres, outputs } = exponents.shape;
    let tail = if affine { inputs } else { 0 };
    let mut exact = factors.weights();
    let mut scale = scales(exponents, &exact, targets, tail);
    // Compensation may make weights larger, which needs a coarser scale; each try is an eighth coarser.
    for _ in 0..40 {
        let weights = factors.together(|factor, columns| rounded_solution(factor, columns, &scale));
        let needed = scales(exponents, &weights, targets, tail);
        if needed.iter().zip(&scale).all(|(needed, scale)| needed <= scale) {
            exact = weights;
            let integer =
                |grid: f64| move |(w, scale): (&f64, &f64)| (w / (grid * scale)).round() as i32;
            let rows = |from: usize, to: usize, grid: f64| -> Vec<i32> {
                let rows = exact[from * outputs..to * outputs].chunks_exact(outputs);
                rows.flat_map(|row| row.iter().zip(&scale).map(integer(grid))).collect()
            };
            let bias = exact[(centres + tail) * outputs..].iter().zip(&targets.means).zip(&scale);
            return Ok(Rounded {
                outputs,
                centres: rows(0, centres, ONE),
                affine: rows(centres, centres + tail, ONE),
                bias: bias.map(|((b, mean), scale)| ((b + mean) / scale).round() as i32).collect(),
                scale: scale.iter().map(|scale| *scale as f32).collect(),
            });
        }
        for (scale, needed) in scale.iter_mut().zip(needed) {
            if needed > *scale {
                *scale = power_of_two_eighths(needed.max(*scale * 1.125));
            }
        }
    }
    Err(Error::unfit(
        "the format fixed16 cannot represent this model: its weights grow without bound when they are rounded; give a larger \
         spread, fewer centres, or another format (f32)",
    ))
}

/// Solves for the weights of a task's `columns` from the last to the first, rounding each at once: `regressors ×
/// columns`. The bias, which comes first, is not rounded: its grid is far finer than all others.
fn rounded_solution(factor: &Factor, columns: &[usize], scale: &[f64]) -> Vec<f64> {
    let (n, outputs) = (factor.regressors, columns.len());
    let mut weights = vec![0.0; n * outputs];
    for i in (0..n).rev() {
        let root = &factor.root[i * n..(i + 1) * n];
        for (output, column) in columns.iter().enumerate() {
            let known: f64 = (i + 1..n).map(|j| root[j] * weights[j * outputs + output]).sum();
            let exact = (factor.projection[i * outputs + output] - known) / root[i];
            let grid = ONE * scale[*column];
            weights[i * outputs + output] =
                if i + 1 == n { exact } else { (exact / grid).round() * grid };
        }
    }
    weights
}

/// Finest scale of each output that its weights and, for every reading, its sum fit.
fn scales(exponents: &Exponents, weights: &[f64], targets: &Targets<'_>, tail: usize) -> Vec<f64> {
    let Shape { centres, outputs, .. } = exponents.shape;
    let norms = exponents.norms(&weights[..centres * outputs]);
    let column = |output: usize, from: usize, to: usize| {
        (from..to).map(move |i| weights[i * outputs + output].abs())
    };
    (0..outputs)
        .map(|output| {
            let largest = column(output, 0, centres + tail).fold(0.0, f64::max);
            let of_centres: f64 = column(output, 0, centres).sum();
            let of_tail: f64 = column(output, centres, centres + tail).sum();
            let bias = weights[(centres + tail) * outputs + output] + targets.means[output];
            let sum = norms[output] * f64::from(HIGHEST_ACTIVATION) / ONE
                + of_centres * ACTIVATION_ERROR
                + of_tail
                + bias.abs();
            let needed = (largest / (MOST * ONE)).max(sum / MOST_SUM);
            power_of_two_eighths(needed.max(f64::from(f32::MIN_POSITIVE)))
        })
        .collect()
}

/// Next larger number of few digits, so that scales are exact in f32.
fn power_of_two_eighths(value: f64) -> f64 {
    let unit = value.log2().floor().exp2() / 8.0;
    (value / unit).ceil() * unit
}

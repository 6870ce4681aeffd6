//! f32 with expanded distances, where rounding is proved harmless.

use model_core::rbf::expanded::{CENTRES_AT_ONCE, Parameters};
use model_core::rbf::{Format, Network, Shape};
use model_core::scale::{HALF_RANGE, UNITS};

use super::super::least_squares::{self, Regressors};
use super::super::{CentredScale, Options, Samples};
use super::{FittedNetwork, Targets, Weights};
use crate::infer::{Kernel, infer};

/// Share of an output's training RMSE that rounding in exponents may reach.
const HARMLESS: f64 = 0.1;

/// A unit of inputs, in spans of the training range.
const UNIT: f64 = HALF_RANGE as f64 / UNITS as f64;

/// The fit, or nothing if rounding is not proved harmless: if an exponent could leave its range, or the
/// [bound](rounding_bounds) of an output exceeds a tenth of its training RMSE.
pub(super) fn fit(
    samples: &Samples<'_>,
    centres: &[f64],
    options: &Options,
    targets: &Targets,
) -> Option<FittedNetwork> {
    let (inputs, outputs) = (samples.inputs(), targets.outputs());
    let count = centres.len() / inputs;
    let scale = CentredScale::of(samples.block);
    let decay = core::f64::consts::LOG2_E / (2.0 * options.spread.powi(2)) * UNIT * UNIT;
    let decay = f64::from(decay as f32);

    // b and a of every centre, and the centre that a stands for once it is rounded.
    let stored = count.next_multiple_of(CENTRES_AT_ONCE);
    let mut exponents = vec![0.0_f32; stored * (1 + inputs)];
    let mut rounded_centres = Vec::with_capacity(centres.len());
    for (row, centre) in exponents.chunks_exact_mut(1 + inputs).zip(centres.chunks_exact(inputs)) {
        let mut square = 0.0;
        for ((place, c), still) in row[1..].iter_mut().zip(centre).zip(scale.never_changes()) {
            let c = if still { 0.0 } else { (c - 0.5) / UNIT };
            *place = (2.0 * decay * c) as f32;
            let c = f64::from(*place) / (2.0 * decay);
            square += c * c;
            rounded_centres.push(0.5 + c * UNIT);
        }
        row[0] = -(decay * square) as f32;
    }
    let scaled = scale.apply(samples.block);
    let regressors = Regressors {
        centres: &rounded_centres,
        inputs,
        decay: decay * core::f64::consts::LN_2 / (UNIT * UNIT),
        affine_tail: options.affine_tail,
    };
    let weights =
        least_squares::fit(&regressors, &scaled, &targets.deviations, options.initial_covariance);
    let mut weights = Weights::split(weights, count, targets);
    // The tail is on inputs about the middle.
    for row in weights.affine.chunks_exact_mut(outputs) {
        weights.bias.iter_mut().zip(&*row).for_each(|(bias, a)| *bias += 0.5 * a);
        row.iter_mut().for_each(|a| *a *= UNIT);
    }
    let round = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
    let mut output_weights = round(&weights.centres);
    output_weights.resize(stored * outputs, 0.0);
    let parameters = Parameters {
        input_midpoint: &scale.midpoint,
        input_per_unit: &scale.per_unit,
        decay: decay as f32,
        bias: &round(&weights.bias),
        affine: &round(&weights.affine),
        exponents: &exponents,
        output_weights: &output_weights,
    };
    let shape = Shape { inputs, centres: count, outputs };
    let block = parameters.words().collect();
    let fitted = FittedNetwork::try_new(shape, Format::F32, options.affine_tail, block).ok()?;
    let predicted = infer(&fitted.network(), Kernel::default(), &samples.block.inputs);
    let squares = samples.block.outputs.squared_errors(&predicted);
    let bounds = rounding_bounds(&fitted.network());
    let frames = samples.block.outputs.len() as f64;
    let harmless = |(square, bound): (&f64, &f64)| *bound <= HARMLESS * (square / frames).sqrt();
    squares.iter().zip(&bounds).all(harmless).then_some(fitted)
}

/// How far rounding in the exponents, and the error of 2^u, can move each output of `network` for any
/// reading, in the output's unit; empty for networks of other formats.
///
/// With u = 2^−24 and d rounded operations in the longest chain of additions, |δv| ≤ γ_d·(|b| + Σ|a|·X +
/// I·g·X²) for inputs up to X, γ_d = d·u/(1 − d·u) (Higham, Accuracy and Stability of Numerical Algorithms,
/// ch. 3); an activation, at most 1, is off by 2^δv − 1 and 2 ulp; an output by the sum over |ω|.
#[must_use]
pub fn rounding_bounds(network: &Network<'_>) -> Vec<f64> {
    const U: f64 = 0.5 * f32::EPSILON as f64;
    let Network::F32(network) = network else { return Vec::new() };
    let (p, Shape { inputs, outputs, .. }) = (network.parameters(), network.shape());
    let gamma = |d: usize| d as f64 * U / (1.0 - d as f64 * U);
    let reach = f64::from(UNITS);
    let shared = inputs as f64 * f64::from(p.decay) * reach * reach;
    // Product, four sums side by side (the first two opened by b and the shared term), two more additions;
    // the shared term takes as many and a product before.
    let chain = inputs.div_ceil(4) + 4;
    let mut bounds = vec![0.0; outputs];
    let lines = p.exponents.chunks_exact(1 + inputs);
    for (row, weights) in lines.zip(p.output_weights.chunks_exact(outputs)) {
        let terms: f64 = row[1..].iter().map(|a| f64::from(a.abs()) * reach).sum();
        let exponent =
            gamma(2 * chain) * shared + gamma(chain) * (f64::from(row[0].abs()) + terms + shared);
        let activation = (core::f64::consts::LN_2 * exponent).exp_m1() + 4.0 * U;
        let moved = weights.iter().map(|w| f64::from(w.abs()) * activation);
        bounds.iter_mut().zip(moved).for_each(|(bound, moved)| *bound += moved);
    }
    bounds
}

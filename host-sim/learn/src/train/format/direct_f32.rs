//! Fit of networks in f32 with direct distances.

use model_core::rbf::direct::Parameters;
use model_core::rbf::{Format, Shape};

use super::super::least_squares::{self, Regressors};
use super::super::{Options, Samples};
use super::{FittedNetwork, Targets, Weights};
use crate::error::Result;

pub(super) fn fit(
    samples: &Samples<'_>,
    centres: &[f64],
    options: &Options,
    targets: &Targets,
) -> Result<FittedNetwork> {
    let inputs = samples.inputs();
    let regressors = Regressors {
        centres,
        inputs,
        // The decay in f32, as the device will use it, so that weights fit the device's activations.
        decay: f64::from((1.0 / (2.0 * options.spread * options.spread)) as f32),
        affine_tail: options.affine_tail,
    };
    let weights = least_squares::fit(
        &regressors,
        &samples.scaled,
        &targets.deviations,
        options.initial_covariance,
    );
    let count = centres.len() / inputs;
    let weights = Weights::split(weights, count, targets);
    let round = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
    let parameters = Parameters {
        input_minimum: &round(&samples.scale.minimum),
        input_per_span: &round(&samples.scale.per_span),
        centres: &round(centres),
        decay: &[regressors.decay as f32],
        output_weights: &round(&weights.centres),
        bias: &round(&weights.bias),
        affine: &round(&weights.affine),
    };
    let shape = Shape { inputs, centres: count, outputs: targets.outputs() };
    let words = parameters.words().collect();
    FittedNetwork::try_new(shape, Format::F32Direct, options.affine_tail, words)
}

//! Fit of networks in f32.

use taxel_core::rbf::float32::Parameters;
use taxel_core::rbf::{Format, Shape};

use super::super::least_squares::Regressors;
use super::super::tasks::Factors;
use super::super::{HiddenLayer, InputScale, Options, Samples};
use super::{FittedNetwork, Held, Targets, Weights, Write};
use crate::error::Result;

/// Gaussians as this format holds them.
pub(super) struct Gaussians {
    scale: InputScale,
    centres: Vec<f64>,
    /// Decay of all centres, rounded to f32 as the device will use it, so that weights fit the device's activations.
    decay: f64,
    affine_tail: bool,
}

impl Gaussians {
    pub(super) fn new(samples: &Samples<'_>, layer: &HiddenLayer, options: &Options) -> Self {
        Self {
            scale: samples.scale.clone(),
            centres: layer.centres.clone(),
            decay: f64::from((1.0 / (2.0 * layer.spread * layer.spread)) as f32),
            affine_tail: options.affine_tail,
        }
    }
}

impl Held for Gaussians {
    fn regressors(&self) -> (usize, Write<'_>) {
        let regressors = Regressors {
            centres: &self.centres,
            inputs: self.scale.minimum.len(),
            decays: std::slice::from_ref(&self.decay),
            affine_tail: self.affine_tail,
        };
        let gaussians = regressors.of(&[]);
        let write = move |readings: &[f64], values: &mut [f64]| {
            gaussians.write(&self.scale.apply(readings), values);
        };
        (regressors.count(), Box::new(write))
    }

    fn network(&self, factors: &Factors, targets: &Targets<'_>) -> Result<FittedNetwork> {
        let inputs = self.scale.minimum.len();
        let count = self.centres.len() / inputs;
        let weights = Weights::split(factors.weights(), count, targets);
        let round = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
        let parameters = Parameters {
            input_minimum: &round(&self.scale.minimum),
            input_per_span: &round(&self.scale.per_span),
            centres: &round(&self.centres),
            decay: &vec![self.decay as f32; count],
            output_weights: &round(&weights.centres),
            bias: &round(&weights.bias),
            affine: &round(&weights.affine),
        };
        let shape = Shape { inputs, centres: count, outputs: targets.outputs() };
        let words = parameters.words().collect();
        FittedNetwork::try_new(shape, Format::F32, self.affine_tail, words)
    }
}

//! Fit of networks in f32 with direct distances.

use model_core::rbf::direct::Parameters;
use model_core::rbf::{Format, Shape};

use super::super::hidden_layer::HiddenLayer;
use super::super::least_squares::{Decomposed, Regressors};
use super::super::{Options, Samples};
use super::{FittedNetwork, Targets, Weights};
use crate::error::Result;

/// Samples decomposed for this format.
pub(super) struct Fit<'s> {
    samples: &'s Samples<'s>,
    targets: &'s Targets,
    centres: &'s [f64],
    /// Decays in f32, as the device will use them, so that weights fit the device's activations.
    decays: Vec<f32>,
    affine_tail: bool,
    decomposed: Decomposed,
}

impl<'s> Fit<'s> {
    pub(super) fn new(
        samples: &'s Samples<'s>,
        layer: &'s HiddenLayer,
        options: &Options,
        targets: &'s Targets,
    ) -> Self {
        let widths = layer.widths();
        let decays: Vec<f32> =
            widths.iter().map(|width| (1.0 / (2.0 * width * width)) as f32).collect();
        let regressors = Regressors {
            centres: &layer.centres,
            inputs: samples.inputs(),
            decays: &decays.iter().copied().map(f64::from).collect::<Vec<_>>(),
            affine_tail: options.affine_tail,
        };
        let design = regressors.of(&samples.scaled);
        let decomposed = Decomposed::new(&design, &targets.deviations.values, targets.outputs());
        let affine_tail = options.affine_tail;
        Self { samples, targets, centres: &layer.centres, decays, affine_tail, decomposed }
    }

    /// Network whose weights have a penalty of 1/`initial_covariance`.
    ///
    /// # Errors
    /// [`Error`](crate::Error) if the format does not hold the network.
    pub(super) fn network(&self, initial_covariance: f64) -> Result<FittedNetwork> {
        let inputs = self.samples.inputs();
        let count = self.centres.len() / inputs;
        let factor = self.decomposed.factor(initial_covariance);
        let weights = Weights::split(factor.weights(), count, self.targets);
        let round = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
        let parameters = Parameters {
            input_minimum: &round(&self.samples.scale.minimum),
            input_per_span: &round(&self.samples.scale.per_span),
            centres: &round(self.centres),
            decay: &self.decays,
            output_weights: &round(&weights.centres),
            bias: &round(&weights.bias),
            affine: &round(&weights.affine),
        };
        let shape = Shape { inputs, centres: count, outputs: self.targets.outputs() };
        let words = parameters.words().collect();
        FittedNetwork::try_new(shape, Format::F32Direct, self.affine_tail, words)?.unless_lost(
            self.samples,
            self.targets,
            &factor,
        )
    }
}

//! A trained network as the blob will hold it.

use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{Network, Shape};

use super::InputScale;
use super::least_squares::Regressors;
use crate::error::{Error, Result};

/// Parameters of one trained network in f32, owned.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedNetwork {
    shape: Shape,
    input_minimum: Vec<f32>,
    input_per_span: Vec<f32>,
    centres: Vec<f32>,
    decay: f32,
    output_weights: Vec<f32>,
    bias: Vec<f32>,
    affine: Vec<f32>,
}

impl FittedNetwork {
    /// Rounds a fit of `weights` (`regressors × outputs`) to f32.
    ///
    /// # Errors
    /// [`Error::Usage`] if a parameter does not fit an f32.
    pub(super) fn try_new(
        scale: &InputScale,
        regressors: &Regressors<'_>,
        weights: &[f64],
        outputs: usize,
    ) -> Result<Self> {
        let round = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
        let centres = regressors.centres.len() / regressors.inputs;
        let (output_weights, rest) = weights.split_at(centres * outputs);
        let (affine, bias) = rest.split_at(rest.len() - outputs);
        let fitted = Self {
            shape: Shape { inputs: regressors.inputs, centres, outputs },
            input_minimum: round(&scale.minimum),
            input_per_span: round(&scale.per_span),
            centres: round(regressors.centres),
            decay: regressors.decay as f32,
            output_weights: round(output_weights),
            bias: round(bias),
            affine: round(affine),
        };
        match direct::Network::try_new(fitted.shape, fitted.parameters()) {
            Ok(_) => Ok(fitted),
            Err(cause) => Err(Error::Usage(format!(
                "training ends in numbers that an f32 does not hold ({cause}); bring the columns \
                 to a moderate scale, say by another unit"
            ))),
        }
    }

    fn parameters(&self) -> Parameters<'_> {
        Parameters {
            input_minimum: &self.input_minimum,
            input_per_span: &self.input_per_span,
            centres: &self.centres,
            decay: std::slice::from_ref(&self.decay),
            output_weights: &self.output_weights,
            bias: &self.bias,
            affine: &self.affine,
        }
    }

    /// The network, ready to infer.
    ///
    /// # Panics
    /// Never: the parameters were checked when they were fitted.
    #[must_use]
    pub fn network(&self) -> Network<'_> {
        direct::Network::try_new(self.shape, self.parameters()).expect("checked when fitted").into()
    }
}

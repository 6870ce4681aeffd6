//! Fitting of output weights to the activations that a device will compute, one file a number format.
//!
//! Centres, widths and scaling are rounded to the format first, and the weights are fitted to the
//! resulting activations. That rounding then causes no error any more; only the weights are rounded
//! last.

use std::cell::LazyCell;

use model_core::expansion::Expansion;
use model_core::rbf::{Format, Network, NetworkError, Shape, direct, expanded, fixed16};

use taxel_data::table::Table;

use super::hidden_layer::{HiddenLayer, not_held};
use super::least_squares::Factor;
use super::{Options, Samples};
use crate::error::{Error, Result};
use crate::infer::{Exponential, infer};

mod direct_f32;
mod expanded_f32;
mod fixed_point;

pub use expanded_f32::rounding_bounds;

/// Most that a format may take from the R² of an output on the training frames, unless its squared error grows by no
/// more than [`MOST_GROWTH`].
pub const MOST_LOST: f64 = 0.01;
/// Factor on squared errors that rounding may cost where an output is hard to decode: its RMSE doubles.
pub const MOST_GROWTH: f64 = 4.0;

/// Trained network with its parameters as the blob will hold them, owned.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedNetwork {
    shape: Shape,
    format: Format,
    affine: bool,
    words: Vec<u32>,
    expansion: Option<Vec<f32>>,
}

impl FittedNetwork {
    /// Checks and holds the network in `words`.
    ///
    /// # Errors
    /// [`Error::NotHeld`] if a parameter does not fit the format.
    fn try_new(shape: Shape, format: Format, affine: bool, words: Vec<u32>) -> Result<Self> {
        let fitted = Self { shape, format, affine, words, expansion: None };
        match fitted.try_network() {
            Ok(_) => Ok(fitted),
            Err(cause) => Err(Error::NotHeld { format, cause }),
        }
    }

    /// The network, if it decodes each output of `samples` as well as the solution of `factor` in f64, which it was
    /// rounded from.
    ///
    /// # Errors
    /// [`Error::OutputLost`] if R² of an output is lower by more than [`MOST_LOST`], and its squared error larger by more
    /// than [`MOST_GROWTH`].
    fn unless_lost(
        self,
        samples: &Samples<'_>,
        targets: &Targets,
        factor: &Factor,
    ) -> Result<Self> {
        let outputs = &samples.table.outputs;
        let predicted =
            infer(&self.network(), Exponential::default(), &samples.table.inputs.values);
        let found = outputs.squared_errors(&predicted);
        for (output, (found, mean)) in found.into_iter().zip(&targets.means).enumerate() {
            let squares = |values: &[f64]| {
                values.iter().skip(output).step_by(targets.outputs()).map(|v| v * v).sum::<f64>()
            };
            let total = squares(&targets.deviations.values);
            // What the fit leaves: the squares of the targets without those along the regressors.
            let left = (total - squares(&factor.projection)).max(0.0);
            let lost = (found - left) / total;
            let rounding = outputs.len() as f64 * (4.0 * f64::EPSILON * mean).powi(2);
            if total > rounding && lost > MOST_LOST && found > MOST_GROWTH * left {
                let (format, output) = (self.format, outputs.names[output].clone());
                return Err(Error::OutputLost { format, output, lost, mean: *mean });
            }
        }
        Ok(self)
    }

    fn try_network(&self) -> std::result::Result<Network<'_>, NetworkError> {
        let Self { shape, format, affine, words, .. } = self;
        Ok(match format {
            Format::F32Direct => {
                let common_width =
                    words.len() == direct::Network::block_words(*shape, true, *affine);
                direct::Network::of_words(*shape, common_width, *affine, words)?.into()
            }
            Format::F32 => expanded::Network::try_new(*shape, *affine, words)?.into(),
            Format::Fixed16 => fixed16::Network::try_new(*shape, *affine, words)?.into(),
        })
    }

    /// The network with an `expansion` of its outputs: means of all outputs, then each component's parts.
    pub(super) fn expanded_by(self, expansion: Vec<f32>) -> Self {
        Self { expansion: Some(expansion), ..self }
    }

    /// Expansion of the network's outputs, if these are components of other ones.
    ///
    /// # Panics
    /// Never: an expansion was made for the network's number of outputs.
    #[must_use]
    pub fn expansion(&self) -> Option<Expansion<'_>> {
        let components = self.shape.outputs;
        self.expansion.as_ref().map(|block| {
            let outputs = block.len() / (1 + components);
            Expansion::new(components, outputs, block).expect("made for these components")
        })
    }

    /// Number format of the network.
    #[must_use]
    pub fn format(&self) -> Format {
        self.format
    }

    /// Network of these parameters, ready to infer.
    ///
    /// # Panics
    /// Never: the parameters were checked when they were fitted.
    #[must_use]
    pub fn network(&self) -> Network<'_> {
        self.try_network().expect("checked when fitted")
    }
}

/// Deviations of the outputs from their means, to which weights are fitted.
///
/// The means go into the bias. An offset would otherwise be spread over large weights that cancel, and
/// cost digits.
pub(super) struct Targets {
    pub deviations: Table,
    pub means: Vec<f64>,
}

impl Targets {
    pub fn of(outputs: &Table) -> Self {
        let means = outputs.means();
        let mut deviations = outputs.clone();
        for line in deviations.values.chunks_exact_mut(means.len()) {
            line.iter_mut().zip(&means).for_each(|(value, mean)| *value -= mean);
        }
        Self { deviations, means }
    }

    pub fn outputs(&self) -> usize {
        self.means.len()
    }
}

/// Weights of a fit, separated by the regressors that they multiply.
struct Weights {
    /// Weights of the activations, `centres × outputs`.
    centres: Vec<f64>,
    /// Weights of the affine tail, `inputs × outputs`, or none.
    affine: Vec<f64>,
    /// Biases, one an output, with the means added.
    bias: Vec<f64>,
}

impl Weights {
    /// Separates `regressors × outputs` weights: those of `centres`, of the inputs if there is a tail,
    /// and of 1.
    fn split(mut weights: Vec<f64>, centres: usize, targets: &Targets) -> Self {
        let outputs = targets.outputs();
        let mut bias = weights.split_off(weights.len() - outputs);
        bias.iter_mut().zip(&targets.means).for_each(|(bias, mean)| *bias += mean);
        let affine = weights.split_off(centres * outputs);
        Self { centres: weights, affine, bias }
    }
}

/// Fits `samples` with the Gaussians of `layer`: one network for each of `initial_covariances`. They share one
/// decomposition. Where each centre has a width of its own, direct distances replace [`Format::F32`].
///
/// # Errors
/// [`Error`](crate::Error) if the format does not hold a network.
pub(super) fn fit(
    samples: &Samples<'_>,
    layer: &HiddenLayer,
    options: &Options,
    initial_covariances: &[f64],
) -> Result<Vec<FittedNetwork>> {
    let targets = Targets::of(&samples.table.outputs);
    let covariances = initial_covariances.iter();
    let direct = || direct_f32::Fit::new(samples, layer, options, &targets);
    let common_width = layer.relative_widths.is_empty();
    let (centres, options) = (&layer.centres, &Options { spread: layer.spread, ..*options });
    let format = match options.format {
        Format::F32 if !common_width => Format::F32Direct,
        Format::Fixed16 if !common_width => return Err(not_held(Format::Fixed16).into()),
        format => format,
    };
    match format {
        Format::F32Direct => {
            let direct = direct();
            covariances.map(|covariance| direct.network(*covariance)).collect()
        }
        Format::F32 => {
            let expanded = expanded_f32::Fit::new(samples, centres, options, &targets);
            let direct = LazyCell::new(direct);
            let of = |covariance: &f64| match expanded.network(*covariance) {
                Some(fitted) => Ok(fitted),
                None => direct.network(*covariance),
            };
            covariances.map(of).collect()
        }
        Format::Fixed16 => {
            let fixed = fixed_point::Fit::new(samples, centres, options, &targets)?;
            covariances.map(|covariance| fixed.network(*covariance)).collect()
        }
    }
}

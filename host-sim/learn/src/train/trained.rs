//! Networks that training ends with, and the fit of their weights.

use taxel_core::blob::Front;
use taxel_core::rbf::Format;
use taxel_data::Progress;

use super::layers::Layers;
use super::samples::Samples;
use super::touch::FittedTouch;
use super::{FittedNetwork, Options, projection};
use crate::error::Result;
use crate::{infer, parallel};

/// Result of training on a data set.
#[derive(Debug, Clone, Default)]
pub struct Trained {
    /// What stands before each network that sees whole frames; nothing for networks of rows.
    pub fronts: Vec<FittedFront>,
    /// Networks of the row-wires in order, or those that see whole frames.
    pub networks: Vec<FittedNetwork>,
}

/// What stands before a network that sees whole frames, as the blob will hold it.
#[derive(Debug, Clone)]
pub struct FittedFront {
    /// Number of outputs of the network: those that follow the outputs of the network before.
    pub outputs: usize,
    /// What makes shape and strength of readings; `None` for readings as they are.
    pub touch: Option<FittedTouch>,
    /// Number of inputs, before the projection.
    pub inputs: usize,
    /// Parameters of the [`projection`]; `None` if the network is given all inputs.
    pub projection: Option<Vec<f32>>,
}

impl FittedFront {
    /// As the blob holds it.
    ///
    /// # Panics
    /// Never: its numbers are finite.
    pub fn view(&self) -> Front<'_> {
        let projection = self.projection.as_deref();
        Front {
            outputs: self.outputs,
            touch: self.touch.as_ref().map(FittedTouch::view),
            projection: projection.map(|parameters| projection::view(parameters, self.inputs)),
        }
    }
}

impl Trained {
    /// Adds `networks` of rows, or the one behind a `front`.
    pub fn add(&mut self, front: Option<FittedFront>, networks: Vec<FittedNetwork>) {
        self.fronts.extend(front);
        self.networks.extend(networks);
    }

    /// Decodes `inputs` (`frames × inputs`) to outputs (`frames × outputs`), as the packed model does.
    pub fn decode(&self, inputs: &[f64]) -> Vec<f64> {
        let fronts: Vec<Front<'_>> = self.fronts.iter().map(FittedFront::view).collect();
        let networks: Vec<_> = self.networks.iter().map(FittedNetwork::network).collect();
        infer::decode(&fronts, &networks, inputs)
    }
}

/// Networks with these `layers`, and output weights that are fitted to the frames that they were found on, with each of
/// `penalties` instead of the options' own: those of one model for each, or an error where the format does not hold them.
/// They share the decomposition of the samples.
pub(crate) fn fit(
    layers: &Layers,
    options: &Options,
    penalties: &[Option<f64>],
    progress: &dyn Progress,
) -> Vec<Result<Vec<FittedNetwork>>> {
    progress.stage("fit weights", layers.hidden.len());
    let mut fitted = fit_rows(layers, options, penalties, progress);
    let failed: Vec<usize> = (0..fitted.len()).filter(|place| fitted[*place].is_err()).collect();
    if options.or_f32 && !failed.is_empty() {
        progress.stage("fit weights in f32", layers.hidden.len());
        let options = Options { format: Format::F32, ..*options };
        let penalties: Vec<Option<f64>> = failed.iter().map(|place| penalties[*place]).collect();
        let in_f32 = fit_rows(layers, &options, &penalties, progress);
        failed.into_iter().zip(in_f32).for_each(|(place, networks)| fitted[place] = networks);
    }
    fitted
}

/// Networks of all rows in the format of `options`, with each of `penalties`.
fn fit_rows(
    layers: &Layers,
    options: &Options,
    penalties: &[Option<f64>],
    progress: &dyn Progress,
) -> Vec<Result<Vec<FittedNetwork>>> {
    let of_row = |row: usize| {
        let seen = layers.seen.row(row);
        let fitted = Samples::of(&seen).fit_each(&layers.hidden[row], options, penalties);
        progress.step();
        fitted.into_iter()
    };
    let mut rows = parallel::map(layers.hidden.len(), &of_row);
    let of_penalty = |_| {
        let of_rows: Vec<Result<FittedNetwork>> =
            rows.iter_mut().filter_map(Iterator::next).collect();
        of_rows.into_iter().collect()
    };
    penalties.iter().map(of_penalty).collect()
}

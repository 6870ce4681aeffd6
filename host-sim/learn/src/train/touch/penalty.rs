//! Penalty on the Gaussians of a network of places: many presses tell them much, and few nothing.

use taxel_core::rbf::Format;
use taxel_data::Dataset;

use super::super::{HiddenLayer, Options, Samples};
use super::features::parts;
use crate::error::Result;

/// Penalties that are tried, for each frame. The largest leaves hardly more than the affine tail.
const PENALTIES: [f64; 5] = [1e-7, 1e-5, 1e-3, 1e-2, 1e-1];

/// Penalty with the least error on parts of `seen` that weights were not fitted to, of a network with this `layer`.
///
/// # Errors
/// [`Error`](crate::Error) for a network that f32 does not hold.
pub fn best(seen: &Dataset, layer: &HiddenLayer, options: &Options) -> Result<f64> {
    let options = Options { format: Format::F32, ..*options };
    let all = seen.weights.clone().unwrap_or_else(|| vec![1.0; seen.frames()]);
    let (mut training, mut errors) = (seen.clone(), [0.0; PENALTIES.len()]);
    // Frames of a press follow one another: a part holds whole presses.
    for part in parts(seen.frames()) {
        training.weights = Some(all.clone());
        training.weights.iter_mut().for_each(|weights| weights[part.clone()].fill(0.0));
        let networks = Samples::new(&training).fit_each(layer, &options, &PENALTIES.map(Some));
        let held = seen.subset(&part.collect::<Vec<_>>());
        for (error, network) in errors.iter_mut().zip(networks) {
            let network = network?;
            *error += Samples::new(&held).squared_errors(&network.network()).iter().sum::<f64>();
        }
    }
    let least = (0..errors.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b]));
    Ok(PENALTIES[least.unwrap_or(0)])
}

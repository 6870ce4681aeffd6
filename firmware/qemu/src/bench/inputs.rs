//! The frames that are decoded: the same for every number format and exponential.

use qemu_image::checks::Numbers;
use taxel_core::blob::Model;
use taxel_core::projection::Projection;
use taxel_core::rbf::Network;

use super::BASELINE_OHM;

/// Number of sweeps: enough for the important features to come near the wanted values.
const SWEEPS: usize = 50;

/// Fills `frame` with readings in Ω within the training range of `model`: every row from random inputs. `features` is
/// working space of as many numbers as a network has inputs.
pub fn fill(model: &Model<'_>, frame: &mut [f32], features: &mut [f32], numbers: &mut Numbers) {
    // A model with relative inputs takes readings over those of the baseline.
    let unit_ohm = if model.metadata().relative_inputs { BASELINE_OHM } else { 1.0 };
    if let (Some(projection), Some(network)) = (model.projection(), model.networks().next()) {
        frame.fill(BASELINE_OHM / unit_ohm);
        approach(projection, &network, frame, features, numbers);
    } else {
        for (row, inputs) in frame.chunks_exact_mut(features.len().max(1)).enumerate() {
            let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
            let Some(network) = network else { continue };
            for (input, x) in inputs.iter_mut().enumerate() {
                let [lowest, highest] = network.training_range(input);
                *x = lowest + (0.5 + 0.5 * numbers.draw()) * (highest - lowest);
            }
        }
    }
    frame.iter_mut().for_each(|x| *x *= unit_ohm);
}

/// Changes `inputs` of a whole array to the nearest whose features are within the training range: by Kaczmarz's sweeps
/// over the features. `wanted` is working space of one number a feature.
#[inline(never)]
fn approach(
    projection: Projection<'_>,
    network: &Network<'_>,
    inputs: &mut [f32],
    wanted: &mut [f32],
    numbers: &mut Numbers,
) {
    for (feature, wanted) in wanted.iter_mut().enumerate() {
        let [lowest, highest] = network.training_range(feature);
        *wanted = lowest + (0.5 + 0.25 * numbers.draw()) * (highest - lowest);
    }
    let (start, parts) = projection.block().split_at_checked(wanted.len()).unwrap_or_default();
    let parts_of = |feature| parts.iter().skip(feature).step_by(start.len().max(1));
    for _ in 0..SWEEPS {
        for (feature, (start, wanted)) in start.iter().zip(&*wanted).enumerate() {
            // Same bits as `Projection::project`, which is not called here: its code is measured.
            let found = inputs.iter().zip(parts_of(feature));
            let found = found.fold(*start, |sum, (reading, part)| sum + part * reading);
            let square: f32 = parts_of(feature).map(|part| part * part).sum();
            let step = (wanted - found) / square.max(f32::MIN_POSITIVE);
            inputs.iter_mut().zip(parts_of(feature)).for_each(|(x, part)| *x += step * part);
        }
    }
}

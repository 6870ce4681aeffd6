//! The frames that are decoded: the same for every number format and exponential.

use model_core::blob::Model;
use model_core::projection::Projection;
use model_core::rbf::Network;
use qemu_image::checks::Numbers;

use super::kernel::{COLS, Frame, ROWS};

/// Number of sweeps: enough for the important features to come near the wanted values.
const SWEEPS: usize = 50;

/// A frame in Ω within the training range of `model`: every row from random scaled inputs.
pub fn frame(model: &Model<'_>, numbers: &mut Numbers) -> Frame {
    if let (Some(projection), Some(network)) = (model.projection(), model.networks().next()) {
        return array_frame(projection, &network, numbers);
    }
    let mut frame = [[f32::NAN; COLS]; ROWS];
    for (row, readings) in frame.iter_mut().enumerate() {
        let inputs: [f32; COLS] = core::array::from_fn(|_| 0.5 + 0.5 * numbers.draw());
        let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
        let Some(network) = network else { continue };
        for (input, (reading, x)) in readings.iter_mut().zip(inputs).enumerate() {
            let [lowest, highest] = network.training_range(input);
            *reading = lowest + x * (highest - lowest);
        }
    }
    frame
}

/// A frame in Ω whose features are within the training range, nearest to readings of 60 Ω: by Kaczmarz's sweeps
/// over the features.
#[inline(never)]
fn array_frame(projection: Projection<'_>, network: &Network<'_>, numbers: &mut Numbers) -> Frame {
    let wanted: [f32; COLS] = core::array::from_fn(|feature| {
        let [lowest, highest] = network.training_range(feature);
        lowest + (0.5 + 0.25 * numbers.draw()) * (highest - lowest)
    });
    let Some((start, parts)) = projection.block().as_chunks::<COLS>().0.split_first() else {
        return [[f32::NAN; COLS]; ROWS];
    };
    let mut frame = [[60.0; COLS]; ROWS];
    for _ in 0..SWEEPS {
        for feature in 0..COLS {
            let readings = frame.as_flattened_mut();
            let parts = || parts.iter().map(|parts| parts[feature]);
            // Same bits as `Projection::project`, which is not called here: its code is measured.
            let found = readings.iter().zip(parts());
            let found = found.fold(start[feature], |sum, (reading, part)| sum + part * reading);
            let square: f32 = parts().map(|part| part * part).sum();
            let step = (wanted[feature] - found) / square.max(f32::MIN_POSITIVE);
            readings.iter_mut().zip(parts()).for_each(|(reading, part)| *reading += step * part);
        }
    }
    frame
}

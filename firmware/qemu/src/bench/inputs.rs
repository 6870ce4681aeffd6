//! What is decoded: the same for every kernel.

use model_core::Frame;
use model_core::blob::Model;
use qemu_image::checks::Numbers;

use super::kernel::{COLS, ROWS};

/// A frame within the readings that `model` was trained on, in ohm: every row from scaled inputs.
pub fn frame(model: &Model<'_>, numbers: &mut Numbers) -> Frame<ROWS, COLS> {
    let mut frame = Frame::missing();
    for (row, readings) in frame.row_column_resistance_ohm.iter_mut().enumerate() {
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

//! What is decoded: the same for every kernel.

use model_core::Frame;
use model_core::blob::Model;
use qemu_image::checks::Numbers;

use super::kernel::{COLS, ROWS};

/// Scaled inputs without a pattern in [0, 1).
pub fn scaled(numbers: &mut Numbers) -> [f32; COLS] {
    core::array::from_fn(|_| 0.5 + 0.5 * numbers.draw())
}

/// A frame within the readings that `model` was trained on, in ohm: every row from scaled inputs.
pub fn frame(model: &Model<'_>, numbers: &mut Numbers) -> Frame<ROWS, COLS> {
    let mut frame = Frame::missing();
    for (row, readings) in frame.row_column_resistance_ohm.iter_mut().enumerate() {
        let inputs = scaled(numbers);
        let network = model.network_of_row(row).and_then(|index| model.networks().nth(index));
        let Some(network) = network else { continue };
        let parameters = network.parameters();
        let limits = parameters.input_minimum.iter().zip(parameters.input_per_span);
        for ((reading, x), (minimum, per_span)) in readings.iter_mut().zip(inputs).zip(limits) {
            *reading = if *per_span > 0.0 { minimum + x / per_span } else { *minimum };
        }
    }
    frame
}

//! Small models for this sensor.

use taxel_core::AlignedBytes;
use taxel_core::blob::{Front, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::projection::Projection;
use taxel_core::rbf::Shape;
use taxel_core::reading_model::{ReadingModel, Sizes};

use super::row_model::with_network;
use super::shape::{COLS, OUTPUTS, ROWS};

/// A blob for this sensor, with `centres` centres and numbers that depend on `seed`.
pub fn blob(seed: usize, centres: usize) -> AlignedBytes {
    blob_of(seed, centres, false, None)
}

/// The blob of `blob(3, 4)` for readings relative to the baseline.
pub fn blob_of_changes() -> AlignedBytes {
    blob_of(3, 4, true, None)
}

fn blob_of(
    seed: usize,
    centres: usize,
    relative_inputs: bool,
    reading_model: Option<ReadingModel<'_>>,
) -> AlignedBytes {
    let shape = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
    with_network(Shape { inputs: COLS, centres, outputs: OUTPUTS }, seed, |network| {
        let networks = [network];
        let parts =
            ModelParts { reading_model, ..ModelParts::new(&networks, &[0; ROWS], metadata) };
        encode_to_vec(&parts).unwrap()
    })
}

/// The blob of `blob(3, 4)` with a reading model, for readings relative to the baseline if `relative_inputs`. Its one component
/// is of frames near 62 Ω, or near the baseline.
pub fn blob_with_readings(relative_inputs: bool) -> AlignedBytes {
    let (readings, outputs) = (ROWS * COLS, ROWS * OUTPUTS);
    let [middle, scale] = if relative_inputs { [1.0, 20.0] } else { [62.0, 0.5] };
    let block = [
        vec![middle; readings],
        vec![scale; readings],
        vec![0.0],                                  // start of the projection
        vec![0.4; readings],                        // parts in a factor of all readings
        vec![-1.0, 0.0, -0.5, 1.0, 0.25, 0.0, 0.5], // c, −o and W
        vec![0.01, 0.0625, 4.0, 0.25],              // variances
        vec![2.0; outputs],                         // ratios
        vec![5.0],                                  // threshold
    ]
    .concat();
    let sizes = Sizes { readings, factors: 1, components: 1, outputs };
    blob_of(3, 4, relative_inputs, Some(ReadingModel::new(sizes, &block).unwrap()))
}

/// A blob of one network for both rows, behind a projection to so many `features`.
pub fn blob_of_features(features: usize) -> AlignedBytes {
    let (readings, outputs) = (ROWS * COLS, ROWS * OUTPUTS);
    // Every feature is the mean reading.
    let mut projection = vec![1.0 / readings as f32; (1 + readings) * features];
    projection[..features].fill(0.0);
    let metadata = Metadata::unnamed(ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS });
    with_network(Shape { inputs: features, centres: 1, outputs }, 0, |network| {
        let networks = [network];
        let projection = Projection::new(readings, features, &projection).ok();
        let fronts = &[Front { outputs, touch: None, projection }];
        let parts = ModelParts { fronts, ..ModelParts::new(&networks, &[0; ROWS], metadata) };
        encode_to_vec(&parts).unwrap()
    })
}

/// The CRC-32 that closes a blob.
pub fn crc_of(blob: &[u8]) -> u32 {
    u32::from_le_bytes(*blob.last_chunk().unwrap())
}

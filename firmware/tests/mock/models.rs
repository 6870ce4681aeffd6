//! Small models for this sensor.

use taxel_core::blob::{Columns, Front, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::projection::Projection;
use taxel_core::rbf::float32::{self, Parameters};
use taxel_core::rbf::{Network, Shape};
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_core::track::{self, Settings, Tracker};
use taxel_core::{AlignedBytes, Decoder};

use super::shape::{COLS, OUTPUTS, ROWS, TestFrame, frame_at_rest};

/// A blob for this sensor, with `centres` centres and numbers that depend on `seed`.
pub fn blob(seed: usize, centres: usize) -> AlignedBytes {
    blob_of(seed, centres, false, None, None)
}

/// The blob of `blob(3, 4)` for readings relative to the baseline.
pub fn blob_of_changes() -> AlignedBytes {
    blob_of(3, 4, true, None, None)
}

fn blob_of(
    seed: usize,
    centres: usize,
    relative_inputs: bool,
    reading_model: Option<ReadingModel<'_>>,
    tracker: Option<Tracker<'_>>,
) -> AlignedBytes {
    let shape = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
    with_network(Shape { inputs: COLS, centres, outputs: OUTPUTS }, seed, |network| {
        let (networks, plain) = ([network], [0; ROWS]);
        let plain = ModelParts::new(&networks, &plain, metadata);
        encode_to_vec(&ModelParts { reading_model, tracker, ..plain }).unwrap()
    })
}

/// The blob of `blob(3, 4)` with a reading model, for readings relative to the baseline if `relative_inputs`. Its one component
/// is of frames near 62 Ω, or near the baseline.
pub fn blob_with_readings(relative_inputs: bool) -> AlignedBytes {
    with_readings(relative_inputs, None)
}

/// That blob with a tracker of two electrodes a row, 3 mm apart.
pub fn blob_with_tracker(relative_inputs: bool) -> AlignedBytes {
    let settings = Settings {
        noise: 0.1,
        smooth: [[8.0, 3.0, 3.0], [8.0, 3.0, 3.0], [20.0, 0.3, 0.25]],
        walks: [1e-4; 6],
        start: [
            [0.5, 0.2],
            [0.5, 0.2],
            [0.5, 0.2],
            [0.05, 3.0],
            [0.05, 0.0],
            [0.05, 0.0],
            [0.05, 0.0],
            [0.05, 0.0],
            [0.05, 0.0],
        ],
        range: [
            [0.0, 6.0],
            [0.0, 6.0],
            [-0.1, 1.2],
            [1.5, 5.0],
            [-0.5, 0.5],
            [-0.5, 0.5],
            [-0.6, 0.6],
            [-0.6, 0.6],
            [-0.5, 0.9],
        ],
    };
    let mut block = settings.floats().to_vec();
    block.extend(frame_at_rest().as_flattened());
    block.extend([1.5, 1.5, 4.5, 1.5, 1.5, 4.5, 4.5, 4.5]);
    for cell in 0..ROWS * OUTPUTS * COLS {
        let near = 0.2 + 0.02 * (cell % 5) as f32;
        block.extend([0.02, 0.01, near, 0.01, 0.0, 0.02, 0.01, 0.0, 0.5 * near]);
    }
    let sizes = track::Sizes { rows: ROWS, electrodes: OUTPUTS, columns: COLS, span: 1 };
    with_readings(relative_inputs, Some(Tracker::new(sizes, &block).unwrap()))
}

fn with_readings(relative_inputs: bool, tracker: Option<Tracker<'_>>) -> AlignedBytes {
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
    blob_of(3, 4, relative_inputs, Some(ReadingModel::new(sizes, &block).unwrap()), tracker)
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

/// Seed of the models whose outputs are too large for `f32`.
pub const OVERFLOWING: usize = 7;

/// A blob of one network with this `shape`, which has one row, and this `metadata`.
pub fn blob_of_a_row(shape: ModelShape, metadata: Metadata<'_>) -> AlignedBytes {
    let ModelShape { inputs, outputs, .. } = shape;
    with_network(Shape { inputs, centres: 1, outputs }, 0, |network| {
        encode_to_vec(&ModelParts::new(&[network], &[0], metadata)).unwrap()
    })
}

/// Blob of a model of one row, whose readings have these names, one on each line.
pub fn blob_of_names(names: &'static str, outputs: usize) -> AlignedBytes {
    let shape = ModelShape { rows: 1, inputs: names.lines().count(), outputs };
    blob_of_a_row(shape, Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) })
}

/// The blob of `blob(3, 4)` with these units of its outputs, one on each line.
pub fn blob_of_units(output_units: &'static str) -> AlignedBytes {
    let shape = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
    let metadata = Metadata { output_units: Columns(output_units), ..Metadata::unnamed(shape) };
    with_network(Shape { inputs: COLS, centres: 4, outputs: OUTPUTS }, 3, |network| {
        encode_to_vec(&ModelParts::new(&[network], &[0; ROWS], metadata)).unwrap()
    })
}

/// What `make` makes of a network of this shape, with an affine tail and numbers that depend on `seed`.
fn with_network<T>(shape: Shape, seed: usize, make: impl FnOnce(Network<'_>) -> T) -> T {
    let Shape { inputs, centres, outputs } = shape;
    let scale = if seed == OVERFLOWING { f32::MAX } else { 1.0 };
    let number = |i: usize| scale * (((i * 37 + seed * 11) % 101) as f32 / 50.0 - 1.0);
    let list = |from: usize, count: usize| (from..from + count).map(number).collect::<Vec<_>>();
    let parameters = Parameters {
        input_minimum: &vec![50.0; inputs],
        input_per_span: &vec![0.05; inputs],
        centres: &list(1, centres * inputs),
        decay: &vec![1.5; centres],
        output_weights: &list(2, centres * outputs),
        bias: &list(3, outputs),
        affine: &list(4, inputs * outputs),
    };
    make(float32::Network::try_new(shape, parameters).unwrap().into())
}

pub fn bits(values: impl IntoIterator<Item = f32>) -> Vec<u32> {
    values.into_iter().map(f32::to_bits).collect()
}

/// Bits of the outputs of taxel-core itself.
pub fn expected(blob: &[u8], frame: &TestFrame) -> Vec<u32> {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    bits(decoder.decode(frame.as_flattened()).unwrap().outputs)
}

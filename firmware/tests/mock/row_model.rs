//! A small model of one row.

use taxel_core::AlignedBytes;
use taxel_core::blob::{Columns, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::float32::{self, Parameters};
use taxel_core::rbf::{Network, Shape};

/// Seed of the models whose outputs are too large for `f32`.
pub const OVERFLOWING: usize = 7;

/// A blob of one network with this `shape`, which has one row, and this `metadata`.
pub fn blob_of_a_row(shape: ModelShape, metadata: Metadata<'_>) -> AlignedBytes {
    let ModelShape { inputs, outputs, .. } = shape;
    with_network(Shape { inputs, centres: 1, outputs }, 0, |network| {
        encode_to_vec(&ModelParts::new(&[network], &[0], metadata)).unwrap()
    })
}

/// The same whose readings have these names, one on each line.
pub fn blob_of_names(names: &'static str, outputs: usize) -> AlignedBytes {
    let shape = ModelShape { rows: 1, inputs: names.lines().count(), outputs };
    blob_of_a_row(shape, Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) })
}

/// What `make` makes of a network of this shape, with an affine tail and numbers that depend on `seed`.
pub fn with_network<T>(shape: Shape, seed: usize, make: impl FnOnce(Network<'_>) -> T) -> T {
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

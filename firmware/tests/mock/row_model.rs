//! A small model of one row.

use taxel_core::AlignedBytes;
use taxel_core::blob::{Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::Shape;
use taxel_core::rbf::float32::{self, Parameters};

/// A blob of one network with this `shape`, which has one row, and this `metadata`.
pub fn blob_of_a_row(shape: ModelShape, metadata: Metadata<'_>) -> AlignedBytes {
    let ModelShape { inputs, outputs, .. } = shape;
    let number = |i: usize| ((i * 37) % 101) as f32 / 50.0 - 1.0;
    let list = |from: usize, count: usize| (from..from + count).map(number).collect::<Vec<_>>();
    let (centre, weights, bias) = (list(1, inputs), list(2, outputs), list(3, outputs));
    let (minimum, per_span) = (vec![50.0; inputs], vec![0.05; inputs]);
    let network = float32::Network::try_new(
        Shape { inputs, centres: 1, outputs },
        Parameters {
            input_minimum: &minimum,
            input_per_span: &per_span,
            centres: &centre,
            decay: &[1.5],
            output_weights: &weights,
            bias: &bias,
            affine: &[],
        },
    );
    let networks = &[network.unwrap().into()];
    encode_to_vec(&ModelParts::new(networks, &[0], metadata)).unwrap()
}

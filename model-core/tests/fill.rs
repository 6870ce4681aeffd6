//! Fill of missing readings, in a blob and behind a decoder.

use crate::common::worked_bytes;
use taxel_core::blob::{DecodeError, Metadata, Model, ModelParts, ModelShape, encode_to_vec};
use taxel_core::fill::Fill;
use taxel_core::rbf::{Shape, float32};
use taxel_core::{AlignedBytes, Decoder, RowStatus};

const SHAPE: ModelShape = ModelShape { rows: 2, inputs: 2, outputs: 1 };

/// m, s and V of four readings that move together.
pub const BLOCK: [[f32; 4]; 3] = [[60.0, 61.0, 62.0, 63.0], [10.0; 4], [0.49; 4]];

pub fn blob(fill: Option<Fill<'_>>, relative_inputs: bool) -> Result<AlignedBytes, DecodeError> {
    let network = float32::Network::try_new(
        Shape { inputs: 2, centres: 1, outputs: 1 },
        float32::Parameters {
            input_minimum: &[50.0, 50.0],
            input_per_span: &[0.05, 0.05],
            centres: &[0.5, 0.5],
            decay: &[2.0],
            output_weights: &[0.5],
            bias: &[0.25],
            affine: &[],
        },
    );
    let networks = &[network.unwrap().into()];
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(SHAPE) };
    let parts = ModelParts { fill, ..ModelParts::new(networks, &[0, 0], metadata) };
    encode_to_vec(&parts).map_err(|error| match error {
        taxel_core::blob::EncodeError::Refused(cause) => cause,
        other => panic!("{other}"),
    })
}

pub fn fill() -> Fill<'static> {
    Fill::new(4, 1, BLOCK.as_flattened()).unwrap()
}

#[test]
fn a_blob_keeps_its_fill_and_a_model_without_has_none() {
    let filled = blob(Some(fill()), false).unwrap();
    let model = Model::decode(&filled).unwrap();
    assert_eq!(model.fill(), Some(fill()));
    let plain = blob(None, false).unwrap();
    assert_eq!(Model::decode(&plain).unwrap().fill(), None);
    // The specification's bytes, whose offsets count from a multiple of four.
    let worked = worked_bytes("worked fill");
    let at = (0..filled.len()).find(|at| filled[*at..].starts_with(&[7, 1])).unwrap();
    let floats = at + 4 + usize::from(filled[at + 2]);
    assert_eq!(filled[floats..][..48], worked[worked.len() - 48..]);
    assert_eq!((worked[..2].to_vec(), worked[worked.len() - 49]), (vec![7, 1], 48));
}

#[test]
fn a_decoder_fills_what_is_missing_if_it_has_a_fill() {
    for (fill, count, status) in
        [(Some(fill()), 1, RowStatus::Decoded), (None, 0, RowStatus::MissingReading)]
    {
        let bytes = blob(fill, false).unwrap();
        let decoder = Decoder::<2>::load(&bytes).unwrap();
        let (mut frame, mut scratch) = ([61.0, f32::NAN, 63.0, 64.0], [0.0; 8]);
        assert_eq!(decoder.fill(&mut frame, &mut scratch), count);
        assert_eq!(decoder.decode(&frame[..]).unwrap().status, [status, RowStatus::Decoded]);
        assert!(count == 0 || (frame[1] - 62.0).abs() < 0.1, "{frame:?}");
    }
}

#[test]
fn unsound_fills_are_refused() {
    let relative = DecodeError::Malformed { section: "fill of relative inputs" };
    assert_eq!(blob(Some(fill()), true), Err(relative));
    let other = Fill::new(3, 1, &[0.5; 9]).unwrap();
    let count = DecodeError::CountMismatch { what: "bytes of fill", expected: 48, found: 36 };
    assert_eq!(blob(Some(other), false), Err(count));
}

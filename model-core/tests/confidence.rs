//! Confidence of a model: how a decoder assesses frames with it.

use crate::common::network;
use taxel_core::blob::{Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::confidence::{Confidence, Sizes};
use taxel_core::rbf::NetworkError;
use taxel_core::relative::reciprocal;
use taxel_core::{AlignedBytes, Decoder, Frame};

pub const SIZES: Sizes = Sizes { readings: 2, directions: 1, components: 1, outputs: 1 };
pub const BLOCK: [f32; 16] =
    [50.0, 60.0, 0.25, 0.5, 0.0, 1.0, 0.0, -1.0, 0.5, 1.0, 1.0, 0.25, 2.0, 0.0625, 2.0, 3.0];

pub fn small(relative_inputs: bool) -> AlignedBytes {
    let unnamed = Metadata::unnamed(ModelShape { rows: 1, inputs: 2, outputs: 1 });
    let networks = &[network(&[1.5])];
    let parts = ModelParts {
        confidence: Some(Confidence::new(SIZES, &BLOCK).unwrap()),
        ..ModelParts::new(networks, &[0], Metadata { relative_inputs, ..unnamed })
    };
    encode_to_vec(&parts).unwrap()
}

#[test]
fn a_decoder_assesses_frames_and_decodes_them_as_without() {
    let blob = small(false);
    let decoder = Decoder::<1>::load(&blob).unwrap();
    let confidence = decoder.model().confidence().unwrap();
    assert_eq!((confidence.sizes(), confidence.block()), (SIZES, &BLOCK[..]));
    assert_eq!(decoder.scratch_floats(), 5);
    let (mut scratch, mut deviation) = ([0.0; 5], [0.0]);
    let frame = Frame::from(&[58.0, 61.0][..]);
    let novelty = decoder.assess_into(frame, &mut scratch, &mut deviation).unwrap().unwrap();
    // z = (2, ½), f = (2, ½): 2 − 0.5 and 0.25·2 + 2·0.5 − 1.
    let density: f32 = -1.0 - 0.5 * (1.5 * 1.5 + 0.5 * 0.5);
    assert!((novelty - (-density - 3.0)).abs() < 1e-6, "{novelty}");
    assert_eq!(deviation, [0.25]);

    let estimate = decoder.decode(&[58.0, 61.0][..]).unwrap();
    let mut output = [0.0];
    network(&[1.5]).infer(&[58.0, 61.0], &mut [0.0; 2], &mut output).unwrap();
    assert_eq!(estimate.outputs, output);
    let wrong = decoder.assess_into(Frame::from(&[58.0][..]), &mut scratch, &mut deviation);
    assert_eq!(wrong, Err(NetworkError::Length { what: "frame", expected: 2, found: 1 }));
}

#[test]
fn readings_are_relative_where_the_models_are() {
    let blob = small(true);
    let decoder = Decoder::<1>::load(&blob).unwrap();
    let (mut scratch, mut deviation) = ([0.0; 5], [0.0]);
    let mut assess = |readings_ohm: &[f32], reciprocals: &[f32]| {
        let frame = Frame { readings_ohm, reciprocals };
        decoder.assess_into(frame, &mut scratch, &mut deviation)
    };
    // 116/2 and 244/4.
    let relative = assess(&[116.0, 244.0], &[2.0, 4.0].map(reciprocal)).unwrap().unwrap();
    assert!((relative - (1.0 + 1.25 - 3.0)).abs() < 1e-6, "{relative}");
    let unknown = assess(&[116.0, 244.0], &[0.5, f32::NAN]).unwrap().unwrap();
    assert!(unknown.is_nan());
    let length = NetworkError::Length { what: "reciprocals", expected: 2, found: 0 };
    assert_eq!(assess(&[116.0, 244.0], &[]), Err(length));
}

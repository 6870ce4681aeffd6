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
fn a_decoder_assesses_readings_or_ratios_and_has_its_lengths_checked() {
    let [plain, relative] = [small(false), small(true)];
    let [plain, relative] = [&plain, &relative].map(|blob| Decoder::<1>::load(blob).unwrap());
    let confidence = plain.model().confidence().unwrap();
    assert_eq!((confidence.sizes(), confidence.block()), (SIZES, &BLOCK[..]));
    assert_eq!(plain.scratch_floats(), 5);
    let (mut scratch, mut deviation) = ([0.0; 5], [0.0]);
    let mut assess = |decoder: &Decoder<'_, 1>, readings_ohm: &[f32], reciprocals: &[f32]| {
        decoder.assess_into(Frame { readings_ohm, reciprocals }, &mut scratch, &mut deviation)
    };
    let baseline = [2.0, 4.0].map(reciprocal);
    let found = [
        assess(&plain, &[58.0, 61.0], &[]).unwrap().unwrap(),
        assess(&relative, &[116.0, 244.0], &baseline).unwrap().unwrap(),
    ];
    // z = (2, ½), f = (2, ½): 2 − 0.5 and 0.25·2 + 2·0.5 − 1.
    let novelty = 1.0 + 0.5 * (1.5 * 1.5 + 0.5 * 0.5) - 3.0;
    assert!(found.iter().all(|found: &f32| (found - novelty).abs() < 1e-6), "{found:?}");
    assert!(assess(&relative, &[116.0, 244.0], &[0.5, f32::NAN]).unwrap().unwrap().is_nan());
    let length = |what, found| Err(NetworkError::Length { what, expected: 2, found });
    assert_eq!(assess(&plain, &[58.0], &[]), length("frame", 1));
    assert_eq!(assess(&relative, &[116.0, 244.0], &[]), length("reciprocals", 0));
}

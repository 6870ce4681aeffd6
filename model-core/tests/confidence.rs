//! Confidence of a model: its section of the blob, and how a decoder assesses frames with it.

use crate::common::{seal, worked_bytes};
use model_core::blob::{DecodeError, EncodeError, Metadata, Model, ModelParts, ModelShape, encode};
use model_core::confidence::{Confidence, Sizes};
use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{NetworkError, Shape};
use model_core::relative::reciprocal;
use model_core::{Aligned, Decoder, Frame};
use proptest::prelude::*;

const SIZES: Sizes = Sizes { readings: 2, directions: 1, components: 1, outputs: 1 };
const BLOCK: [f32; 16] =
    [50.0, 60.0, 0.25, 0.5, 0.0, 1.0, 0.0, -1.0, 0.5, 1.0, 1.0, 0.25, 2.0, 0.0625, 2.0, 3.0];

fn encoded(
    sizes: Sizes,
    block: &[f32],
    relative_inputs: bool,
    buffer: &mut [u8],
) -> Result<usize, EncodeError> {
    let parameters = Parameters {
        input_minimum: &[50.0, 60.0],
        input_per_span: &[0.125, 0.1],
        centres: &[0.5, 0.25],
        decay: &[2.0],
        output_weights: &[1.5],
        bias: &[0.5],
        affine: &[],
    };
    let shape = Shape { inputs: 2, centres: 1, outputs: 1 };
    let network = direct::Network::try_new(shape, parameters).unwrap().into();
    let unnamed = Metadata::unnamed(ModelShape { rows: 1, inputs: 2, outputs: 1 });
    let parts = ModelParts {
        projection: None,
        expansion: None,
        confidence: Some(Confidence::new(sizes, block).unwrap()),
        fill: None,
        networks: &[network],
        row_network: &[0],
        metadata: Metadata { relative_inputs, ..unnamed },
    };
    encode(&parts, buffer).map(<[u8]>::len)
}

fn small(relative_inputs: bool) -> (Aligned<[u8; 512]>, usize) {
    let mut buffer = Aligned([0; 512]);
    let length = encoded(SIZES, &BLOCK, relative_inputs, &mut buffer.0).unwrap();
    (buffer, length)
}

/// Where the section starts.
fn section(blob: &[u8]) -> usize {
    let floats: Vec<u8> = BLOCK.iter().flat_map(|value| value.to_le_bytes()).collect();
    let start = blob.windows(floats.len()).position(|window| window == floats).unwrap();
    assert!(start.is_multiple_of(4));
    blob[..start].windows(3).rposition(|window| window == [7, 1, 1]).unwrap()
}

#[test]
fn a_decoder_assesses_frames_and_decodes_them_as_without() {
    let (buffer, length) = small(false);
    let decoder = Decoder::<1>::load(&buffer.0[..length]).unwrap();
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
    assert!((0.5..2.0).contains(&estimate.outputs[0]));
    let wrong = decoder.assess_into(Frame::from(&[58.0][..]), &mut scratch, &mut deviation);
    assert_eq!(wrong, Err(NetworkError::Length { what: "frame", expected: 2, found: 1 }));
}

#[test]
fn readings_are_relative_where_the_models_are() {
    let (buffer, length) = small(true);
    let decoder = Decoder::<1>::load(&buffer.0[..length]).unwrap();
    let (mut scratch, mut deviation) = ([0.0; 5], [0.0]);
    let mut assess = |readings_ohm: &[f32], reciprocals: &[f32]| {
        let frame = Frame { readings_ohm, reciprocals, gate: None };
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

#[test]
fn a_confidence_of_other_readings_or_outputs_is_refused_when_written() {
    let mut buffer = Aligned([0; 1024]);
    let sizes = Sizes { outputs: 2, ..SIZES };
    let mut block = BLOCK.to_vec();
    block.extend([1.0, 1.0]);
    let what = "bytes of confidence";
    let cause = DecodeError::CountMismatch { what, expected: 64, found: 72 };
    let refused = encoded(sizes, &block, false, &mut buffer.0);
    assert_eq!(refused, Err(EncodeError::Refused(cause)));
}

#[test]
fn every_damage_of_the_section_has_its_own_error() {
    let (buffer, length) = small(false);
    let start = section(&buffer.0[..length]);
    let changed = |place: usize, bytes: &[u8]| {
        let mut damaged = buffer;
        damaged.0[place..place + bytes.len()].copy_from_slice(bytes);
        assert!(matches!(Model::decode(&damaged.0[..length]), Err(DecodeError::Corrupt { .. })));
        seal(&mut damaged.0[..length]);
        Model::decode(&damaged.0[..length]).map(drop).unwrap_err()
    };
    let count = |expected| {
        let what = "bytes of confidence";
        DecodeError::CountMismatch { what, expected, found: 64 }
    };
    let network = DecodeError::Malformed { section: "network section" };
    assert_eq!(changed(start, &[200]), network);
    // Two directions take 4·(1 + 2 + 1 + 3) bytes more; two components 4·(1 + 2 + 3 + 1).
    assert_eq!(changed(start + 1, &[2]), count(92));
    assert_eq!(changed(start + 2, &[2]), count(92));
    assert_eq!(changed(start + 2, &[0]), count(36));
    assert_eq!(changed(start + 4, &[1]), DecodeError::Malformed { section: "padding" });
    let floats = start + 8;
    let cause = NetworkError::NotFinite { what: "confidence" };
    for number in 0..BLOCK.len() {
        let nan = changed(floats + 4 * number, &f32::NAN.to_le_bytes());
        assert_eq!(nan, DecodeError::Confidence { cause }, "number {number}");
    }
    assert_eq!(changed(floats + 52, &2e38_f32.to_le_bytes()), DecodeError::Confidence { cause });
    let cause = NetworkError::NotPositive { what: "confidence" };
    assert_eq!(changed(floats + 48, &0_f32.to_le_bytes()), DecodeError::Confidence { cause });
}

#[test]
fn a_blob_that_is_cut_off_is_refused_wherever_it_ends() {
    let (buffer, length) = small(false);
    for end in 0..length {
        assert!(Model::decode(&buffer.0[..end]).is_err(), "{end} of {length} bytes");
    }
}

#[test]
fn the_section_has_the_specifications_worked_bytes() {
    let (buffer, length) = small(false);
    let bytes = worked_bytes("worked confidence");
    let start = section(&buffer.0[..length]);
    assert_eq!(buffer.0[start..start + bytes.len()], bytes);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]
    /// Parsing and assessing end for any bytes under a valid CRC. Where readings are numbers, so is the novelty.
    #[test]
    fn hostile_bytes_under_a_valid_crc_never_panic(
        changes in prop::collection::vec((9_usize..500, any::<u8>()), 1..6),
        frame in prop::array::uniform2(any::<f32>()),
    ) {
        let (mut buffer, length) = small(false);
        for (offset, byte) in changes {
            buffer.0[9 + offset % (length - 4 - 9)] = byte;
        }
        seal(&mut buffer.0[..length]);
        let Ok(decoder) = Decoder::<1>::load(&buffer.0[..length]) else { return Ok(()) };
        let Some(confidence) = decoder.model().confidence() else { return Ok(()) };
        let mut deviation = vec![0.0; confidence.sizes().outputs];
        let mut scratch = vec![0.0; decoder.scratch_floats()];
        let assessed = decoder.assess_into(Frame::from(&frame[..]), &mut scratch, &mut deviation);
        let Ok(Some(novelty)) = assessed else { return Ok(()) };
        prop_assert!(novelty.is_finite() || novelty.is_nan());
        prop_assert!(deviation.iter().all(|d| !d.is_infinite()));
    }
}

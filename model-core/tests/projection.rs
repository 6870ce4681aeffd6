//! One network for the whole array, behind a projection: its blob, and how a decoder decodes with it.

use model_core::blob::{
    DecodeError, EncodeError, Metadata, Model, ModelParts, ModelShape, encode, encoded_length_bound,
};
use model_core::checksum::CRC_32;
use model_core::gate::Rest;
use model_core::projection::Projection;
use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{Network, Shape};
use model_core::{Aligned, Decoder, Estimate, Frame, Gate, OwnedEstimate, RowStatus};

/// A projection block: the first feature is the mean of the four readings, the second the difference of the rows.
const BLOCK: [f32; 10] = [0.0, 10.0, 0.25, 0.25, 0.25, 0.25, 0.25, -0.25, 0.25, -0.25];
/// A frame at the network's centre in the first feature, and a quarter of the span from it in the second.
const NEAR_CENTRE: [f32; 4] = [48.0, 50.0, 60.0, 58.0];

fn network(outputs: usize) -> Network<'static> {
    let parameters = Parameters {
        input_minimum: &[50.0, 5.0],
        input_per_span: &[0.125, 0.1],
        centres: &[0.5, 0.25],
        decay: &[2.0],
        output_weights: &[1.5, 3.0, 4.5][..outputs],
        bias: &[-0.5, -1.0, 0.0][..outputs],
        affine: &[],
    };
    direct::Network::try_new(Shape { inputs: 2, centres: 1, outputs }, parameters).unwrap().into()
}

fn encoded<'b>(
    block: &[f32],
    networks: &[Network<'_>],
    row_network: &[u8],
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    let projection = Projection::new(4, 2, block).ok();
    let metadata = Metadata::unnamed(ModelShape { rows: 2, inputs: 2, outputs: 1 });
    let parts = ModelParts {
        projection,
        expansion: None,
        confidence: None,
        fill: None,
        networks,
        row_network,
        metadata,
    };
    assert!(encoded_length_bound(&parts) <= buffer.len());
    encode(&parts, buffer)
}

fn array(buffer: &mut [u8]) -> &[u8] {
    encoded(&BLOCK, &[network(2)], &[0, 0], buffer).unwrap()
}

#[test]
fn the_features_of_a_whole_frame_decide_all_rows() {
    let mut buffer = Aligned([0; 1024]);
    let blob = array(&mut buffer.0);
    let (decoder, model) = (Decoder::<2>::load(blob).unwrap(), Model::decode(blob).unwrap());
    let mut features = [0.0; 2];
    model.projection().unwrap().project(&NEAR_CENTRE, &mut features);
    assert_eq!(features, [54.0, 5.0]);
    let activation = (-2.0_f32 * 0.0625).exp();
    let estimate = decoder.decode(&NEAR_CENTRE[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Decoded; 2]);
    let expected = [1.5 * activation - 0.5, 3.0 * activation - 1.0];
    for (outputs, expected) in estimate.outputs.iter().zip(expected) {
        assert!((outputs - expected).abs() < 1e-6, "{outputs:?} {expected}");
    }
}

#[test]
fn features_are_clamped_and_not_readings() {
    let mut buffer = Aligned([0; 1024]);
    let decoder = Decoder::<2>::load(array(&mut buffer.0)).unwrap();
    let clamps = |frame: [f32; 4]| {
        let (mut outputs, mut status) = ([0.0; 2], [RowStatus::MissingReading; 2]);
        let mut scratch = [f32::MAX; 4];
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        decoder.decode_into(Frame::from(&frame[..]), &mut scratch, &mut estimate).unwrap()
    };
    // In training the first feature was 50 to 58, and the second 5 to 15.
    assert!(!clamps(NEAR_CENTRE));
    assert!(!clamps([8.0, 100.0, 100.0, 8.0])); // far readings, but a usual mean
    assert!(clamps([60.0, 60.0, 60.0, 60.0]));
    assert!(clamps([10.0, 10.0, 90.0, 90.0])); // a usual mean
    assert!(clamps([10.0, 10.0, 200.0, 200.0]));
    assert!(!clamps([f32::NAN, 10.0, 90.0, 90.0]));
}

#[test]
fn one_missing_reading_leaves_no_row_to_decode() {
    let mut buffer = Aligned([0; 1024]);
    let decoder = Decoder::<2>::load(array(&mut buffer.0)).unwrap();
    for missing in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut frame = NEAR_CENTRE;
        frame[2] = missing;
        let estimate = decoder.decode(&frame[..]).unwrap();
        assert_eq!(estimate.status, [RowStatus::MissingReading; 2]);
        assert!(estimate.outputs.iter().all(|output| output.is_nan()));
    }
}

#[test]
fn features_that_overflow_are_told_from_missing_readings() {
    let mut buffer = Aligned([0; 1024]);
    let block = BLOCK.map(|part| 2.0 * part);
    let blob = encoded(&block, &[network(2)], &[0, 0], &mut buffer.0).unwrap();
    let decoder = Decoder::<2>::load(blob).unwrap();
    let frame = [f32::MAX, f32::MAX, -f32::MAX, -f32::MAX];
    let estimate = decoder.decode(&frame[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Overflow; 2]);
    assert!(estimate.outputs.iter().all(|output| output.is_nan()));
}

#[test]
fn an_array_is_at_rest_as_a_whole_or_not_at_all() {
    let mut buffer = Aligned([0; 1024]);
    let decoder = Decoder::<2>::load(array(&mut buffer.0)).unwrap();
    let rest = decoder.decode(&NEAR_CENTRE[..]).unwrap();
    let OwnedEstimate { outputs, status } = &rest;
    let gate = Gate::new(Rest { baseline_ohm: &NEAR_CENTRE, outputs, status }, 0.02);
    let mut estimate = rest.clone();
    let mut scratch = [0.0; 4];
    let mut frame = NEAR_CENTRE;
    frame[0] *= 1.01;
    let gated = Frame { gate, ..Frame::from(&frame[..]) };
    decoder.decode_into(gated, &mut scratch, &mut estimate.borrowed()).unwrap();
    assert_eq!((&estimate.status[..], &estimate.outputs), (&[RowStatus::AtRest; 2][..], outputs));
    // A touch of the last row makes the first one be decoded too.
    frame[3] *= 1.03;
    let gated = Frame { gate, ..Frame::from(&frame[..]) };
    decoder.decode_into(gated, &mut scratch, &mut estimate.borrowed()).unwrap();
    assert_eq!(estimate, decoder.decode(&frame[..]).unwrap());
    assert_eq!(estimate.status, [RowStatus::Decoded; 2]);
}

/// A model of one row: four readings, two features, three outputs.
fn of_one_row(buffer: &mut [u8]) -> &[u8] {
    let projection = Projection::new(4, 2, &BLOCK).ok();
    let metadata = Metadata::unnamed(ModelShape { rows: 1, inputs: 4, outputs: 3 });
    let networks = &[network(3)];
    let parts = ModelParts {
        projection,
        expansion: None,
        confidence: None,
        fill: None,
        networks,
        row_network: &[0],
        metadata,
    };
    encode(&parts, buffer).unwrap()
}

#[test]
fn a_projection_may_have_another_number_of_features_than_a_row_has_readings() {
    let mut buffer = Aligned([0; 1024]);
    let decoder = Decoder::<1>::load(of_one_row(&mut buffer.0)).unwrap();
    assert_eq!(decoder.shape(), ModelShape { rows: 1, inputs: 4, outputs: 3 });
    assert_eq!(decoder.scratch_floats(), 4);
    let estimate = decoder.decode(&NEAR_CENTRE[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Decoded]);
    // As the array of two rows, and one output more.
    let activation = (-2.0_f32 * 0.0625).exp();
    let expected = [1.5 * activation - 0.5, 3.0 * activation - 1.0, 4.5 * activation];
    for (output, expected) in estimate.outputs.iter().zip(expected) {
        assert!((output - expected).abs() < 1e-6, "{output} {expected}");
    }
}

#[test]
fn the_number_of_features_stands_in_the_blob_and_is_checked() {
    let mut buffer = Aligned([0; 1024]);
    let length = of_one_row(&mut buffer.0).len();
    let floats: Vec<u8> = BLOCK.iter().flat_map(|value| value.to_le_bytes()).collect();
    let blob = &buffer.0[..length];
    let start = blob.windows(floats.len()).position(|window| window == floats).unwrap();
    // Before the floats stand the tag, the number of features, the padding and the floats' length.
    let tag = blob[..start].iter().rposition(|byte| *byte == 8).unwrap();
    assert_eq!(&blob[tag..tag + 2], [8, 2]);
    for (features, what) in [(1, "bytes of projection"), (3, "bytes of projection")] {
        let mut damaged = buffer;
        damaged.0[tag + 1] = features;
        let crc = CRC_32.checksum(&damaged.0[..length - 4]);
        damaged.0[length - 4..length].copy_from_slice(&crc.to_le_bytes());
        let refused = Model::decode(&damaged.0[..length]);
        let expected = usize::from(features) * 5 * 4;
        assert_eq!(refused, Err(DecodeError::CountMismatch { what, expected, found: 40 }));
    }
}

#[test]
fn what_cannot_stand_behind_a_projection_is_refused() {
    let mut buffer = Aligned([0; 1024]);
    let twice = encoded(&BLOCK, &[network(2), network(2)], &[0, 1], &mut buffer.0);
    let expected =
        DecodeError::CountMismatch { what: "networks behind a projection", expected: 1, found: 2 };
    assert_eq!(twice, Err(EncodeError::Refused(expected)));
    let uneven = encoded(&BLOCK, &[network(3)], &[0, 0], &mut buffer.0);
    assert_eq!(uneven, Err(EncodeError::UnevenRows { outputs: 3, rows: 2 }));
}

#[test]
fn every_changed_word_of_a_projection_is_told() {
    let mut buffer = Aligned([0; 1024]);
    let length = array(&mut buffer.0).len();
    let bytes: Vec<u8> = BLOCK.iter().flat_map(|value| value.to_le_bytes()).collect();
    let start = buffer.0.windows(bytes.len()).position(|window| window == bytes).unwrap();
    assert!(start.is_multiple_of(4));
    for word in 0..BLOCK.len() {
        let mut damaged = buffer;
        let place = start + 4 * word;
        damaged.0[place..place + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(matches!(Model::decode(&damaged.0[..length]), Err(DecodeError::Corrupt { .. })));
        // The CRC fits the damaged bytes.
        let crc = CRC_32.checksum(&damaged.0[..length - 4]);
        damaged.0[length - 4..length].copy_from_slice(&crc.to_le_bytes());
        let refused = Model::decode(&damaged.0[..length]);
        assert!(matches!(refused, Err(DecodeError::Projection { .. })), "{refused:?}");
    }
}

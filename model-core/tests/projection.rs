//! One network for the whole array, behind a projection: its blob, and how a decoder decodes with it.

use crate::common::{NEAR_CENTRE, PROJECTION, network};
use taxel_core::blob::{
    EncodeError, Front, Metadata, Model, ModelParts, ModelShape, encode, encoded_length_bound,
};
use taxel_core::projection::Projection;
use taxel_core::rbf::Network;
use taxel_core::{Aligned, Decoder, Estimate, Frame, RowStatus};

fn encoded<'b>(
    block: &[f32],
    networks: &[Network<'_>],
    row_network: &[u8],
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    let projection = Projection::new(4, 2, block).ok();
    let metadata = Metadata::unnamed(ModelShape { rows: 2, inputs: 2, outputs: 1 });
    let outputs = networks[0].shape().outputs;
    let fronts = vec![Front { outputs, touch: None, projection }; networks.len()];
    let parts = ModelParts { fronts: &fronts, ..ModelParts::new(networks, row_network, metadata) };
    assert!(encoded_length_bound(&parts) <= buffer.len());
    encode(&parts, buffer)
}

fn array(buffer: &mut [u8]) -> &[u8] {
    encoded(&PROJECTION, &[network(&[1.5, 3.0])], &[0, 0], buffer).unwrap()
}

#[test]
fn the_features_of_a_whole_frame_decide_all_rows() {
    let mut buffer = Aligned([0; 1024]);
    let blob = array(&mut buffer.0);
    let (decoder, model) = (Decoder::<2>::load(blob).unwrap(), Model::decode(blob).unwrap());
    let mut features = [0.0; 2];
    model.fronts().next().unwrap().projection.unwrap().project(&NEAR_CENTRE, &mut features);
    assert_eq!(features, [54.0, 5.0]);
    let activation = (-2.0_f32 * 0.0625).exp();
    let estimate = decoder.decode(&NEAR_CENTRE[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Decoded; 2]);
    let expected = [1.5 * activation - 0.5, 3.0 * activation - 1.0];
    for (outputs, expected) in estimate.outputs.iter().zip(expected) {
        assert!((outputs - expected).abs() < 1e-6, "{outputs:?} {expected}");
    }
}

fn clamps(decoder: &Decoder<'_, 2>, frame: [f32; 4]) -> bool {
    let (mut outputs, mut status) = ([0.0; 2], [RowStatus::MissingReading; 2]);
    let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
    decoder.decode_into(Frame::from(&frame[..]), &mut [f32::MAX; 4], &mut estimate).unwrap()
}

#[test]
fn features_are_clamped_and_not_readings() {
    let mut buffer = Aligned([0; 1024]);
    let decoder = Decoder::<2>::load(array(&mut buffer.0)).unwrap();
    let clamps = |frame: [f32; 4]| clamps(&decoder, frame);
    // In training the first feature was 50 to 58, and the second 5 to 15.
    assert!(!clamps(NEAR_CENTRE));
    assert!(!clamps([8.0, 100.0, 100.0, 8.0])); // far readings, but a usual mean
    assert!(clamps([60.0, 60.0, 60.0, 60.0]));
    assert!(clamps([10.0, 10.0, 90.0, 90.0])); // a usual mean
    assert!(clamps([10.0, 10.0, 200.0, 200.0]));
    assert!(!clamps([f32::NAN, 10.0, 90.0, 90.0]));
}

#[test]
fn a_frame_is_clamped_where_one_of_its_networks_is() {
    const NEVER: [f32; 10] = [54.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for blocks in [[PROJECTION, NEVER], [NEVER, PROJECTION]] {
        let fronts = blocks.each_ref().map(|block| Front {
            outputs: 1,
            touch: None,
            projection: Projection::new(4, 2, block).ok(),
        });
        let networks = [network(&[1.5]), network(&[3.0])];
        let metadata = Metadata::unnamed(ModelShape { rows: 2, inputs: 2, outputs: 1 });
        let mut buffer = Aligned([0; 1024]);
        let parts = ModelParts { fronts: &fronts, ..ModelParts::new(&networks, &[0, 1], metadata) };
        let decoder = Decoder::<2>::load(encode(&parts, &mut buffer.0).unwrap()).unwrap();
        assert!(!clamps(&decoder, NEAR_CENTRE) && clamps(&decoder, [60.0; 4]));
    }
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
    let block = PROJECTION.map(|part| 2.0 * part);
    let blob = encoded(&block, &[network(&[1.5, 3.0])], &[0, 0], &mut buffer.0).unwrap();
    let decoder = Decoder::<2>::load(blob).unwrap();
    let frame = [f32::MAX, f32::MAX, -f32::MAX, -f32::MAX];
    let estimate = decoder.decode(&frame[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Overflow; 2]);
    assert!(estimate.outputs.iter().all(|output| output.is_nan()));
}

/// A model of one row: four readings, two features, three outputs.
pub fn of_one_row(buffer: &mut [u8]) -> &[u8] {
    let projection = Projection::new(4, 2, &PROJECTION).ok();
    let metadata = Metadata::unnamed(ModelShape { rows: 1, inputs: 4, outputs: 3 });
    let networks = &[network(&[1.5, 3.0, 4.5])];
    let fronts = &[Front { outputs: 3, touch: None, projection }];
    let parts = ModelParts { fronts, ..ModelParts::new(networks, &[0], metadata) };
    encode(&parts, buffer).unwrap()
}

#[test]
fn outputs_that_do_not_divide_among_the_rows_are_refused() {
    let mut buffer = Aligned([0; 1024]);
    let uneven = encoded(&PROJECTION, &[network(&[1.5, 3.0, 4.5])], &[0, 0], &mut buffer.0);
    assert_eq!(uneven, Err(EncodeError::UnevenRows { outputs: 3, rows: 2 }));
}

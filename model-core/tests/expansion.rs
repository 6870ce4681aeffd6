//! Expansion of a network's few components to the outputs of all rows: its section of the blob, and how a decoder
//! decodes with it.

use crate::common::{seal, worked_bytes};
use model_core::blob::{
    DecodeError, EncodeError, Metadata, Model, ModelParts, ModelShape, encode, encoded_length_bound,
};
use model_core::expansion::Expansion;
use model_core::projection::Projection;
use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{Network, NetworkError, Shape};
use model_core::{Aligned, Decoder, RowStatus};
use proptest::prelude::*;

/// A projection block: the first feature is the mean of the four readings, the second the difference of the rows.
const PROJECTION: [f32; 10] = [0.0, 10.0, 0.25, 0.25, 0.25, 0.25, 0.25, -0.25, 0.25, -0.25];
/// Means of the two outputs, then the part of the one component in each.
const EXPANSION: [f32; 4] = [0.25, -1.0, 1.0, 0.5];
/// A frame at the network's centre in the first feature, and a quarter of the span from it in the second.
const NEAR_CENTRE: [f32; 4] = [48.0, 50.0, 60.0, 58.0];

fn network(outputs: usize, weight: f32) -> Network<'static> {
    let parameters = Parameters {
        input_minimum: &[50.0, 5.0],
        input_per_span: &[0.125, 0.1],
        centres: &[0.5, 0.25],
        decay: &[2.0],
        output_weights: if weight > 2.0 { &[1e30, 1e30] } else { &[1.5, 3.0] }
            .get(..outputs)
            .unwrap(),
        bias: &[-0.5, -1.0][..outputs],
        affine: &[],
    };
    direct::Network::try_new(Shape { inputs: 2, centres: 1, outputs }, parameters).unwrap().into()
}

fn encoded<'b>(
    projection: Option<Projection<'_>>,
    (components, outputs, block): (usize, usize, &[f32]),
    network: Network<'_>,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    let expansion = Some(Expansion::new(components, outputs, block).unwrap());
    let metadata = Metadata::unnamed(ModelShape { rows: 2, inputs: 2, outputs: 1 });
    let networks = &[network];
    let parts = ModelParts {
        projection,
        expansion,
        confidence: None,
        fill: None,
        networks,
        row_network: &[0, 0],
        metadata,
    };
    assert!(encoded_length_bound(&parts) <= buffer.len());
    encode(&parts, buffer)
}

fn small(buffer: &mut [u8]) -> &[u8] {
    let projection = Projection::new(4, 2, &PROJECTION).ok();
    encoded(projection, (1, 2, &EXPANSION), network(1, 1.5), buffer).unwrap()
}

/// Where the section starts.
fn section(blob: &[u8]) -> usize {
    let floats: Vec<u8> = EXPANSION.iter().flat_map(|value| value.to_le_bytes()).collect();
    let start = blob.windows(floats.len()).position(|window| window == floats).unwrap();
    assert!(start.is_multiple_of(4));
    blob[..start].windows(2).rposition(|window| window == [6, 1]).unwrap()
}

#[test]
fn all_outputs_are_means_and_parts_of_the_networks_components() {
    let mut buffer = Aligned([0; 1024]);
    let blob = small(&mut buffer.0);
    let (decoder, model) = (Decoder::<2>::load(blob).unwrap(), Model::decode(blob).unwrap());
    assert_eq!(model.expansion().unwrap().block(), EXPANSION);
    assert_eq!(model.networks().next().unwrap().shape().outputs, 1);
    assert_eq!((decoder.scratch_floats(), decoder.shape().outputs), (5, 1));
    let component = 1.5 * (-2.0_f32 * 0.0625).exp() - 0.5;
    let estimate = decoder.decode(&NEAR_CENTRE[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Decoded; 2]);
    let expected = [0.25 + component, -1.0 + 0.5 * component];
    for (outputs, expected) in estimate.outputs.iter().zip(expected) {
        assert!((outputs - expected).abs() < 1e-6, "{outputs:?} {expected}");
    }
}

#[test]
fn one_missing_reading_leaves_no_row_to_decode() {
    let mut buffer = Aligned([0; 1024]);
    let decoder = Decoder::<2>::load(small(&mut buffer.0)).unwrap();
    let mut frame = NEAR_CENTRE;
    frame[2] = f32::NAN;
    let estimate = decoder.decode(&frame[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::MissingReading; 2]);
    assert!(estimate.outputs.iter().all(|output| output.to_bits() == f32::NAN.to_bits()));
}

#[test]
fn what_cannot_stand_together_is_refused_when_written() {
    let mut buffer = Aligned([0; 1024]);
    let (projection, one) = (Projection::new(4, 2, &PROJECTION).ok(), network(1, 1.5));
    let without = encoded(None, (1, 2, &EXPANSION), one, &mut buffer.0);
    assert_eq!(without, Err(EncodeError::ExpansionWithoutProjection));
    let unfit = encoded(projection, (1, 2, &EXPANSION), network(2, 1.5), &mut buffer.0);
    assert_eq!(unfit, Err(EncodeError::UnfitExpansion { outputs: 2, components: 1 }));
    let uneven = encoded(projection, (1, 3, &[0.0; 6]), one, &mut buffer.0);
    assert_eq!(uneven, Err(EncodeError::UnevenRows { outputs: 3, rows: 2 }));
    // The one component may be 1e30.
    let beyond =
        encoded(projection, (1, 2, &[0.0, 0.0, 1e9, 0.0]), network(1, 1e30), &mut buffer.0);
    let cause = NetworkError::NotFinite { what: "the largest output" };
    assert_eq!(beyond, Err(EncodeError::Refused(DecodeError::Expansion { cause })));
}

#[test]
fn every_damage_of_the_section_has_its_own_error() {
    let mut buffer = Aligned([0; 1024]);
    let length = small(&mut buffer.0).len();
    let (start, floats) = (section(&buffer.0), EXPANSION[0].to_le_bytes());
    let first = buffer.0[start..].windows(4).position(|window| window == floats).unwrap();
    let damaged = |place: usize, byte: u8| {
        let mut damaged = buffer;
        damaged.0[start + place] = byte;
        assert!(matches!(Model::decode(&damaged.0[..length]), Err(DecodeError::Corrupt { .. })));
        seal(&mut damaged.0[..length]);
        Model::decode(&damaged.0[..length]).map(drop).unwrap_err()
    };
    // With any other tag these are no fields of a network, whose section must follow.
    for tag in [0, 1, 3, 4, 5, 8, 0xff] {
        assert_eq!(damaged(0, tag), DecodeError::Malformed { section: "network section" });
    }
    let count = |expected, found| DecodeError::CountMismatch {
        what: "bytes of expansion",
        expected,
        found,
    };
    // 0 components need the means alone, 2 another eight bytes.
    assert_eq!(damaged(1, 0), count(8, 16));
    assert_eq!(damaged(1, 2), count(24, 16));
    assert_eq!(damaged(first - 1, 15), count(16, 15));
    assert_eq!(damaged(2, 4), DecodeError::Malformed { section: "padding" });
    // NaN or an infinity, in each number.
    for number in 0..EXPANSION.len() {
        let mut damaged = buffer;
        let place = start + first + 4 * number;
        damaged.0[place..place + 4].copy_from_slice(&f32::NEG_INFINITY.to_le_bytes());
        seal(&mut damaged.0[..length]);
        let cause = NetworkError::NotFinite { what: "expansion" };
        let refused = Model::decode(&damaged.0[..length]).map(drop);
        assert_eq!(refused, Err(DecodeError::Expansion { cause }), "number {number}");
    }
    // 3e38 is a number, but outputs would leave f32.
    let mut damaged = buffer;
    damaged.0[start + first + 8..][..4].copy_from_slice(&3e38_f32.to_le_bytes());
    seal(&mut damaged.0[..length]);
    let cause = NetworkError::NotFinite { what: "the largest output" };
    let refused = Model::decode(&damaged.0[..length]).map(drop);
    assert_eq!(refused, Err(DecodeError::Expansion { cause }));
}

#[test]
fn a_blob_that_is_cut_off_is_refused_wherever_it_ends() {
    let mut buffer = Aligned([0; 1024]);
    let length = small(&mut buffer.0).len();
    for end in 0..length {
        assert!(Model::decode(&buffer.0[..end]).is_err(), "{end} of {length} bytes");
    }
}

#[test]
fn the_section_has_the_specifications_worked_bytes() {
    let mut buffer = Aligned([0; 1024]);
    let length = small(&mut buffer.0).len();
    let bytes = worked_bytes("worked expansion");
    let start = section(&buffer.0[..length]);
    assert_eq!(buffer.0[start..start + bytes.len()], bytes);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]
    /// Parsing ends for any bytes under a valid CRC. What an accepted model decodes is finite, or marked.
    #[test]
    fn hostile_bytes_under_a_valid_crc_never_panic(
        changes in prop::collection::vec((9_usize..500, any::<u8>()), 1..6),
        frame in prop::array::uniform4(any::<f32>()),
    ) {
        let mut buffer = Aligned([0; 1024]);
        let length = small(&mut buffer.0).len();
        for (offset, byte) in changes {
            buffer.0[9 + offset % (length - 4 - 9)] = byte;
        }
        seal(&mut buffer.0[..length]);
        let Ok(decoder) = Decoder::<2>::load(&buffer.0[..length]) else { return Ok(()) };
        let Ok(estimate) = decoder.decode(&frame[..]) else { return Ok(()) };
        for (output, status) in estimate.outputs.iter().zip(&estimate.status) {
            prop_assert_eq!(output.is_finite(), *status == RowStatus::Decoded);
        }
    }
}

//! Expansion of a network's few components to the outputs of all rows: how a decoder decodes with it.

use crate::common::{NEAR_CENTRE, PROJECTION, network};
use taxel_core::blob::{
    DecodeError, EncodeError, Metadata, Model, ModelParts, ModelShape, encode, encoded_length_bound,
};
use taxel_core::expansion::Expansion;
use taxel_core::projection::Projection;
use taxel_core::rbf::{Network, NetworkError};
use taxel_core::{Aligned, Decoder, RowStatus};

/// Means of the two outputs, then the part of the one component in each.
pub const EXPANSION: [f32; 4] = [0.25, -1.0, 1.0, 0.5];

fn encoded<'b>(
    projection: Option<Projection<'_>>,
    (components, outputs, block): (usize, usize, &[f32]),
    network: Network<'_>,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    let expansion = Some(Expansion::new(components, outputs, block).unwrap());
    let metadata = Metadata::unnamed(ModelShape { rows: 2, inputs: 2, outputs: 1 });
    let networks = &[network];
    let parts =
        ModelParts { projection, expansion, ..ModelParts::new(networks, &[0, 0], metadata) };
    assert!(encoded_length_bound(&parts) <= buffer.len());
    encode(&parts, buffer)
}

pub fn small(buffer: &mut [u8]) -> &[u8] {
    let projection = Projection::new(4, 2, &PROJECTION).ok();
    encoded(projection, (1, 2, &EXPANSION), network(&[1.5]), buffer).unwrap()
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
    let (projection, one) = (Projection::new(4, 2, &PROJECTION).ok(), network(&[1.5]));
    let without = encoded(None, (1, 2, &EXPANSION), one, &mut buffer.0);
    assert_eq!(without, Err(EncodeError::ExpansionWithoutProjection));
    let unfit = encoded(projection, (1, 2, &EXPANSION), network(&[1.5, 3.0]), &mut buffer.0);
    assert_eq!(unfit, Err(EncodeError::UnfitExpansion { outputs: 2, components: 1 }));
    let uneven = encoded(projection, (1, 3, &[0.0; 6]), one, &mut buffer.0);
    assert_eq!(uneven, Err(EncodeError::UnevenRows { outputs: 3, rows: 2 }));
    // The one component may be 1e30.
    let beyond =
        encoded(projection, (1, 2, &[0.0, 0.0, 1e9, 0.0]), network(&[1e30]), &mut buffer.0);
    let cause = NetworkError::NotFinite { what: "the largest output" };
    assert_eq!(beyond, Err(EncodeError::Refused(DecodeError::Expansion { cause })));
}

//! The blob format, compared with its specification in `docs/blob.md` and its examples in `testdata/blob-examples.txt`.

use crate::common::{close_with_crc, worked_bytes};
use taxel_core::blob::{
    Columns, DecodeError, EncodeError, Floats, Metadata, Model, ModelParts, NoiseKind, encode,
    encoded_length_bound,
};
use taxel_core::rbf::float32::{self, Parameters};
use taxel_core::rbf::{Network, Shape};
use taxel_core::{Aligned, AlignedBytes, Decoder, RowStatus};

fn parameters() -> Parameters<'static> {
    Parameters {
        input_minimum: &[50.0, 60.0],
        input_per_span: &[0.125, 0.0625],
        centres: &[0.5, 0.25],
        decay: &[2.0],
        output_weights: &[1.5],
        bias: &[-0.5],
        affine: &[],
    }
}

fn network_of(parameters: Parameters<'_>) -> Network<'_> {
    float32::Network::try_new(Shape { inputs: 2, centres: 1, outputs: 1 }, parameters)
        .unwrap()
        .into()
}

fn network() -> Network<'static> {
    network_of(parameters())
}

fn metadata() -> Metadata<'static> {
    Metadata {
        name: "pair",
        scene_digest: 300,
        noise_kind: NoiseKind::Relative,
        noise_level: 1.0 / 128.0,
        seed: 7,
        training_frames: 1000,
        thickness_mm: 5.0,
        relative_inputs: false,
        input_names: Columns("r1c1_ohm\nr1c2_ohm\nr2c1_ohm\nr2c2_ohm"),
        input_units: Columns("Ω\nΩ\nΩ\nΩ"),
        output_names: Columns("r1e1_dz_mm\nr2e1_dz_mm"),
        output_units: Columns("mm\nmm"),
        training_rmse: Floats(&[0, 0, 0x80, 0x3d, 0, 0, 0x80, 0x3d]), // 0.0625 twice
        full_scale: Floats(&[0, 0, 0x80, 0x3f, 0, 0, 0x80, 0x3f]),    // 1 twice
    }
}

/// A blob of two mirrored rows that share one network.
pub fn small_model(buffer: &mut [u8]) -> &[u8] {
    let networks = [network()];
    encode(&ModelParts::new(&networks, &[0, 0], metadata()), buffer).unwrap()
}

#[test]
fn encoding_gives_the_specifications_worked_bytes() {
    let mut buffer = Aligned([0; 512]);
    let encoded = small_model(&mut buffer.0);
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ");
    assert_eq!(hex(encoded), hex(&worked_bytes("worked example")));
}

/// One byte tells that inputs are relative; all other bytes keep their values.
#[test]
fn relative_inputs_are_a_section_of_one_byte_before_all_others() {
    let (mut plain, mut relative) = (Aligned([0; 512]), Aligned([0; 512]));
    let networks = [network()];
    let metadata = Metadata { relative_inputs: true, ..metadata() };
    let parts = ModelParts::new(&networks, &[0, 0], metadata);
    let blob = encode(&parts, &mut relative.0).unwrap();
    let model = Model::decode(blob).unwrap();
    assert_eq!(*model.metadata(), metadata);
    assert_eq!(model.networks().collect::<Vec<_>>(), [network()]);
    assert_eq!((model.network_of_row(1), model.network_of_row(2)), (Some(0), None));
    // The metadata end at 130. Three bytes of padding let the floats begin at 140 instead of 136.
    let plain = small_model(&mut plain.0);
    assert_eq!((blob.len(), blob[130], blob[135]), (plain.len() + 4, 3, 3));
    assert_eq!((&blob[131..135], &blob[139..176]), (&plain[130..134], &plain[135..172]));
}

#[test]
fn the_linear_decoders_errors_are_a_section_before_the_networks() {
    let (mut plain, mut buffer) = (Aligned([0; 512]), Aligned([0; 512]));
    let networks = [network()];
    let rmse = [0, 0, 0, 0x3e, 0, 0, 0x40, 0x3e]; // 0.125, 0.1875
    let without = ModelParts::new(&networks, &[0, 0], metadata());
    let parts = ModelParts { linear_rmse: Floats(&rmse), ..without };
    let blob = encode(&parts, &mut buffer.0).unwrap();
    assert!(blob.len() <= encoded_length_bound(&parts));
    let model = Model::decode(blob).unwrap();
    assert_eq!(model.linear_rmse().iter().collect::<Vec<_>>(), [0.125, 0.1875]);
    assert_eq!(model.networks().collect::<Vec<_>>(), [network()]);
    // Tag and length; the errors; then the network's section, as without them.
    let plain = small_model(&mut plain.0);
    assert_eq!((&blob[130..132], &blob[132..140]), (&[6, 8][..], &rmse[..]));
    assert_eq!(&blob[140..144], &plain[130..134]);

    let mut refused = |rmse: &[u8]| {
        let parts = ModelParts { linear_rmse: Floats(rmse), ..without };
        encode(&parts, &mut buffer.0).unwrap_err()
    };
    let what = "bytes of linear errors";
    let short = DecodeError::CountMismatch { what, expected: 8, found: 4 };
    assert_eq!(refused(&rmse[..4]), EncodeError::Refused(short));
    let negative = DecodeError::InvalidMetadata { field: "linear error" };
    assert_eq!(refused(&[0, 0, 0, 0xbe, 0, 0, 0x40, 0x3e]), EncodeError::Refused(negative));
}

#[test]
fn readings_that_overflow_are_told_from_missing_ones() {
    let mut buffer = Aligned([0; 512]);
    let parameters = Parameters {
        input_minimum: &[-3e38, 60.0],
        input_per_span: &[0.0, 0.0625],
        ..parameters()
    };
    let networks = [network_of(parameters)];
    let parts = ModelParts::new(&networks, &[0, 0], metadata());
    let blob = encode(&parts, &mut buffer.0).unwrap();
    let decoder = Decoder::<2>::load(blob).unwrap();
    let frame = [3e38, 64.0, 54.0, 64.0];
    let estimate = decoder.decode(&frame[..]).unwrap();
    assert_eq!(estimate.status, [RowStatus::Overflow, RowStatus::Decoded]);
    assert!(estimate.outputs[0].is_nan() && estimate.outputs[1].is_finite());
}

#[test]
fn bytes_left_over_behind_the_networks_are_refused() {
    let mut buffer = Aligned([0; 512]);
    let length = small_model(&mut buffer.0).len();
    let longer = &mut buffer.0[..length + 4];
    longer[length - 4..].fill(0);
    let at = longer.windows(4).position(|bytes| bytes == (length as u32).to_le_bytes()).unwrap();
    longer[at..at + 4].copy_from_slice(&(length as u32 + 4).to_le_bytes());
    close_with_crc(longer);
    assert_eq!(Model::decode(longer).unwrap_err(), DecodeError::LeftOver { bytes: 4 });
}

/// The blob of the page, and one that was trained.
fn blobs() -> [AlignedBytes; 2] {
    let mut buffer = Aligned([0; 512]);
    let trained = include_bytes!("../../testdata/row4.bin");
    [small_model(&mut buffer.0), trained].map(AlignedBytes::copy_of)
}

#[test]
fn every_single_bit_flip_is_refused_with_its_error() {
    for mut blob in blobs() {
        assert!(Model::decode(&blob).is_ok());
        for (offset, bit) in (0..blob.len()).flat_map(|offset| (0..8).map(move |bit| (offset, bit)))
        {
            blob[offset] ^= 1 << bit;
            let refused = Model::decode(&blob).unwrap_err();
            let as_expected = match offset {
                0..4 => matches!(refused, DecodeError::BadMagic),
                4 => matches!(refused, DecodeError::UnsupportedVersion { .. }),
                5..9 => matches!(
                    refused,
                    DecodeError::Truncated { .. } | DecodeError::TrailingBytes { .. }
                ),
                _ => matches!(refused, DecodeError::Corrupt { .. }),
            };
            assert!(as_expected, "byte {offset} bit {bit}: {refused}");
            blob[offset] ^= 1 << bit;
        }
    }
}

#[test]
fn every_truncation_and_any_trailing_byte_is_refused() {
    for blob in blobs() {
        for found in 0..blob.len() {
            let expected = if found < 9 { 13 } else { blob.len() };
            let refused = Model::decode(&blob[..found]).unwrap_err();
            assert_eq!(refused, DecodeError::Truncated { expected, found });
        }
        let shifted = AlignedBytes::copy_of(&[&[0], &blob[..]].concat());
        assert!(matches!(Model::decode(&shifted[1..]), Err(DecodeError::Misaligned)));
        let longer = AlignedBytes::copy_of(&[&blob[..], &[0]].concat());
        assert!(matches!(Model::decode(&longer), Err(DecodeError::TrailingBytes { .. })));
    }
}

#[test]
fn misordered_sections_and_bad_metadata_are_refused() {
    let [blob, _] = blobs();
    let refused = |offset: usize, bytes: &[u8]| {
        let mut blob = blob.clone();
        blob[offset..offset + bytes.len()].copy_from_slice(bytes);
        close_with_crc(&mut blob);
        Model::decode(&blob).unwrap_err()
    };
    // Rows, inputs, outputs and networks are one byte each, at 9 to 12; then the map of the rows, and the metadata.
    assert_eq!(blob[9..17], [2, 2, 1, 1, 2, 0, 0, 0]);
    assert_eq!(refused(15, &[2]), DecodeError::UnknownNetwork { row: 1, network: 2, networks: 1 });
    assert_eq!(refused(16, &[9]), DecodeError::SectionOrder { expected: 0, found: 9 });
    // The network's section: its tag, and its number.
    assert_eq!(refused(131, &[3]), DecodeError::NetworkOrder { expected: 0, found: 3 });
    let rmse = [0, 0, 0x80, 0x3d, 0, 0, 0x80, 0x3d];
    let rmse = blob.windows(8).position(|bytes| bytes == rmse).unwrap();
    let field = "training error";
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        assert_eq!(refused(rmse, &value.to_le_bytes()), DecodeError::InvalidMetadata { field });
    }
}

#[test]
fn a_slot_larger_than_its_blob_tells_the_blobs_length() {
    let mut buffer = Aligned([0xff; 512]);
    let length = small_model(&mut buffer.0).len();
    assert_eq!(Model::declared_length(&buffer.0), Some(length));
    assert_eq!(Model::declared_length(&[0xff; 512]), None);
    assert_eq!(Model::declared_length(&buffer.0[..8]), None);
}

#[test]
fn what_does_not_fit_the_format_is_refused_when_written() {
    let networks = [network()];
    let parts = ModelParts::new(&networks, &[0, 0], metadata());
    let mut buffer = Aligned([0; 512]);
    let length = encode(&parts, &mut buffer.0).unwrap().len();
    assert!(length <= encoded_length_bound(&parts));
    for short in 0..length {
        assert_eq!(encode(&parts, &mut buffer.0[..short]), Err(EncodeError::BufferTooSmall));
    }
    let no_such = ModelParts { row_network: &[0, 1], ..parts };
    assert_eq!(
        encode(&no_such, &mut buffer.0),
        Err(EncodeError::Refused(DecodeError::UnknownNetwork { row: 1, network: 1, networks: 1 }))
    );
    let many_rows = [0; 256];
    let too_many = ModelParts { row_network: &many_rows, ..parts };
    assert_eq!(
        encode(&too_many, &mut buffer.0),
        Err(EncodeError::TooLarge { what: "number of rows", value: 256, most: 255 })
    );
}

//! A real, trained blob, damaged in every way there is: each damage is rejected with a specific error.

use taxel_core::blob::{DecodeError, Model};
use taxel_core::rbf::{Format, Network};
use taxel_core::{AlignedBytes, Decoder};
use taxel_data::{Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, pack};
use taxel_simulate::outputs::{ElectrodeOutputs, Quantity};
use taxel_simulate::sensor::Axis;
use taxel_simulate::{World, synthesise};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

fn world() -> World {
    let outputs = ElectrodeOutputs { quantity: Quantity::Deformation, axes: vec![Axis::Z] };
    World { outputs: outputs.into(), read_rows: vec![3, 4], ..World::press() }
}

/// Blob of a model trained on `press`: two rows, 18 readings to 6 outputs, K = 8.
fn real_blob() -> Vec<u8> {
    let dataset = synthesise(&world(), Stream::Training, 400);
    let options = Options { format: Format::F32, centres: 8, ..Options::of_rows() };
    let trained = train(&dataset, &options, &Silent).unwrap();
    let origin = Origin::of_data("press", 0, 1, &dataset);
    pack(&trained, &dataset, &origin).unwrap().bytes().to_vec()
}

/// Blob of one network for both rows, which computes their 12 outputs.
fn blob_of_array(format: Format) -> Vec<u8> {
    let dataset = synthesise(&world(), Stream::Training, 400);
    let options =
        Options { format, centres: 8, spread: 0.6, each_row: false, ..Options::of_rows() };
    let trained = train(&dataset, &options, &Silent).unwrap();
    let origin = Origin::of_data("press", 0, 1, &dataset);
    pack(&trained, &dataset, &origin).unwrap().bytes().to_vec()
}

/// Calls `use_them` with a copy of `bytes` at an address that is a multiple of four.
fn with_aligned<R>(bytes: &[u8], use_them: impl FnOnce(&[u8]) -> R) -> R {
    use_them(&AlignedBytes::copy_of(bytes))
}

fn refusal(bytes: &[u8]) -> Option<DecodeError> {
    with_aligned(bytes, |bytes| Model::decode(bytes).err())
}

/// Renews length and CRC, as someone who writes a bad blob on purpose would.
fn sealed(mut blob: Vec<u8>) -> Vec<u8> {
    let length = u32::try_from(blob.len()).unwrap();
    blob[5..9].copy_from_slice(&length.to_le_bytes());
    let body = blob.len() - 4;
    let crc = CRC.checksum(&blob[..body]);
    blob[body..].copy_from_slice(&crc.to_le_bytes());
    blob
}

/// Byte offset in the blob of the part that `pick` borrows from it.
fn offset_of(blob: &[u8], pick: impl for<'a> Fn(&Model<'a>) -> &'a [u8]) -> usize {
    with_aligned(blob, |bytes| {
        let model = Model::decode(bytes).unwrap();
        pick(&model).as_ptr() as usize - bytes.as_ptr() as usize
    })
}

fn changed(blob: &[u8], offset: usize, bytes: &[u8]) -> Vec<u8> {
    let mut blob = blob.to_vec();
    blob[offset..offset + bytes.len()].copy_from_slice(bytes);
    sealed(blob)
}

#[test]
fn every_single_bit_flip_is_refused_with_its_error() {
    each_bit_flip_is_refused(real_blob());
    each_bit_flip_is_refused(blob_of_array(Format::Fixed16));
}

fn each_bit_flip_is_refused(mut blob: Vec<u8>) {
    assert_eq!(refusal(&blob), None);
    for offset in 0..blob.len() {
        for bit in 0..8 {
            blob[offset] ^= 1 << bit;
            let refused = refusal(&blob).unwrap_or_else(|| panic!("byte {offset} bit {bit}"));
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
    each_truncation_and_trailing_byte_is_refused(&real_blob());
    each_truncation_and_trailing_byte_is_refused(&blob_of_array(Format::Fixed16));
}

fn each_truncation_and_trailing_byte_is_refused(blob: &[u8]) {
    for length in 0..blob.len() {
        let refused = refusal(&blob[..length]);
        let expected = if length < 9 { 13 } else { blob.len() };
        assert_eq!(refused, Some(DecodeError::Truncated { expected, found: length }));
    }
    for extra in [1, 2, 3, 4, 100] {
        for filler in [0_u8, 0xff] {
            let mut longer = blob.to_vec();
            longer.resize(blob.len() + extra, filler);
            assert_eq!(refusal(&longer), Some(DecodeError::TrailingBytes { extra }));
        }
    }
}

#[test]
fn inconsistent_structure_and_bad_numbers_under_a_valid_crc_are_refused() {
    let blob = real_blob();
    // Shape: rows, inputs, outputs and networks are one byte each, at 9 to 12; then the map.
    assert_eq!(blob[9..16], [2, 18, 6, 2, 2, 0, 1]);
    let refused = |offset, byte| refusal(&changed(&blob, offset, &[byte])).unwrap();
    for (offset, value) in [(9, 3), (10, 17), (11, 7), (14 - 1, 1)] {
        let refused = refused(offset, value);
        let mismatch = matches!(
            refused,
            DecodeError::CountMismatch { .. }
                | DecodeError::Malformed { .. }
                | DecodeError::SectionOrder { .. }
        );
        assert!(mismatch, "byte {offset}: {refused}");
    }
    assert_eq!(refused(15, 2), DecodeError::UnknownNetwork { row: 1, network: 2, networks: 2 });
    assert_eq!(refused(16, 9), DecodeError::SectionOrder { expected: 0, found: 9 });

    // A network section: tag, index, centres, affine; then padding and floats.
    let floats = offset_of(&blob, |model| {
        let network = model.networks().nth(1).unwrap();
        let Network::F32(network) = network else { panic!("{network:?}") };
        bytemuck::cast_slice(network.parameters().input_minimum)
    });
    let header = (0..floats).rev().find(|i| blob[*i..*i + 4] == [1, 1, 8, 1]).unwrap();
    assert_eq!(refused(header, 7), DecodeError::SectionOrder { expected: 1, found: 7 });
    assert_eq!(refused(header + 1, 0), DecodeError::NetworkOrder { expected: 1, found: 0 });
    assert!(matches!(refused(header + 2, 9), DecodeError::CountMismatch { .. }));

    for (field, offset) in [
        ("training error", offset_of(&blob, |m| m.metadata().training_rmse.0)),
        ("full scale", offset_of(&blob, |m| m.metadata().full_scale.0)),
    ] {
        for value in [f32::NAN, f32::INFINITY, -1.0] {
            let refused = refusal(&changed(&blob, offset, &value.to_le_bytes()));
            assert_eq!(refused, Some(DecodeError::InvalidMetadata { field }));
        }
    }
}

/// The device's entry point and the host's give the same bits.
#[test]
fn device_and_host_decode_alike() {
    decodes_alike(&real_blob());
    Format::ALL.into_iter().for_each(|format| decodes_alike(&blob_of_array(format)));
}

fn decodes_alike(blob: &[u8]) {
    let loaded = ModelBlob::of_bytes(blob).unwrap();
    let test = synthesise(&world(), Stream::Test, 500);
    let host = loaded.prepare().decode_table(&test.inputs);
    with_aligned(blob, |bytes| {
        let decoder = Decoder::<2>::load(bytes).unwrap();
        for (readings, expected) in test.inputs.lines().zip(host.lines()) {
            let frame: Vec<f32> = readings.iter().map(|reading| *reading as f32).collect();
            let estimate = decoder.decode(&frame[..]).unwrap();
            for (y, expected) in estimate.outputs.iter().zip(expected) {
                assert_eq!(f64::from(*y).to_bits(), expected.to_bits());
            }
        }
    });
}

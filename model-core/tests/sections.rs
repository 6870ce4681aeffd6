//! Sections of the blob that a model may have besides its networks: their bytes, and what damage of them is called.

use crate::common::{PROJECTION, close_with_crc, worked_bytes};
use crate::{blob_format, projection, reading_model, touch};
use proptest::prelude::*;
use taxel_core::blob::{DecodeError, Model};
use taxel_core::rbf::{Network, NetworkError};
use taxel_core::{Aligned, AlignedBytes, Decoder, Frame, RowStatus};

/// A blob with such a section: where it starts, and where its numbers do.
struct Sample {
    blob: AlignedBytes,
    start: usize,
    floats: usize,
}

/// A blob whose section has this `header`, padding, and the numbers of `block`.
fn sample(blob: &[u8], header: &[u8], block: &[f32]) -> Sample {
    let bytes: Vec<u8> = block.iter().flat_map(|value| value.to_le_bytes()).collect();
    let floats = blob.windows(bytes.len()).position(|window| window == bytes).unwrap();
    assert!(floats.is_multiple_of(4));
    let start = blob[..floats].windows(header.len()).rposition(|it| it == header).unwrap();
    Sample { blob: AlignedBytes::copy_of(blob), start, floats }
}

/// A front of a projection, a reading model, and a front of a touch before two other networks.
fn samples() -> [Sample; 3] {
    let mut buffer = Aligned([0; 1024]);
    let of_projection = sample(projection::of_one_row(&mut buffer.0), &[4, 3, 0, 2], &PROJECTION);
    let blob = reading_model::blob(false, reading_model::full());
    let of_readings = sample(&blob, &[8, 1, 1], &reading_model::BLOCK);
    let block = [&touch::TOUCH[..], &touch::CENTROID].concat();
    let of_touch = sample(&touch::three(-1.0, false), &[4, 1, 1, 2], &block);
    [of_projection, of_readings, of_touch]
}

impl Sample {
    /// Error for other `bytes` at a `place`, under a CRC that fits them. Under the former CRC they are corrupt.
    fn damaged(&self, place: usize, bytes: &[u8]) -> DecodeError {
        let mut blob = self.blob.clone();
        blob[place..place + bytes.len()].copy_from_slice(bytes);
        assert!(matches!(Model::decode(&blob), Err(DecodeError::Corrupt { .. })));
        close_with_crc(&mut blob);
        Model::decode(&blob).map(drop).unwrap_err()
    }

    /// Error for another value of number `number`.
    fn with(&self, number: usize, value: f32) -> DecodeError {
        self.damaged(self.floats + 4 * number, &value.to_le_bytes())
    }
}

#[test]
fn a_reading_model_has_the_specifications_worked_bytes() {
    let [_, readings, _] = samples();
    let bytes = worked_bytes("worked reading model");
    assert_eq!(readings.blob[readings.start..][..bytes.len()], bytes);
}

#[test]
fn every_damage_of_a_section_has_its_own_error() {
    let [projection, readings, touch] = samples();
    let count = |what, expected, found| DecodeError::CountMismatch { what, expected, found };
    let malformed = |section| DecodeError::Malformed { section };
    let of_readings = |expected, found| count("bytes of the reading model", expected, found);
    for (sample, place, byte, error) in [
        (&projection, 3, 1, count("bytes of a front", 20, 40)),
        (&projection, 3, 3, count("bytes of a front", 60, 40)),
        (&projection, 2, 3, malformed("front section")),
        (&touch, 2, 0, count("bytes of a front", 40, 100)),
        (&touch, 3, 0, count("bytes of a front", 52, 100)),
        (&touch, 1, 2, count("bytes of weights", 60, 44)),
        (&readings, readings.floats - readings.start - 1, 99, of_readings(100, 99)),
        // A factor more takes 4·(1 + 4 + 1 + 5) bytes; a component more 4·(1 + 2 + 4 + 2).
        (&readings, 1, 2, of_readings(144, 100)),
        (&readings, 2, 2, of_readings(136, 100)),
        (&readings, 2, 0, of_readings(52, 100)),
        (&readings, 4, 1, malformed("padding")),
    ] {
        assert_eq!(sample.damaged(sample.start + place, &[byte]), error, "{place} {byte}");
    }
    // The number of networks stands behind magic, version, length, rows, inputs and outputs.
    assert_eq!(touch.damaged(12, &[2]), count("outputs of networks", 3, 2));
    // With a tag of no section that may follow, the section of a network is missed.
    for tag in [0, 5, 7, 200] {
        let order = DecodeError::SectionOrder { expected: 1, found: tag };
        assert_eq!(readings.damaged(readings.start, &[tag]), order);
    }
}

#[test]
fn a_number_that_cannot_be_is_refused_by_its_section() {
    let [projection, readings, touch] = samples();
    let not_finite = |what| NetworkError::NotFinite { what };
    let not_positive = |what| NetworkError::NotPositive { what };
    let of_readings = |cause| DecodeError::ReadingModel { cause };
    for (sample, number, value, error) in [
        (&projection, 0, f32::NAN, DecodeError::Projection { cause: not_finite("projection") }),
        (&touch, 2, 0.0, DecodeError::Touch { cause: not_finite("touch") }),
        (&touch, 13, f32::NAN, DecodeError::Projection { cause: not_finite("projection") }),
        (&readings, 20, f32::INFINITY, of_readings(not_finite("reading model"))),
        (&readings, 9, 1.5, of_readings(not_positive("reading model"))),
    ] {
        assert_eq!(sample.with(number, value), error, "number {number}");
    }
}

/// Number of cases: some, or as many as `TAXEL_CASES` says.
fn cases() -> u32 {
    std::env::var("TAXEL_CASES").map_or(10_000, |cases| cases.parse().unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]
    /// Parsing, decoding and assessing end for any bytes under a valid CRC. What an accepted model decodes is finite, or
    /// marked; where readings are numbers, so is the novelty.
    #[test]
    fn hostile_bytes_under_a_valid_crc_never_panic(
        which in 0..4_usize,
        changes in prop::collection::vec((9_usize..500, any::<u8>()), 1..6),
        frame in prop::array::uniform4(any::<f32>()),
    ) {
        let mut plain = Aligned([0; 512]);
        let samples = samples();
        let blob = samples.get(which).map(|sample| &sample.blob[..]);
        let mut blob =
            AlignedBytes::copy_of(blob.unwrap_or_else(|| blob_format::small_model(&mut plain.0)));
        let length = blob.len();
        for (offset, byte) in changes {
            blob[9 + offset % (length - 4 - 9)] = byte;
        }
        close_with_crc(&mut blob);
        let Ok(decoder) = Decoder::<2>::load(&blob) else { return Ok(()) };
        let model = decoder.model();
        prop_assert_eq!(model.networks().count(), model.network_count());
        for network in model.networks() {
            let Network::F32(network) = network else { continue };
            prop_assert!(network.parameters().centres.iter().all(|c| c.is_finite()));
        }
        let shape = decoder.shape();
        let Some(readings) = frame.get(..shape.rows * shape.inputs) else { return Ok(()) };
        if let Ok(estimate) = decoder.decode(readings) {
            for (row, status) in estimate.status.iter().enumerate() {
                let outputs = &estimate.outputs[row * shape.outputs..][..shape.outputs];
                let finite = outputs.iter().all(|output| output.is_finite());
                prop_assert_eq!(finite, *status == RowStatus::Decoded);
            }
        }
        let mut deviation = vec![0.0; shape.rows * shape.outputs];
        let mut scratch = vec![0.0; decoder.scratch_floats()];
        let assessed = decoder.assess_into(Frame::from(readings), &mut scratch, &mut deviation);
        if let Ok(Some(novelty)) = assessed {
            prop_assert!(!novelty.is_infinite());
            prop_assert!(deviation.iter().all(|d| !d.is_infinite()));
        }
    }
}

//! Reading model of a blob, and how a decoder fills and assesses frames with it.

use crate::common::network;
use taxel_core::blob::{Metadata, Model, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::NetworkError;
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_core::relative::reciprocal;
use taxel_core::{AlignedBytes, Decoder, Frame, RowStatus};

/// Four readings that move together, of two rows.
pub const SIZES: Sizes = Sizes { readings: 4, factors: 1, components: 1, outputs: 2 };
pub const BLOCK: [f32; 25] = [
    50.0, 60.0, 70.0, 80.0, 0.25, 0.5, 0.5, 0.25, 0.0, 0.5, 0.5, 0.5, 0.25, -1.0, -0.5, -1.0, 1.0,
    0.25, 0.0, 2.0, 0.0625, 0.25, 2.0, 1.5, 3.0,
];

pub fn blob(relative_inputs: bool, reading_model: Option<ReadingModel<'_>>) -> AlignedBytes {
    let unnamed = Metadata::unnamed(ModelShape { rows: 2, inputs: 2, outputs: 1 });
    let networks = &[network(&[1.5])];
    let metadata = Metadata { relative_inputs, ..unnamed };
    let parts = ModelParts { reading_model, ..ModelParts::new(networks, &[0, 0], metadata) };
    encode_to_vec(&parts).unwrap()
}

pub fn full() -> Option<ReadingModel<'static>> {
    ReadingModel::new(SIZES, &BLOCK).ok()
}

#[test]
fn a_blob_keeps_its_reading_model_and_a_model_without_has_none() {
    let fills = ReadingModel::new(Sizes { components: 0, ..SIZES }, &BLOCK[..13]).ok();
    for reading_model in [full(), fills, None] {
        let bytes = blob(false, reading_model);
        let model = Model::decode(&bytes).unwrap();
        assert_eq!(model.reading_model(), reading_model);
        assert_eq!(model.assesses(), reading_model.is_some_and(|it| it.sizes().components > 0));
        let decoder = Decoder::<2>::new(model).unwrap();
        let (mut frame, mut scratch) = ([54.0, f32::NAN, 72.0, 84.0], [0.0; 9]);
        let filled = decoder.fill(&mut frame, &[], &mut scratch);
        let status = match reading_model {
            Some(_) => RowStatus::Decoded,
            None => RowStatus::MissingReading,
        };
        assert_eq!(
            (filled, decoder.decode(&frame[..]).unwrap().status),
            (reading_model.iter().count(), vec![status, RowStatus::Decoded])
        );
        // z is (1, 1, 1) where it is known, so that VᵀZ is 1.25 and the missing one 0.5·1.25/(1 − 0.25).
        assert!(filled == 0 || (frame[1] - 60.0 - 2.0 * 0.625 / 0.75).abs() < 1e-4, "{frame:?}");
        let assessed = decoder.assess_into(frame[..].into(), &mut scratch, &mut [0.0; 2]).unwrap();
        assert_eq!(assessed.is_some(), model.assesses());
    }
}

#[test]
fn a_decoder_assesses_readings_and_ratios_and_checks_lengths() {
    let [plain, relative] = [false, true].map(|relative| blob(relative, full()));
    let [plain, relative] = [&plain, &relative].map(|blob| Decoder::<2>::load(blob).unwrap());
    assert_eq!(plain.scratch_floats(), 4 + 2 + 3);
    let (mut scratch, mut deviation) = ([0.0; 9], [0.0; 2]);
    let mut assess = |decoder: &Decoder<'_, 2>, readings_ohm: &[f32], reciprocals: &[f32]| {
        decoder.assess_into(Frame { readings_ohm, reciprocals }, &mut scratch, &mut deviation)
    };
    let baseline = [2.0, 4.0, 0.5, 1.0].map(reciprocal);
    let found = [
        assess(&plain, &[58.0, 61.0, 70.0, 80.0], &[]).unwrap().unwrap(),
        assess(&relative, &[116.0, 244.0, 35.0, 80.0], &baseline).unwrap().unwrap(),
    ];
    // z = (2, ½, 0, 0), with a score of 1.25 and a distance of √(4.25 − 1.5625).
    let (first, second) = (1.25 - 0.5, 0.25 * 1.25 + 2.0 * 2.6875_f32.sqrt() - 1.0);
    let novelty = 1.0 + 0.5 * (first * first + second * second) - 3.0;
    assert!(found.iter().all(|found: &f32| (found - novelty).abs() < 1e-5), "{found:?} {novelty}");
    for reciprocals in [&[0.5, 0.25, 2.0, f32::NAN][..], &baseline[..3], &[]] {
        let unknown = assess(&relative, &[116.0, 244.0, 35.0, 80.0], reciprocals);
        assert!(unknown.unwrap().is_some_and(f32::is_nan));
    }
    let length = Err(NetworkError::Length { what: "frame", expected: 4, found: 1 });
    assert_eq!(assess(&plain, &[58.0], &[]), length);
}

//! Readings from the host, and their estimates.

use taxel_core::Decoder;
use taxel_core::blob::{Floats, Model, ModelParts, encode_to_vec};
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_firmware::link::message::{EstimateReport, Refusal, Report, Request};

use super::requests::{bits, decode, expected};
use crate::mock::*;

#[test]
fn a_faulty_reading_spoils_its_row_alone_and_is_told() {
    let blob = blob(3, 4);
    let (mut session, board) = started(quiet(), &blob);
    let good = frame_at_rest();
    for bad in [f32::NAN, 0.0, f32::INFINITY, 1.0, 2000.0, -60.0] {
        let mut frame = good;
        frame[0][2] = bad;
        let (flags, status, found) = decode(&mut session, &board, &frame);
        assert_eq!((flags, &status[..]), (EstimateReport::FAULTY_READING, &[1, 0][..]), "{bad}");
        assert!(found[..OUTPUTS].iter().all(|value| f32::from_bits(*value).is_nan()));
        assert_eq!(found[OUTPUTS..], bits(expected(&blob, &good)[1].into_iter()));
    }
}

#[test]
fn a_model_with_a_reading_model_decodes_rows_with_a_faulty_reading_and_tells_of_it() {
    let plain = blob(3, 4);
    let model = Model::decode(&plain).unwrap();
    let networks: Vec<_> = model.networks().collect();
    // Readings 60 to 65 Ω that all move together.
    let block = [&[60.0, 61.0, 62.0, 63.0, 64.0, 65.0][..], &[10.0; 6], &[0.0], &[0.4; 6]].concat();
    let sizes = Sizes { readings: 6, factors: 1, components: 0, outputs: ROWS * OUTPUTS };
    let parts = ModelParts {
        reading_model: ReadingModel::new(sizes, &block).ok(),
        ..ModelParts::new(&networks, &[0; ROWS], *model.metadata())
    };
    let filling = encode_to_vec(&parts).unwrap();
    let (mut session, board) = started(quiet(), &filling);
    let mut frame = frame_at_rest();
    frame[0][2] = 2000.0;
    let (flags, status, found) = decode(&mut session, &board, &frame);
    assert_eq!((flags, &status[..]), (EstimateReport::FAULTY_READING, &[0, 0][..]));
    let mut filled = frame;
    filled[0][2] = f32::NAN;
    let decoder = Decoder::<ROWS>::load(&filling).unwrap();
    assert_eq!(decoder.fill(filled.as_flattened_mut(), &[], &mut [0.0; 9]), 1);
    assert!((filled[0][2] - 62.0).abs() < 0.01, "{filled:?}");
    assert_eq!(found, bits(expected(&plain, &filled).into_iter().flatten()));
    // Two of six are too many.
    frame[1][0] = 2000.0;
    let (flags, status, _) = decode(&mut session, &board, &frame);
    assert_eq!((flags, &status[..]), (EstimateReport::FAULTY_READING, &[1, 1][..]));
}

#[test]
fn without_a_model_the_answer_says_so() {
    let (mut session, board) = started(quiet(), &[]);
    let (flags, status, found) = decode(&mut session, &board, &frame_at_rest());
    assert_eq!((flags, &status[..]), (EstimateReport::NO_MODEL, &[1, 1][..]));
    assert!(found.is_empty());
}

#[test]
fn a_frame_of_another_length_is_refused() {
    let (mut session, board) = started(quiet(), &blob(3, 4));
    for readings in [&[60.0; 5][..], &[60.0; 7], &[]] {
        let request =
            Request::Decode { frame: 0, start_us: 0, readings_ohm: Floats::new(readings) };
        let (refused, _) = ask(&mut session, &board, &request, |report| {
            report == Report::Refused(Refusal::FrameLength { expected: 6 })
        });
        assert!(refused);
    }
}

#[test]
fn readings_far_beyond_the_training_range_are_flagged_and_counted() {
    let (mut session, board) = started(quiet(), &blob(3, 4));
    // The training range is 50 to 70 Ω, and an eighth of it more on either side is not clamped.
    for (reading, clamped) in
        [(47.6, false), (72.4, false), (47.4, true), (72.6, true), (900.0, true)]
    {
        let mut frame = frame_at_rest();
        frame[1][2] = reading;
        let (flags, _, _) = decode(&mut session, &board, &frame);
        assert_eq!(flags & EstimateReport::CLAMPED != 0, clamped, "{reading}");
    }
    assert_eq!(statistics(&mut session, &board).frames_clamped, 3);
}

//! Readings from the host, and their estimates.

use taxel_core::Decoder;
use taxel_core::blob::Floats;
use taxel_firmware::link::message::{EstimateReport, Refusal, Request};

use crate::mock::*;

#[test]
fn a_faulty_reading_spoils_its_row_alone_and_is_told() {
    let blob = blob(3, 4);
    let mut host = started(quiet(), &blob);
    let good = expected(&blob, &frame_at_rest());
    for bad in [f32::NAN, 0.0, f32::INFINITY, 1.0, 2000.0, -60.0] {
        let (flags, status, found) = host.decode(&frame_with(0, 2, bad));
        assert_eq!((flags, &status[..]), (EstimateReport::FAULTY_READING, &[1, 0][..]), "{bad}");
        assert!(found[..OUTPUTS].iter().all(|value| f32::from_bits(*value).is_nan()));
        assert_eq!(found[OUTPUTS..], good[OUTPUTS..]);
    }
}

#[test]
fn a_reading_model_fills_one_faulty_reading_which_is_told() {
    let blob = blob_with_readings(false);
    let decoder = Decoder::<ROWS>::load(&blob).unwrap();
    let mut filled = frame_with(0, 2, f32::NAN);
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    assert_eq!(decoder.fill(filled.as_flattened_mut(), &[], &mut scratch), 1);
    let mut host = started(quiet(), &blob);
    let mut frame = frame_with(0, 2, 2000.0);
    let (flags, status, found) = host.decode(&frame);
    assert_ne!(flags & EstimateReport::FAULTY_READING, 0);
    assert_eq!((status, found), (vec![0, 0], expected(&blob, &filled)));
    // Two of six are too many.
    frame[1][0] = 2000.0;
    let (flags, status, _) = host.decode(&frame);
    assert_eq!((flags, &status[..]), (EstimateReport::FAULTY_READING, &[1, 1][..]));
}

#[test]
fn an_answer_reports_a_missing_model_or_a_wrong_length() {
    let found = started(quiet(), &[]).decode(&frame_at_rest());
    assert_eq!(found, (EstimateReport::NO_MODEL, vec![1, 1], vec![]));
    let (flags, ..) = started(quiet(), &blob(OVERFLOWING, 4)).decode(&frame_at_rest());
    assert_eq!(flags, EstimateReport::OVERFLOW);
    let mut host = started(quiet(), &blob(3, 4));
    for readings in [&[60.0; 5][..], &[60.0; 7], &[]] {
        let readings_ohm = Floats::new(readings);
        let request = Request::Decode { frame: 0, start_us: 0, readings_ohm };
        assert_eq!(host.refusal(&request), Refusal::FrameLength { expected: 6 });
    }
}

#[test]
fn readings_beyond_the_training_range_are_flagged_and_counted() {
    let mut host = started(quiet(), &blob(3, 4));
    // The training range is 50 to 70 Ω, and an eighth of it more on either side is not clamped.
    for (reading, clamped) in
        [(47.6, false), (72.4, false), (47.4, true), (72.6, true), (900.0, true)]
    {
        let (flags, ..) = host.decode(&frame_with(1, 2, reading));
        assert_eq!(flags & EstimateReport::CLAMPED != 0, clamped, "{reading}");
    }
    assert_eq!(host.statistics().frames_clamped, 3);
}

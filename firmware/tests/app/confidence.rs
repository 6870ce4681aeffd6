//! Novelty and deviations: when they are computed, and what is sent of them.

use taxel_core::blob::Floats;
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Frame};
use taxel_firmware::link::message::{
    ConfidenceSent, Configuration, EstimateReport, Report, Request,
};

use super::requests::bits;
use crate::mock::*;

/// What an estimate has of a confidence: a flag, and the bits of its numbers.
#[derive(Debug, Clone, PartialEq)]
struct Sent {
    is_novel: bool,
    novelty: Option<u32>,
    deviations: Vec<u32>,
}

const NOTHING: Sent = Sent { is_novel: false, novelty: None, deviations: Vec::new() };

fn sent(estimate: &EstimateReport<'_>) -> Sent {
    Sent {
        is_novel: estimate.flags & EstimateReport::NOVEL != 0,
        novelty: estimate.novelty.map(f32::to_bits),
        deviations: bits(estimate.deviation.iter()),
    }
}

/// What taxel-core itself makes of a frame.
fn expected(blob: &[u8], frame: &TestFrame, baseline_ohm: f32) -> Sent {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    let reciprocals = [reciprocal(baseline_ohm); ROWS * COLS];
    let frame = Frame { readings_ohm: frame.as_flattened(), reciprocals: &reciprocals };
    let (mut scratch, mut deviation) = (vec![0.0; decoder.scratch_floats()], [0.0; ROWS * OUTPUTS]);
    let novelty = decoder.assess_into(frame, &mut scratch, &mut deviation).unwrap().unwrap();
    Sent {
        is_novel: novelty > 0.0,
        novelty: Some(novelty.to_bits()),
        deviations: bits(deviation.into_iter()),
    }
}

/// Lets the device decode `frame`.
fn decode(session: &mut TestSession<'_>, board: &Board, frame: &TestFrame) -> (Sent, u8) {
    let readings_ohm = Floats::new(frame.as_flattened());
    let request = Request::Decode { frame: 5, start_us: 0, readings_ohm };
    answer!(session, board, &request, Report::Estimate(it) => (sent(&it), it.flags))
}

/// What the device sends of its next scans, which it then ends.
fn scanned(session: &mut TestSession<'_>, board: &Board, confidence: ConfidenceSent) -> Vec<Sent> {
    let scanning = Configuration { frame_period_us: 1000, confidence, ..quiet() };
    tell(session, board, &Request::Configure(scanning));
    board.pins.borrow_mut().to_host.clear();
    let until_us = board.pins.borrow().now_us + 2500;
    run_until(session, board, until_us);
    let mut found = Vec::new();
    find_report(&std::mem::take(&mut board.pins.borrow_mut().to_host), |_, report| {
        match report {
            Report::Estimate(estimate) => found.push(sent(&estimate)),
            Report::Health(_) => {}
            other => panic!("{other:?}"),
        }
        None::<()>
    });
    tell(session, board, &Request::Configure(quiet()));
    assert!(found.len() >= 2, "{found:?}");
    found
}

/// A frame that is like those of training, but for one reading.
fn with_last(ohm: f32) -> TestFrame {
    let mut frame = frame_at_rest();
    frame[1][2] = ohm;
    frame
}

#[test]
fn an_answer_has_novelty_and_deviations_as_model_core_computes_them() {
    for (is_relative, baseline_ohm) in [(false, f32::NAN), (true, 62.0)] {
        let blob = blob_with_readings(is_relative);
        let (mut session, board) = started(quiet(), &blob);
        let (found, flags) = decode(&mut session, &board, &frame_at_rest());
        let is_unknown = found.novelty.is_some_and(|novelty| f32::from_bits(novelty).is_nan());
        let unknown = if is_relative { EstimateReport::NO_BASELINE } else { 0 };
        assert_eq!((flags, is_unknown), (unknown, is_relative));
        let readings_ohm = Floats::new(&[62.0; ROWS * COLS]);
        tell(&mut session, &board, &Request::SetBaseline { readings_ohm });
        // However little a frame is novel, it is flagged.
        let hardly = (65..900).map(|ohm| ohm as f32).find(|ohm| {
            let sent = expected(&blob, &with_last(*ohm), baseline_ohm);
            sent.novelty.is_some_and(|novelty| (1e-6..1.0).contains(&f32::from_bits(novelty)))
        });
        for (ohm, novel) in [(65.0, false), (64.0, false), (hardly.unwrap(), true), (900.0, true)] {
            let (found, flags) = decode(&mut session, &board, &with_last(ohm));
            assert_eq!(found, expected(&blob, &with_last(ohm), baseline_ohm), "{ohm}");
            assert_ne!(flags & EstimateReport::CONTACT, 0, "{ohm}: a flag of its own is lost");
            assert_eq!((found.is_novel, found.deviations.len()), (novel, ROWS * OUTPUTS), "{ohm}");
        }
        let s = statistics(&mut session, &board);
        assert_eq!((s.frames_novel, s.longest_confidence_us > 0), (2, true));
    }
}

#[test]
fn of_a_scan_comes_what_the_model_has_and_the_configuration_says() {
    let (with, without) = (blob_with_readings(false), blob(3, 4));
    let frame = with_last(900.0);
    let all = || expected(&with, &frame, f32::NAN);
    let novelty = Sent { deviations: Vec::new(), ..all() };
    for (blob, confidence, expected) in [
        (&without, ConfidenceSent::Deviations, NOTHING),
        (&with, ConfidenceSent::Nothing, NOTHING),
        (&with, ConfidenceSent::Novelty, novelty),
        (&with, ConfidenceSent::Deviations, all()),
    ] {
        let (mut session, board) = started(quiet(), blob);
        *board.frame.borrow_mut() = frame;
        let frames = scanned(&mut session, &board, confidence);
        assert!(frames.iter().all(|sent| *sent == expected), "{confidence:?}: {frames:?}");
        let s = statistics(&mut session, &board);
        assert_eq!(s.frames_novel, if expected.is_novel { s.frames_decoded } else { 0 });
        assert_eq!(s.longest_confidence_us > 0, expected.is_novel);
    }
    let (mut session, board) = started(quiet(), &without);
    assert_eq!(decode(&mut session, &board, &frame).0, NOTHING);
}

#[test]
fn a_faulty_reading_is_filled_before_a_frame_is_assessed_and_two_leave_it_unknown() {
    for (is_relative, baseline_ohm) in [(false, f32::NAN), (true, 62.0)] {
        let blob = blob_with_readings(is_relative);
        let (mut session, board) = started(quiet(), &blob);
        let readings_ohm = Floats::new(&[62.0; ROWS * COLS]);
        tell(&mut session, &board, &Request::SetBaseline { readings_ohm });
        let mut filled = with_last(f32::NAN);
        let decoder = Decoder::<ROWS>::load(&blob).unwrap();
        let reciprocals = [reciprocal(baseline_ohm); ROWS * COLS];
        let mut scratch = vec![0.0; decoder.scratch_floats()];
        assert_eq!(decoder.fill(filled.as_flattened_mut(), &reciprocals, &mut scratch), 1);
        for bad in [f32::NAN, 0.0, f32::INFINITY, 2000.0, -60.0] {
            let (found, flags) = decode(&mut session, &board, &with_last(bad));
            assert_ne!(flags & EstimateReport::FAULTY_READING, 0, "{bad}");
            assert_eq!(found, expected(&blob, &filled, baseline_ohm), "{bad}");
            assert!(found.novelty.is_some_and(|it| f32::from_bits(it) < 0.0), "{found:?}");
            let mut frame = with_last(bad);
            frame[0][0] = bad;
            let (found, flags) = decode(&mut session, &board, &frame);
            assert_ne!(flags & EstimateReport::FAULTY_READING, 0, "{bad}");
            assert!(found.novelty.is_some_and(|it| f32::from_bits(it).is_nan()), "{found:?}");
            assert!(found.deviations.iter().all(|it| f32::from_bits(*it).is_nan()), "{found:?}");
        }
    }
}

//! Novelty and deviations: when they are computed, and what is sent of them.

use taxel_core::blob::Floats;
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Frame};
use taxel_firmware::link::message::{
    ConfidenceSent, Configuration, EstimateReport, Report, Request,
};

use super::requests::bits;
use crate::mock::*;

/// What an estimate has of a confidence, as bits, and whether it is flagged as novel.
#[derive(Debug, PartialEq)]
struct Sent {
    novel: bool,
    novelty: Option<u32>,
    deviation: Vec<u32>,
}

impl Sent {
    fn new(estimate: &EstimateReport<'_>) -> Self {
        Self {
            novel: estimate.flags & EstimateReport::NOVEL != 0,
            novelty: estimate.novelty.map(f32::to_bits),
            deviation: bits(estimate.deviation.iter()),
        }
    }

    const NOTHING: Self = Self { novel: false, novelty: None, deviation: Vec::new() };
}

/// What taxel-core itself makes of a frame.
fn expected(blob: &[u8], frame: &TestFrame, baseline_ohm: f32) -> Sent {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    let reciprocals = [reciprocal(baseline_ohm); ROWS * COLS];
    let frame = Frame { readings_ohm: frame.as_flattened(), reciprocals: &reciprocals };
    let (mut scratch, mut deviation) = (vec![0.0; decoder.scratch_floats()], [0.0; ROWS * OUTPUTS]);
    let novelty = decoder.assess_into(frame, &mut scratch, &mut deviation).unwrap().unwrap();
    let deviation = bits(deviation.into_iter());
    Sent { novel: novelty > 0.0, novelty: Some(novelty.to_bits()), deviation }
}

/// Lets the device decode `frame`.
fn decode(session: &mut TestSession<'_>, board: &Board, frame: &TestFrame) -> (Sent, u8) {
    let readings_ohm = Floats::new(frame.as_flattened());
    let request = Request::Decode { frame: 5, start_us: 0, readings_ohm };
    ask(session, board, &request, |report| match report {
        Report::Estimate(estimate) => (Sent::new(&estimate), estimate.flags),
        other => panic!("{other:?}"),
    })
    .0
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
            Report::Estimate(estimate) => found.push(Sent::new(&estimate)),
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
    let blob = blob_with_confidence(false);
    let (mut session, board) = started(quiet(), &blob);
    for (ohm, novel) in [(65.0, false), (64.0, false), (900.0, true)] {
        let (found, flags) = decode(&mut session, &board, &with_last(ohm));
        assert_eq!(found, expected(&blob, &with_last(ohm), f32::NAN), "{ohm}");
        assert_eq!((found.novel, flags & EstimateReport::NOVEL != 0), (novel, novel), "{ohm}");
        assert_eq!(found.deviation.len(), ROWS * OUTPUTS);
    }
    let s = statistics(&mut session, &board);
    assert_eq!((s.frames_decoded, s.frames_novel), (3, 1));
    assert!(s.longest_confidence_us > 0);
    // However little a frame is novel, it is flagged.
    let hardly = (65..900).map(|ohm| with_last(ohm as f32)).find(|frame| {
        let novelty = expected(&blob, frame, f32::NAN).novelty.map(f32::from_bits);
        novelty.is_some_and(|novelty| novelty > 0.0 && novelty < 1.0)
    });
    assert!(decode(&mut session, &board, &hardly.unwrap()).0.novel);
}

#[test]
fn without_a_confidence_nothing_is_sent() {
    let (mut session, board) = started(quiet(), &blob(3, 4));
    assert_eq!(decode(&mut session, &board, &with_last(900.0)).0, Sent::NOTHING);
    *board.frame.borrow_mut() = with_last(900.0);
    for sent in scanned(&mut session, &board, ConfidenceSent::Deviations) {
        assert_eq!(sent, Sent::NOTHING);
    }
    let s = statistics(&mut session, &board);
    assert_eq!((s.frames_novel, s.longest_confidence_us), (0, 0));
}

#[test]
fn of_a_scan_comes_what_the_configuration_says() {
    let blob = blob_with_confidence(false);
    let (mut session, board) = started(quiet(), &blob);
    let frame = with_last(900.0);
    *board.frame.borrow_mut() = frame;
    let all = || expected(&blob, &frame, f32::NAN);
    assert!(all().novel);

    for sent in scanned(&mut session, &board, ConfidenceSent::Nothing) {
        assert_eq!(sent, Sent::NOTHING);
    }
    assert_eq!(statistics(&mut session, &board).longest_confidence_us, 0);
    for sent in scanned(&mut session, &board, ConfidenceSent::Novelty) {
        assert_eq!(sent, Sent { deviation: Vec::new(), ..all() });
    }
    for sent in scanned(&mut session, &board, ConfidenceSent::Deviations) {
        assert_eq!(sent, all());
    }
    let s = statistics(&mut session, &board);
    assert!(s.frames_novel >= 4 && s.frames_novel < s.frames_decoded, "{s:?}");
}

#[test]
fn a_frame_with_a_faulty_reading_has_no_confidence_and_is_not_novel() {
    let blob = blob_with_confidence(false);
    let (mut session, board) = started(quiet(), &blob);
    for bad in [f32::NAN, 0.0, f32::INFINITY, 2000.0, -60.0] {
        let (found, flags) = decode(&mut session, &board, &with_last(bad));
        assert_eq!(flags, EstimateReport::FAULTY_READING, "{bad}");
        assert!(found.novelty.is_some_and(|novelty| f32::from_bits(novelty).is_nan()), "{bad}");
        assert_eq!(found.deviation.len(), ROWS * OUTPUTS);
        assert!(found.deviation.iter().all(|value| f32::from_bits(*value).is_nan()), "{bad}");
    }
}

#[test]
fn relative_inputs_need_a_baseline_for_a_confidence_too() {
    let blob = blob_with_confidence(true);
    let (mut session, board) = started(quiet(), &blob);
    let (found, flags) = decode(&mut session, &board, &frame_at_rest());
    assert_eq!(flags, EstimateReport::NO_BASELINE);
    assert!(found.novelty.is_some_and(|novelty| f32::from_bits(novelty).is_nan()));
    let request = Request::SetBaseline { readings_ohm: Floats::new(&[62.0; ROWS * COLS]) };
    tell(&mut session, &board, &request);
    for (ohm, novel) in [(65.0, false), (900.0, true)] {
        let (found, _) = decode(&mut session, &board, &with_last(ohm));
        assert_eq!(found, expected(&blob, &with_last(ohm), 62.0), "{ohm}");
        assert_eq!(found.novel, novel, "{ohm}");
    }
}

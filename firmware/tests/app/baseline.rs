//! Capturing a baseline, and what is told against it.

use taxel_core::blob::{Floats, Metadata, Model, ModelParts, encode_to_vec};
use taxel_firmware::app::Session;
use taxel_firmware::link::message::{Configuration, EstimateReport, Refusal, Report, Request};

use super::requests::{capture, decode};
use crate::mock::*;

#[test]
fn a_baseline_is_captured_and_contact_is_told_against_it() {
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    board
        .pins
        .borrow_mut()
        .to_device
        .extend(request_bytes(9, &Request::CaptureBaseline { frames: 4 }));
    while !reports(&board.pins.borrow().to_host).iter().any(|(number, _)| *number == 9) {
        session.step();
        assert!(board.pins.borrow().now_us < 10_000, "no answer");
    }
    let all = reports(&board.pins.borrow().to_host);
    let baseline = &all.iter().find(|(number, _)| *number == 9).unwrap().1;
    let rest = Floats::new(&[60.0, 61.0, 62.0, 63.0, 64.0, 65.0]);
    assert_eq!(*baseline, format!("{:?}", Report::Baseline { readings_ohm: rest }));

    let rest = frame_at_rest();
    assert_eq!(decode(&mut session, &board, &rest).0 & EstimateReport::CONTACT, 0);
    let mut pressed = rest;
    pressed[1][0] *= 0.97;
    assert_ne!(decode(&mut session, &board, &pressed).0 & EstimateReport::CONTACT, 0);
    let mut nearly = rest;
    nearly[1][0] *= 0.985;
    assert_eq!(decode(&mut session, &board, &nearly).0 & EstimateReport::CONTACT, 0);
    // A change of the threshold itself, 48 Ω for 64 Ω, is none.
    ask(
        &mut session,
        &board,
        &Request::Configure(Configuration { contact_threshold: 0.25, ..quiet() }),
        |_| (),
    );
    for (ohm, contact) in [(48.0, 0), (47.9, EstimateReport::CONTACT)] {
        let mut frame = rest;
        frame[1][1] = ohm;
        assert_eq!(decode(&mut session, &board, &frame).0 & EstimateReport::CONTACT, contact);
    }
}

#[test]
fn a_frame_without_a_baseline_is_flagged_until_one_is_complete() {
    let absolute = blob(3, 4);
    let model = Model::decode(&absolute).unwrap();
    let networks: Vec<_> = model.networks().collect();
    let metadata = Metadata { relative_inputs: true, ..Metadata::unnamed(model.shape()) };
    let parts = ModelParts::new(&networks, &[0; ROWS], metadata);
    let mut slots = Flash::slots_with(&encode_to_vec(&parts).unwrap());
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let rest = frame_at_rest();
    let without = (EstimateReport::NO_BASELINE, vec![1, 1]);
    let read = |session: &mut TestSession<'_>| {
        let (flags, status, _) = decode(session, &board, &rest);
        (flags & EstimateReport::NO_BASELINE, status)
    };
    let begin = |session: &mut TestSession<'_>| {
        let scanning = Configuration { frame_period_us: 100, ..quiet() };
        ask(session, &board, &Request::Configure(scanning), |_| ());
        let request = request_bytes(8, &Request::CaptureBaseline { frames: 1000 });
        board.pins.borrow_mut().to_device.extend(request);
        settle(session, &board);
    };
    let scan_some = |session: &mut TestSession<'_>| {
        let until_us = board.pins.borrow().now_us + 1000;
        while board.pins.borrow().now_us < until_us {
            assert_eq!(session.step(), None);
        }
    };
    assert_eq!(read(&mut session), without);
    begin(&mut session);
    assert_eq!(read(&mut session), without);
    scan_some(&mut session);
    assert_eq!(read(&mut session), without);
    capture(&mut session, &board, 2);
    let decoded = (0, vec![0, 0]);
    ask(&mut session, &board, &Request::Configure(quiet()), |_| ());
    assert_eq!(read(&mut session), decoded);
    // While another is captured, and if that is given up, readings are relative to the one before.
    begin(&mut session);
    assert_eq!(read(&mut session), decoded);
    scan_some(&mut session);
    assert_eq!(read(&mut session), decoded);
    ask(&mut session, &board, &Request::Configure(quiet()), |_| ());
    assert_eq!(read(&mut session), decoded);
    // A baseline of no known reading is none.
    let unknown = Request::SetBaseline { readings_ohm: Floats::new(&[f32::NAN; ROWS * COLS]) };
    ask(&mut session, &board, &unknown, |_| ());
    assert_eq!(read(&mut session), without);
}

#[test]
fn a_baseline_that_will_not_come_is_refused_and_one_that_comes_is_counted_once() {
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    let say = |session: &mut TestSession<'_>, number: u16, request: &Request<'_>| {
        board.pins.borrow_mut().to_device.extend(request_bytes(number, request));
        settle(session, &board);
    };
    let refused = format!("{:?}", Report::Refused(Refusal::Baseline));
    let answer = |number: u16| {
        let all = reports(&board.pins.borrow().to_host);
        all.into_iter()
            .filter(|(found, _)| *found == number)
            .map(|(_, text)| text)
            .collect::<Vec<_>>()
    };
    // Another capture, and then a configuration without scans, end the previous capture.
    say(&mut session, 10, &Request::CaptureBaseline { frames: 1000 });
    say(&mut session, 11, &Request::CaptureBaseline { frames: 1000 });
    assert_eq!(answer(10), [refused.as_str()]);
    say(&mut session, 12, &Request::Configure(quiet()));
    assert_eq!(answer(11), [refused.as_str()]);
    say(&mut session, 13, &Request::CaptureBaseline { frames: 1 });
    assert_eq!(answer(13), [refused]);
    // The same request again goes on counting.
    say(&mut session, 14, &Request::Configure(Configuration { frame_period_us: 100, ..quiet() }));
    say(&mut session, 15, &Request::CaptureBaseline { frames: 3 });
    say(&mut session, 15, &Request::CaptureBaseline { frames: 3 });
    while answer(15).is_empty() {
        assert!(board.pins.borrow().now_us < 100_000, "no answer");
        session.step();
    }
    for _ in 0..2000 {
        session.step();
    }
    assert_eq!(answer(15).len(), 1);
}

#[test]
fn a_baseline_of_another_count_under_the_same_number_starts_anew() {
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    for frames in [1000, 3] {
        let request = request_bytes(9, &Request::CaptureBaseline { frames });
        board.pins.borrow_mut().to_device.extend(request);
        settle(&mut session, &board);
    }
    while board.pins.borrow().now_us < 10_000 {
        session.step();
    }
    let answers = reports(&board.pins.borrow().to_host);
    let answers: Vec<_> = answers.iter().filter(|(number, _)| *number == 9).collect();
    assert_eq!(answers[0].1, format!("{:?}", Report::Refused(Refusal::Baseline)));
    assert!(answers.len() == 2 && answers[1].1.starts_with("Baseline"), "{answers:?}");
}

//! Capturing a baseline, and what is told against it.

use taxel_core::blob::{Floats, Metadata, Model, ModelParts, encode_to_vec};
use taxel_firmware::link::message::{Configuration, EstimateReport, Refusal, Report, Request};

use super::requests::{capture, decode};
use crate::mock::*;

#[test]
fn a_baseline_is_captured_and_contact_is_told_against_it() {
    let (mut session, board) = started(every(100), &blob(3, 4));
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
    tell(
        &mut session,
        &board,
        &Request::Configure(Configuration { contact_threshold: 0.25, ..quiet() }),
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
    let (mut session, board) = started(quiet(), &encode_to_vec(&parts).unwrap());
    let rest = frame_at_rest();
    let without = (EstimateReport::NO_BASELINE, vec![1, 1]);
    let read = |session: &mut TestSession<'_>| {
        let (flags, status, _) = decode(session, &board, &rest);
        (flags & EstimateReport::NO_BASELINE, status)
    };
    let begin = |session: &mut TestSession<'_>| {
        let scanning = every(100);
        tell(session, &board, &Request::Configure(scanning));
        send(session, &board, 8, &Request::CaptureBaseline { frames: 1000 });
    };
    let scan_some = |session: &mut TestSession<'_>| {
        let until_us = board.pins.borrow().now_us + 1000;
        run_until(session, &board, until_us);
    };
    assert_eq!(read(&mut session), without);
    begin(&mut session);
    assert_eq!(read(&mut session), without);
    scan_some(&mut session);
    assert_eq!(read(&mut session), without);
    capture(&mut session, &board, 2);
    let decoded = (0, vec![0, 0]);
    tell(&mut session, &board, &Request::Configure(quiet()));
    assert_eq!(read(&mut session), decoded);
    // While another is captured, and if that is given up, readings are relative to the one before.
    begin(&mut session);
    assert_eq!(read(&mut session), decoded);
    scan_some(&mut session);
    assert_eq!(read(&mut session), decoded);
    tell(&mut session, &board, &Request::Configure(quiet()));
    assert_eq!(read(&mut session), decoded);
    // A baseline of no known reading is none.
    let unknown = Request::SetBaseline { readings_ohm: Floats::new(&[f32::NAN; ROWS * COLS]) };
    tell(&mut session, &board, &unknown);
    assert_eq!(read(&mut session), without);
}

#[test]
fn a_baseline_that_will_not_come_is_refused_and_one_that_comes_is_counted_once() {
    let (mut session, board) = started(every(100), &blob(3, 4));
    let say = |session: &mut TestSession<'_>, number: u16, request: &Request<'_>| {
        send(session, &board, number, request);
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
    assert_eq!(answer(13), [refused.as_str()]);
    // The same request again goes on counting, and another under its number starts anew.
    say(&mut session, 14, &Request::Configure(every(100)));
    for frames in [1000, 3, 3] {
        say(&mut session, 15, &Request::CaptureBaseline { frames });
    }
    while answer(15).len() < 2 {
        assert!(board.pins.borrow().now_us < 100_000, "no answer");
        session.step();
    }
    for _ in 0..2000 {
        session.step();
    }
    let answers = answer(15);
    assert!(answers[0] == refused && answers[1].starts_with("Baseline"), "{answers:?}");
    assert_eq!(answers.len(), 2);
}

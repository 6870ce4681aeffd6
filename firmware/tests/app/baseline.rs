//! Capturing a baseline, and what is told against it.

use taxel_core::blob::{Floats, Metadata, Model, ModelParts, encode_to_vec};
use taxel_firmware::link::message::{Configuration, EstimateReport, Refusal, Report, Request};

use super::requests::{capture, decode};
use crate::mock::*;

#[test]
fn a_baseline_is_captured_and_contact_is_told_against_it() {
    let (mut session, board) = started(quiet(), &blob(3, 4));
    let captured = capture(&mut session, &board, 4);
    let rest = Floats::new(&[60.0, 61.0, 62.0, 63.0, 64.0, 65.0]);
    assert_eq!(captured, format!("{:?}", Report::Baseline { readings_ohm: rest }));

    // The flag for a frame with this reading instead of 64 Ω.
    let contact = |session: &mut TestSession<'_>, ohm: f32| {
        let mut frame = frame_at_rest();
        frame[1][1] = ohm;
        decode(session, &board, &frame).0 & EstimateReport::CONTACT != 0
    };
    // The threshold is 2 %, and a contact ends below 1.2 %. A change of the threshold itself, 48 Ω for 64 Ω, is none.
    let higher = Configuration { contact_threshold: 0.25, ..quiet() };
    for (configuration, ohm, is_contact) in [
        (quiet(), 64.0, false),
        (quiet(), 0.985 * 64.0, false),
        (quiet(), 0.97 * 64.0, true),
        (quiet(), 0.985 * 64.0, true),
        (quiet(), 0.99 * 64.0, false),
        (higher, 48.0, false),
        (higher, 47.9, true),
    ] {
        tell(&mut session, &board, &Request::Configure(configuration));
        assert_eq!(contact(&mut session, ohm), is_contact, "{ohm}");
    }
    // While another is captured there is none: not before its first frame, and not after it.
    tell(&mut session, &board, &Request::Configure(every(1_000_000)));
    send(&mut session, &board, 9, &Request::CaptureBaseline { frames: 1000 });
    for _ in 0..2 {
        assert!(!contact(&mut session, 40.0) && !contact(&mut session, 64.0));
        board.pins.borrow_mut().now_us += 1_000_000;
        session.step();
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
    // What is so before a capture, after it has begun and after some frames, and once it is given up. While another is
    // captured, readings are relative to the one before.
    let expect = |session: &mut TestSession<'_>, expected: (u8, Vec<u8>)| {
        assert_eq!(read(session), expected);
        tell(session, &board, &Request::Configure(every(100)));
        send(session, &board, 8, &Request::CaptureBaseline { frames: 1000 });
        assert_eq!(read(session), expected);
        let until_us = board.pins.borrow().now_us + 1000;
        run_until(session, &board, until_us);
        assert_eq!(read(session), expected);
        tell(session, &board, &Request::Configure(quiet()));
        assert_eq!(read(session), expected);
    };
    expect(&mut session, without.clone());
    capture(&mut session, &board, 2);
    expect(&mut session, (0, vec![0, 0]));
    // A baseline of no known reading is none.
    let unknown = Request::SetBaseline { readings_ohm: Floats::new(&[f32::NAN; ROWS * COLS]) };
    tell(&mut session, &board, &unknown);
    assert_eq!(read(&mut session), without);
}

#[test]
fn a_baseline_that_will_not_come_is_refused_and_one_that_comes_is_counted_once() {
    let (mut session, board) = started(every(100), &blob(3, 4));
    let refused = format!("{:?}", Report::Refused(Refusal::Baseline));
    let answer = |number: u16| {
        let all = reports(&board.pins.borrow().to_host);
        all.into_iter()
            .filter(|(found, _)| *found == number)
            .map(|(_, text)| text)
            .collect::<Vec<_>>()
    };
    // Another capture, and then a configuration without scans, end the previous capture.
    send(&mut session, &board, 10, &Request::CaptureBaseline { frames: 1000 });
    send(&mut session, &board, 11, &Request::CaptureBaseline { frames: 1000 });
    assert_eq!(answer(10), [refused.as_str()]);
    send(&mut session, &board, 12, &Request::Configure(quiet()));
    assert_eq!(answer(11), [refused.as_str()]);
    send(&mut session, &board, 13, &Request::CaptureBaseline { frames: 1 });
    assert_eq!(answer(13), [refused.as_str()]);
    // The same request again goes on counting, and another under its number starts anew.
    send(&mut session, &board, 14, &Request::Configure(every(100)));
    for frames in [1000, 3, 3] {
        send(&mut session, &board, 15, &Request::CaptureBaseline { frames });
    }
    while answer(15).len() < 2 {
        assert!(board.pins.borrow().now_us < 100_000, "no answer");
        session.step();
    }
    turn(&mut session, 2000);
    let answers = answer(15);
    assert!(answers[0] == refused && answers[1].starts_with("Baseline"), "{answers:?}");
    assert_eq!(answers.len(), 2);
}

//! Capturing a baseline, and what is told against it.

use taxel_core::blob::Floats;
use taxel_firmware::link::message::{Configuration, EstimateReport, Refusal, Report, Request};

use crate::mock::*;

/// Captures a baseline of `frames` scans, and returns the answer. Then sets a configuration that scans only on request.
fn capture(host: &mut Host<'_, '_>, frames: u16) -> String {
    host.configure(every(100));
    host.send(9, &Request::CaptureBaseline { frames });
    while host.answers(9).is_empty() {
        assert_eq!(host.step(), None);
        assert!(host.pins().now_us < 1_000_000, "no answer");
    }
    let answer = host.answers(9).remove(0);
    host.configure(quiet());
    answer
}

#[test]
fn a_baseline_is_captured_and_contact_is_told_against_it() {
    let mut host = started(quiet(), &blob(3, 4));
    let captured = capture(&mut host, 4);
    let rest = Floats::new(&[60.0, 61.0, 62.0, 63.0, 64.0, 65.0]);
    assert_eq!(captured, format!("{:?}", Report::Baseline { readings_ohm: rest }));

    let contact =
        |host: &mut Host<'_, '_>, ohm: f32| host.is_contact(frame_with(1, 1, ohm).as_flattened());
    // The reading at rest is 64 Ω, the threshold 2 %, and a contact ends below 1.2 %. A change of the threshold itself, 48 Ω for 64 Ω, is none.
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
        host.configure(configuration);
        assert_eq!(contact(&mut host, ohm), is_contact, "{ohm}");
    }
    // While another is captured there is none: not before its first frame, and not after it.
    host.configure(every(1_000_000));
    host.send(9, &Request::CaptureBaseline { frames: 1000 });
    for _ in 0..2 {
        assert!(!contact(&mut host, 40.0) && !contact(&mut host, 64.0));
        host.pass(1_000_000);
    }
    // Nor once that is given up.
    host.configure(quiet());
    assert!(!contact(&mut host, 40.0));
}

#[test]
fn a_frame_without_a_baseline_is_flagged_until_one_is_complete() {
    let mut host = started(quiet(), &blob_of_changes());
    let read = |host: &mut Host<'_, '_>| {
        let (flags, status, _) = host.decode(&frame_at_rest());
        assert_eq!(flags & EstimateReport::NO_BASELINE != 0, status == [1, 1]);
        status
    };
    for expected in [[1, 1], [0, 0]] {
        assert_eq!(read(&mut host), expected);
        // While another is captured, readings are relative to the one before, and once that is given up.
        host.configure(every(100));
        host.send(8, &Request::CaptureBaseline { frames: 1000 });
        assert_eq!(read(&mut host), expected);
        host.run_for(1000);
        assert_eq!(read(&mut host), expected);
        host.configure(quiet());
        assert_eq!(read(&mut host), expected);
        capture(&mut host, 2);
    }
    // A baseline of no known reading is none.
    host.set_baseline(&[f32::NAN; ROWS * COLS]);
    assert_eq!(read(&mut host), [1, 1]);
}

#[test]
fn an_abandoned_baseline_is_refused_and_others_count_once() {
    let mut host = started(every(100), &blob(3, 4));
    let refused = format!("{:?}", Report::Refused(Refusal::Baseline));
    // Another capture, and then a configuration without scans, end the previous capture.
    host.send(10, &Request::CaptureBaseline { frames: 1000 });
    host.send(11, &Request::CaptureBaseline { frames: 1000 });
    assert_eq!(host.answers(10), [refused.as_str()]);
    host.send(12, &Request::Configure(quiet()));
    assert_eq!(host.answers(11), [refused.as_str()]);
    // As does one with other scans.
    host.send(16, &Request::Configure(every(100)));
    host.send(17, &Request::CaptureBaseline { frames: 1000 });
    host.send(18, &Request::Configure(every(200)));
    assert_eq!(host.answers(17), [refused.as_str()]);
    host.send(19, &Request::Configure(quiet()));
    host.send(13, &Request::CaptureBaseline { frames: 1 });
    assert_eq!(host.answers(13), [refused.as_str()]);
    // The same request again goes on counting, and another under its number starts anew.
    host.send(14, &Request::Configure(every(100)));
    for frames in [1000, 3, 3] {
        host.send(15, &Request::CaptureBaseline { frames });
    }
    while host.answers(15).len() < 2 {
        assert!(host.pins().now_us < 100_000, "no answer");
        host.step();
    }
    host.turn(2000);
    let answers = host.answers(15);
    assert!(answers[0] == refused && answers[1].starts_with("Baseline"), "{answers:?}");
    assert_eq!(answers.len(), 2);
}

//! Novelty and deviations: when they are computed, and what is sent of them.

use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Frame};
use taxel_firmware::link::message::{ConfidenceSent, Configuration, EstimateReport, Report};

use crate::mock::*;

/// What an estimate has of a confidence: a flag, and numbers.
#[derive(Debug, Clone, PartialEq)]
struct Sent {
    is_novel: bool,
    novelty: Option<f32>,
    deviations: Vec<f32>,
}

const NOTHING: Sent = Sent { is_novel: false, novelty: None, deviations: Vec::new() };

fn sent(estimate: &EstimateReport<'_>) -> Sent {
    Sent {
        is_novel: estimate.flags & EstimateReport::NOVEL != 0,
        novelty: estimate.novelty,
        deviations: estimate.deviation.iter().collect(),
    }
}

/// What taxel-core itself makes of a frame, whose missing readings it fills.
fn expected(blob: &[u8], mut frame: TestFrame, baseline_ohm: f32) -> Sent {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    let reciprocals = [reciprocal(baseline_ohm); ROWS * COLS];
    let (mut scratch, mut deviations) =
        (vec![0.0; decoder.scratch_floats()], vec![0.0; ROWS * OUTPUTS]);
    decoder.fill(frame.as_flattened_mut(), &reciprocals, &mut scratch);
    let frame = Frame { readings_ohm: frame.as_flattened(), reciprocals: &reciprocals };
    let novelty = decoder.assess_into(frame, &mut scratch, &mut deviations).unwrap().unwrap();
    Sent { is_novel: novelty > 0.0, novelty: Some(novelty), deviations }
}

/// Lets the device decode `frame`.
fn decode(host: &mut Host<'_, '_>, frame: &TestFrame) -> (Sent, u8) {
    host.estimate(0, frame.as_flattened(), |it| (sent(&it), it.flags))
}

/// A frame that is like those of training, but for one reading.
fn with_last(ohm: f32) -> TestFrame {
    frame_with(1, 2, ohm)
}

#[test]
fn an_answer_has_the_novelty_and_deviations_of_model_core() {
    for (is_relative, baseline_ohm) in [(false, f32::NAN), (true, 62.0)] {
        let blob = blob_with_readings(is_relative);
        let expected = |ohm| expected(&blob, with_last(ohm), baseline_ohm);
        let mut host = started(quiet(), &blob);
        let (found, flags) = decode(&mut host, &frame_at_rest());
        let unknown = if is_relative { EstimateReport::NO_BASELINE } else { 0 };
        assert_eq!((flags, found.novelty.unwrap().is_nan()), (unknown, is_relative));
        host.set_baseline(&[62.0; ROWS * COLS]);
        // However little a frame is novel, it is flagged.
        let mut hardly = (65..900).map(|ohm| ohm as f32);
        let hardly = hardly.find(|ohm| (1e-6..1.0).contains(&expected(*ohm).novelty.unwrap()));
        for (ohm, novel) in [(65.0, false), (64.0, false), (hardly.unwrap(), true), (900.0, true)] {
            let (found, flags) = decode(&mut host, &with_last(ohm));
            assert_eq!(found, expected(ohm), "{ohm}");
            assert_ne!(flags & EstimateReport::CONTACT, 0, "{ohm}: a flag of its own is lost");
            assert_eq!((found.is_novel, found.deviations.len()), (novel, ROWS * OUTPUTS), "{ohm}");
        }
        let s = host.statistics();
        assert_eq!(s.frames_novel, 2);
        assert!(s.longest_confidence_us > 0 && s.longest_confidence_cycles > 0, "{s:?}");
        // One faulty reading is filled before. Two of six are too many, and leave all unknown.
        for bad in [f32::NAN, 0.0, f32::INFINITY, 2000.0, -60.0] {
            let mut frame = with_last(bad);
            let (found, flags) = decode(&mut host, &frame);
            assert_ne!(flags & EstimateReport::FAULTY_READING, 0, "{bad}");
            assert_eq!(found, expected(f32::NAN), "{bad}");
            assert!(found.novelty.unwrap() < 0.0, "{found:?}");
            frame[0][0] = bad;
            let (found, flags) = decode(&mut host, &frame);
            assert_ne!(flags & EstimateReport::FAULTY_READING, 0, "{bad}");
            let mut numbers = found.deviations.iter().chain(&found.novelty);
            assert!(numbers.all(|it| it.is_nan()) && found.novelty.is_some(), "{found:?}");
        }
    }
}

#[test]
fn a_scan_reports_what_the_model_has_and_the_configuration_asks() {
    let (with, without) = (blob_with_readings(false), blob(3, 4));
    let frame = with_last(900.0);
    let all = || expected(&with, frame, f32::NAN);
    let novelty = Sent { deviations: Vec::new(), ..all() };
    for (blob, confidence, expected) in [
        (&without, ConfidenceSent::Deviations, NOTHING),
        (&with, ConfidenceSent::Nothing, NOTHING),
        (&with, ConfidenceSent::Novelty, novelty),
        (&with, ConfidenceSent::Deviations, all()),
    ] {
        let scanning = Configuration { confidence, ..every(1000) };
        let mut host = started(scanning, blob);
        *host.frame() = frame;
        host.run_until(2500);
        let mut frames = Vec::new();
        host.find(|_, report| {
            match report {
                Report::Estimate(estimate) => frames.push(sent(&estimate)),
                Report::Health(_) => {}
                other => panic!("{other:?}"),
            }
            None::<()>
        });
        assert_eq!(frames, [expected.clone(), expected.clone()], "{confidence:?}");
        let s = host.statistics();
        assert_eq!(s.frames_novel, if expected.is_novel { s.frames_decoded } else { 0 });
        assert_eq!(s.longest_confidence_us > 0, expected.is_novel);
    }
    let mut host = started(quiet(), &without);
    assert_eq!(decode(&mut host, &frame).0, NOTHING);
}

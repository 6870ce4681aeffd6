//! Novelty and deviations: when they are computed, and what is sent of them.

use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Frame};
use taxel_firmware::link::message::{ConfidenceSent, Configuration, EstimateReport, Report};

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
    Sent { is_novel: novelty > 0.0, novelty: Some(novelty.to_bits()), deviations: bits(deviation) }
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
fn an_answer_has_novelty_and_deviations_as_model_core_computes_them() {
    for (is_relative, baseline_ohm) in [(false, f32::NAN), (true, 62.0)] {
        let blob = blob_with_readings(is_relative);
        let mut host = started(quiet(), &blob);
        let (found, flags) = decode(&mut host, &frame_at_rest());
        let is_unknown = found.novelty.is_some_and(|novelty| f32::from_bits(novelty).is_nan());
        let unknown = if is_relative { EstimateReport::NO_BASELINE } else { 0 };
        assert_eq!((flags, is_unknown), (unknown, is_relative));
        host.set_baseline(&[62.0; ROWS * COLS]);
        // However little a frame is novel, it is flagged.
        let hardly = (65..900).map(|ohm| ohm as f32).find(|ohm| {
            let sent = expected(&blob, &with_last(*ohm), baseline_ohm);
            sent.novelty.is_some_and(|novelty| (1e-6..1.0).contains(&f32::from_bits(novelty)))
        });
        for (ohm, novel) in [(65.0, false), (64.0, false), (hardly.unwrap(), true), (900.0, true)] {
            let (found, flags) = decode(&mut host, &with_last(ohm));
            assert_eq!(found, expected(&blob, &with_last(ohm), baseline_ohm), "{ohm}");
            assert_ne!(flags & EstimateReport::CONTACT, 0, "{ohm}: a flag of its own is lost");
            assert_eq!((found.is_novel, found.deviations.len()), (novel, ROWS * OUTPUTS), "{ohm}");
        }
        let s = host.statistics();
        assert_eq!(s.frames_novel, 2);
        assert!(s.longest_confidence_us > 0 && s.longest_confidence_cycles > 0, "{s:?}");
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

#[test]
fn a_faulty_reading_is_filled_before_a_frame_is_assessed_and_two_leave_it_unknown() {
    for (is_relative, baseline_ohm) in [(false, f32::NAN), (true, 62.0)] {
        let blob = blob_with_readings(is_relative);
        let mut host = started(quiet(), &blob);
        host.set_baseline(&[62.0; ROWS * COLS]);
        let mut filled = with_last(f32::NAN);
        let decoder = Decoder::<ROWS>::load(&blob).unwrap();
        let reciprocals = [reciprocal(baseline_ohm); ROWS * COLS];
        let mut scratch = vec![0.0; decoder.scratch_floats()];
        assert_eq!(decoder.fill(filled.as_flattened_mut(), &reciprocals, &mut scratch), 1);
        for bad in [f32::NAN, 0.0, f32::INFINITY, 2000.0, -60.0] {
            let (found, flags) = decode(&mut host, &with_last(bad));
            assert_ne!(flags & EstimateReport::FAULTY_READING, 0, "{bad}");
            assert_eq!(found, expected(&blob, &filled, baseline_ohm), "{bad}");
            assert!(found.novelty.is_some_and(|it| f32::from_bits(it) < 0.0), "{found:?}");
            let mut frame = with_last(bad);
            frame[0][0] = bad;
            let (found, flags) = decode(&mut host, &frame);
            assert_ne!(flags & EstimateReport::FAULTY_READING, 0, "{bad}");
            assert!(found.novelty.is_some_and(|it| f32::from_bits(it).is_nan()), "{found:?}");
            assert!(found.deviations.iter().all(|it| f32::from_bits(*it).is_nan()), "{found:?}");
        }
    }
}

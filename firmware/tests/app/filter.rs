//! The filter in time, and reports of every n-th scan.

use taxel_core::blob::Floats;
use taxel_core::filter::State;
use taxel_core::{Decoder, Estimate, RowStatus};
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::{Configuration, Report, Request};

use crate::mock::*;

/// A configuration that filters, and scans only on request.
fn filtering() -> Configuration {
    Configuration { filter_time_constant_us: 4000, filter_lead_us: 1500, ..quiet() }
}

/// Frames of a touch that deepens.
fn touch(frame: usize) -> TestFrame {
    frame_at_rest().map(|row| row.map(|ohm| ohm - 0.7 * frame as f32 - 0.4 * (frame % 3) as f32))
}

/// Bits of the outputs for a frame of the touch, a millisecond for each.
fn decode(host: &mut Host<'_, '_>, frame: usize) -> Vec<u32> {
    let start_us = 1000 * frame as u64;
    host.estimate(start_us, touch(frame).as_flattened(), |it| bits(it.outputs.iter()))
}

#[test]
fn whatever_changes_what_outputs_mean_starts_the_filter_anew() {
    let first = blob(3, 4);
    let rest = frame_at_rest();
    let circuit = ZeroPotential::<ROWS, COLS> { drive_v: 0.21, ..ZeroPotential::TYPICAL };
    let other = Configuration { filter_lead_us: 1501, ..filtering() };
    for (request, is_new) in [
        (Request::Identify, false),
        (Request::Configure(filtering()), false), // in force already
        (Request::Configure(other), true),
        (Request::SetBaseline { readings_ohm: Floats::new(rest.as_flattened()) }, true),
        (Request::SetConstants(circuit.constants()), true),
    ] {
        let mut host = started(filtering(), &first);
        (0..3).for_each(|frame| _ = decode(&mut host, frame));
        host.ask(&request, |report| assert!(!matches!(report, Report::Refused(_)), "{report:?}"));
        let raw = expected(&first, &touch(3));
        assert_eq!(decode(&mut host, 3) == raw, is_new, "{request:?}");
    }
    // Another model, too.
    let next = blob(5, 4);
    let mut bench = Bench::new(filtering(), &first);
    decode(&mut bench.session(), 0);
    bench.install(&next).unwrap();
    assert_eq!(decode(&mut bench.session(), 1), expected(&next, &touch(1)));
}

#[test]
fn every_scan_is_filtered_when_only_some_are_reported() {
    let blob = blob(3, 4);
    let scanning = Configuration { frame_period_us: 1000, ..filtering() };
    let mut host =
        started(Configuration { report_every: 3, send_readings: true, ..scanning }, &blob);
    let other = touch(9);
    let readings_ohm = Floats::new(other.as_flattened());
    for frame in 1..=10 {
        *host.frame() = touch(frame);
        host.run_until(1000 * frame as u32 + 200);
        // What a host wants decoded is not of that series.
        host.send(9, &Request::Decode { frame: 5, start_us: 0, readings_ohm });
    }
    // Of each scan what taxel-core's own filter makes, and what was sent of some.
    let decoder = Decoder::<ROWS>::load(&blob).unwrap();
    let mut state = State::new([[0.0; 2]; ROWS * OUTPUTS]);
    let (mut wanted, mut found) = (Vec::new(), Vec::new());
    host.find(|number, report| {
        match (number, report) {
            (0, Report::Readings { frame, start_us, .. }) => {
                let touch = touch(frame as usize);
                let mut outputs = decoder.decode(touch.as_flattened()).unwrap().outputs;
                let status = &mut [RowStatus::Decoded; ROWS];
                let mut estimate = Estimate { outputs: &mut outputs, status };
                state.filter(filtering().filter(), start_us, &mut estimate);
                wanted.push((frame, start_us, bits(outputs)));
            }
            (0, Report::Estimate(it)) => {
                found.push((it.frame, it.start_us, bits(it.outputs.iter())));
            }
            (9, Report::Estimate(it)) => {
                assert_eq!(bits(it.outputs.iter()), expected(&blob, &other));
            }
            _ => {}
        }
        None::<()>
    });
    assert_eq!(wanted.len(), 10);
    wanted.retain(|(frame, ..)| [3, 6, 9].contains(frame));
    assert_eq!(found, wanted);
    // Faults are told with the estimate.
    host.frame()[0][0] = f32::NAN;
    host.pins_mut().to_host.clear();
    host.run_until(16_200);
    let mut health = host.answers(0);
    health.retain(|text| text.starts_with("Health"));
    assert!(health.len() == 2 && health[1].contains("frame: 15"), "{health:?}");
    let s = host.statistics();
    assert_eq!((s.frames_scanned, s.frames_decoded), (16, 16 + 10)); // and what was asked
}

#[test]
fn the_latency_lasts_until_the_last_byte_is_taken() {
    let mut host = started(every(10_000), &blob(3, 4));
    let mut latencies = Vec::new();
    for gap_us in [0, 20] {
        host.pins_mut().gap_us = gap_us;
        host.pins_mut().to_host.clear();
        host.run_for(25_000);
        let bytes = host.pins().to_host.len() as u32 / 2; // two estimates
        host.pins_mut().gap_us = 0;
        latencies.push((host.statistics().longest_latency_us, bytes));
    }
    let [(fast_us, bytes), (slow_us, _)] = latencies[..] else { panic!("two") };
    assert!((10..60).contains(&fast_us), "{latencies:?}"); // the scan, and a look at the clock now and then
    let line_us = 20 * (bytes - 1);
    assert!((line_us + 1..line_us + 200).contains(&slow_us), "{latencies:?}");
    // An answer to a request has no scan.
    decode(&mut host, 0);
    assert_eq!(host.statistics().longest_latency_us, slow_us);
}

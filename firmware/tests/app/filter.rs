//! The filter in time, and reports of every n-th scan.

use taxel_core::blob::Floats;
use taxel_core::filter::State;
use taxel_core::{Estimate, RowStatus};
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::{Configuration, Report, Request};

use super::requests::{bits, decode_at, expected};
use crate::mock::*;

/// A configuration that filters, and scans only on request.
fn filtering() -> Configuration {
    Configuration { filter_time_constant_us: 4000, filter_lead_us: 1500, ..quiet() }
}

/// Frames of a touch that deepens.
fn touch(frame: usize) -> TestFrame {
    frame_at_rest().map(|row| row.map(|ohm| ohm - 0.7 * frame as f32 - 0.4 * (frame % 3) as f32))
}

/// The filter of the device as taxel-core computes it.
struct Own {
    blob: taxel_core::AlignedBytes,
    state: State<[[f32; 2]; ROWS * OUTPUTS]>,
}

impl Own {
    fn new(seed: usize) -> Self {
        Self { blob: blob(seed, 4), state: State::new([[0.0; 2]; ROWS * OUTPUTS]) }
    }

    /// Bits of the outputs for a frame at this time.
    fn bits(&mut self, start_us: u64, frame: &TestFrame) -> Vec<u32> {
        let (mut outputs, mut status) = (expected(&self.blob, frame), [RowStatus::Decoded; ROWS]);
        let outputs = outputs.as_flattened_mut();
        let mut estimate = Estimate { outputs, status: &mut status };
        self.state.filter(filtering().filter(), start_us, &mut estimate);
        bits(outputs.iter().copied())
    }
}

/// Estimates that were sent unasked: number of the frame, its time, and its bits.
fn estimates_of_scans(board: &Board) -> Vec<(u32, u64, Vec<u32>)> {
    let mut found = Vec::new();
    find_report(&board.pins.borrow().to_host, |number, report| -> Option<()> {
        if let (0, Report::Estimate(e)) = (number, report) {
            found.push((e.frame, e.start_us, bits(e.outputs.iter())));
        }
        None
    });
    found
}

#[test]
fn whatever_changes_what_outputs_mean_starts_the_filter_anew() {
    let own = Own::new(3);
    let rest = frame_at_rest();
    let set_baseline = Request::SetBaseline { readings_ohm: Floats::new(rest.as_flattened()) };
    let circuit = ZeroPotential::<ROWS, COLS> { drive_v: 0.21, ..ZeroPotential::TYPICAL };
    let constants = circuit.constants();
    let other = Configuration { filter_lead_us: 1501, ..filtering() };
    for (request, is_new) in [
        (Request::Identify, false),
        (Request::Configure(filtering()), false), // in force already
        (Request::Configure(other), true),
        (set_baseline, true),
        (Request::SetConstants(constants), true),
    ] {
        let (mut session, board) = started(filtering(), &own.blob);
        for frame in 0..3 {
            decode_at(&mut session, &board, 1000 * frame as u64, &touch(frame));
        }
        ask(&mut session, &board, &request, |report| {
            assert!(!matches!(report, Report::Refused(_)), "{report:?}");
        });
        let (.., found) = decode_at(&mut session, &board, 3000, &touch(3));
        let raw = bits(expected(&own.blob, &touch(3)).into_iter().flatten());
        assert_eq!(found == raw, is_new, "{request:?}");
    }
    // Another model, too.
    let next = Own::new(5);
    let mut bench = Bench::new(filtering(), &own.blob);
    let (mut session, board) = bench.session();
    decode_at(&mut session, &board, 0, &touch(0));
    bench.install(&next.blob).unwrap();
    let (mut session, board) = bench.session();
    let (.., found) = decode_at(&mut session, &board, 1000, &touch(1));
    assert_eq!(found, bits(expected(&next.blob, &touch(1)).into_iter().flatten()));
}

#[test]
fn one_scan_of_some_is_reported_and_all_are_filtered_whatever_is_asked_between_them() {
    let mut own = Own::new(3);
    let scanning = Configuration { frame_period_us: 1000, ..filtering() };
    let (mut session, board) =
        started(Configuration { report_every: 3, send_readings: true, ..scanning }, &own.blob);
    let mut faulty = touch(2);
    faulty[0][0] = f32::NAN;
    let raw = bits(expected(&own.blob, &touch(9)).into_iter().flatten());
    let other = touch(9);
    let between =
        Request::Decode { frame: 5, start_us: 0, readings_ohm: Floats::new(other.as_flattened()) };
    let shown = board.frame.clone();
    for frame in 1..=10 {
        *shown.borrow_mut() = touch(frame);
        run_until(&mut session, &board, 1000 * frame as u32 + 200);
        // What a host wants decoded is not of that series.
        send(&mut session, &board, 9, &between);
    }
    let mut wanted = Vec::new();
    find_report(&board.pins.borrow().to_host, |number, report| -> Option<()> {
        match (number, report) {
            (0, Report::Readings { frame, start_us, .. }) => {
                wanted.push((frame, start_us, own.bits(start_us, &touch(frame as usize))));
            }
            (9, Report::Estimate(answer)) => assert_eq!(bits(answer.outputs.iter()), raw),
            _ => {}
        }
        None
    });
    assert_eq!(wanted.len(), 10);
    wanted.retain(|(frame, ..)| [3, 6, 9].contains(frame));
    assert_eq!(estimates_of_scans(&board), wanted);
    // Faults are told with the estimate.
    *shown.borrow_mut() = faulty;
    board.pins.borrow_mut().to_host.clear();
    run_until(&mut session, &board, 16_200);
    let all = reports(&board.pins.borrow().to_host);
    let health: Vec<_> = all.iter().filter(|(_, text)| text.starts_with("Health")).collect();
    assert!(health.len() == 2 && health[1].1.contains("frame: 15"), "{health:?}");
    let s = statistics(&mut session, &board);
    assert_eq!((s.frames_scanned, s.frames_decoded), (16, 16 + 10)); // and what was asked
}

#[test]
fn the_latency_lasts_until_the_last_byte_is_taken() {
    let (mut session, board) = started(every(10_000), &blob(3, 4));
    let mut latencies = Vec::new();
    for gap_us in [0, 20] {
        board.pins.borrow_mut().gap_us = gap_us;
        let end_us = board.pins.borrow().now_us + 25_000;
        board.pins.borrow_mut().to_host.clear();
        run_until(&mut session, &board, end_us);
        let bytes = board.pins.borrow().to_host.len() as u32 / 2; // two estimates
        board.pins.borrow_mut().gap_us = 0;
        latencies.push((statistics(&mut session, &board).longest_latency_us, bytes));
    }
    let [(fast_us, bytes), (slow_us, _)] = latencies[..] else { panic!("two") };
    assert!((10..60).contains(&fast_us), "{latencies:?}"); // the scan, and a look at the clock now and then
    let line_us = 20 * (bytes - 1);
    assert!((line_us + 1..line_us + 200).contains(&slow_us), "{latencies:?}");
    // An answer to a request has no scan.
    decode_at(&mut session, &board, 0, &touch(0));
    assert_eq!(statistics(&mut session, &board).longest_latency_us, slow_us);
}

//! Scans that go on by themselves while the frame before is decoded.

use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::{Configuration, Report, Request};

use taxel_core::blob::{Columns, Metadata, ModelShape};

use super::requests::decode;
use crate::mock::*;

/// A session with a model on a board whose sensor scans by itself for `scan_us` and 10 µs.
fn started_alone(period_us: u32, scan_us: u32) -> (TestSession<'static>, Board) {
    let configuration = Configuration { send_readings: true, ..every(period_us) };
    let (session, board) = started(configuration, &blob(3, 4));
    let mut pins = board.pins.borrow_mut();
    (pins.scans_alone, pins.scan_us) = (true, scan_us);
    drop(pins);
    (session, board)
}

/// Runs turns of the loop until so many scans were started.
fn run_until_started(session: &mut TestSession<'_>, board: &Board, started: u32) {
    while board.pins.borrow().started < started {
        assert_eq!(session.step(), None);
    }
}

/// Number of each frame whose readings were reported, when its scan began, and its first reading.
fn readings(board: &Board) -> Vec<(u32, u64, f32)> {
    let mut found = Vec::new();
    find_report(&board.pins.borrow().to_host, |_, report| {
        if let Report::Readings { frame, start_us, readings_ohm } = report {
            found.push((frame, start_us, readings_ohm.iter().next().unwrap()));
        }
        None::<()>
    });
    found
}

#[test]
fn the_next_frame_is_scanned_while_one_is_decoded_and_none_is_missed() {
    for alone in [true, false] {
        let (mut session, board) = started_alone(1000, 790);
        // Reports take longer than the scan leaves of a period.
        let mut pins = board.pins.borrow_mut();
        (pins.scans_alone, pins.gap_us) = (alone, 7);
        drop(pins);
        run_until(&mut session, &board, 40_000);
        let frames = readings(&board);
        let s = statistics(&mut session, &board);
        assert_eq!((s.frames_decoded, s.lost_reports), (s.frames_scanned, 0));
        if !alone {
            assert!(s.frames_missed > 3, "{s:?}");
            continue;
        }
        assert_eq!((s.frames_missed, s.failed_samples), (0, 0));
        assert!(s.longest_scan_us >= 800 && frames.len() >= 38, "{s:?}");
        // Each begins in a period of its own.
        for (index, (frame, start_us, _)) in frames.into_iter().enumerate() {
            assert_eq!((frame, start_us / 1000), (index as u32 + 1, index as u64 + 1));
        }
    }
}

#[test]
fn a_scan_under_way_is_given_up_when_what_it_is_of_changes() {
    let (mut session, board) = started_alone(1000, 500);
    let mut constants = ZeroPotential::<ROWS, COLS>::TYPICAL;
    constants.drive_v = 0.21;
    let slower = Configuration { frame_period_us: 2000, send_readings: true, ..quiet() };
    let changes = [
        Request::Configure(slower),
        Request::SetConstants(constants.constants()),
        Request::CaptureBaseline { frames: 1 },
    ];
    for (index, change) in changes.iter().enumerate() {
        let started = board.pins.borrow().started;
        run_until_started(&mut session, &board, started + 1);
        // What the scan has read so far belongs to no frame any more.
        board.frame.borrow_mut()[0][0] = 70.0 + index as f32;
        board.pins.borrow_mut().to_host.clear();
        let (stopped, changed_us) = (board.pins.borrow().stopped, board.pins.borrow().now_us);
        send(&mut session, &board, 9, change);
        assert_eq!(board.pins.borrow().stopped, stopped + 1, "{change:?}");
        while readings(&board).is_empty() {
            session.step();
        }
        let (_, start_us, first_ohm) = readings(&board)[0];
        assert!(start_us > u64::from(changed_us), "{change:?}");
        assert_eq!(first_ohm.to_bits(), (70.0 + index as f32).to_bits(), "{change:?}");
    }
    // The baseline is of the one frame that began behind the request: 72 Ω as bytes.
    let all = reports(&board.pins.borrow().to_host);
    assert!(
        all.iter().any(|(number, text)| *number == 9 && text.contains("[0, 0, 144, 66")),
        "{all:?}"
    );
    // Nothing is given up where nothing changes.
    let (started, stopped) = (board.pins.borrow().started, board.pins.borrow().stopped);
    run_until_started(&mut session, &board, started + 1);
    tell(&mut session, &board, &Request::Configure(slower));
    assert_eq!(board.pins.borrow().stopped, stopped);
    assert_eq!(statistics(&mut session, &board).frames_missed, 0);
}

#[test]
fn a_scan_of_other_wires_is_given_up_when_a_model_comes_into_force() {
    let mut bench = Bench::new(every(1000), &[]);
    let (mut session, board) = bench.session();
    board.pins.borrow_mut().scans_alone = true;
    board.pins.borrow_mut().scan_us = 500;
    run_until_started(&mut session, &board, 1);
    let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    let metadata =
        Metadata { input_names: Columns("r2c1_ohm\nr2c3_ohm"), ..Metadata::unnamed(shape) };
    bench.slots = Flash::slots_with(&blob_of_a_row(shape, metadata));
    let (mut session, board) = bench.session();
    assert_eq!(board.pins.borrow().stopped, 1);
    run_until_started(&mut session, &board, 3);
    // It has as many readings as the model: the mock panics for another number.
    assert!(statistics(&mut session, &board).frames_decoded >= 1);
}

#[test]
fn a_scan_that_never_ends_is_a_silent_sensor_which_tells_what_it_finds() {
    let (mut session, board) = started_alone(1000, 1_000_000_000);
    run_until_started(&mut session, &board, 1);
    board.pins.borrow_mut().look_us = 1000;
    while board.pins.borrow().stopped == 0 {
        assert_eq!(session.step(), None); // and the host is served
        assert!(board.pins.borrow().now_us < 2_100_000, "the scan has no end");
    }
    let (fed, now_us) = (board.pins.borrow().feeds, board.pins.borrow().now_us);
    run_until(&mut session, &board, now_us + 6_000_000);
    assert_eq!(board.pins.borrow().feeds, fed, "the watchdog is fed");
    assert!(board.pins.borrow().started > 2, "it is not tried again");
    let frames = readings(&board);
    let all = reports(&board.pins.borrow().to_host);
    let told = all.iter().filter(|(number, text)| *number == 0 && text.contains("Diagnosis"));
    assert_eq!(told.count(), frames.len(), "one for each scan");
    let s = statistics(&mut session, &board);
    assert_eq!(s.failed_samples, s.frames_scanned * (ROWS * COLS) as u32);
    assert!(!frames.is_empty() && frames.iter().all(|(.., first_ohm)| first_ohm.is_nan()));
}

#[test]
fn what_a_host_wants_decoded_disturbs_no_scan() {
    let (mut session, board) = started_alone(1000, 500);
    run_until_started(&mut session, &board, 1);
    decode(&mut session, &board, &[[33.0; COLS]; ROWS]);
    assert!(readings(&board).is_empty());
    run_until_started(&mut session, &board, 2);
    assert_eq!(readings(&board)[0].2.to_bits(), frame_at_rest()[0][0].to_bits());
    assert_eq!(board.pins.borrow().stopped, 0);
}

//! Configurations, and leases on them.

use taxel_firmware::app::Session;
use taxel_firmware::link::message::{Configuration, ConfigurationField, Refusal, Report, Request};

use super::requests::decode;
use mock_board::*;

#[test]
fn configurations_are_checked_and_a_bad_one_changes_nothing() {
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let mut outcome = |configuration| {
        ask(&mut session, &bench.board, &configure(configuration), |report| match report {
            Report::Configuration { configuration, .. } => Ok(configuration),
            Report::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        })
        .0
    };
    let good = Configuration { frame_period_us: 20_000, send_readings: true, ..quiet() };
    assert_eq!(outcome(good), Ok(good));
    let bad = Configuration { frame_period_us: 1, ..good };
    let refusal = Refusal::Configuration(ConfigurationField::FramePeriod);
    assert_eq!(outcome(bad), Err(refusal));
    let (in_force, _) = ask(&mut session, &bench.board, &Request::Configuration, |r| match r {
        Report::Configuration { configuration, .. } => configuration,
        other => panic!("{other:?}"),
    });
    assert_eq!(in_force, good);
}

/// Configuration in force, and what is left of its lease in ms.
fn in_force(session: &mut TestSession<'_>, board: &Board) -> (Configuration, u32) {
    ask(session, board, &Request::Configuration, |report| match report {
        Report::Configuration { configuration, lease_left_ms } => (configuration, lease_left_ms),
        other => panic!("{other:?}"),
    })
    .0
}

#[test]
fn a_leased_configuration_ends_with_the_hosts_silence_and_a_lasting_one_does_not() {
    let own = Configuration { frame_period_us: 10_000, ..quiet() };
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(own);
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let wait = |session: &mut TestSession<'_>, ms: u32| {
        board.pins.borrow_mut().now_us += 1000 * ms;
        session.step();
    };
    let paused = Request::Configure { configuration: quiet(), lease_ms: 500 };
    let left = |ms: u32| ms - 5..=ms; // some microseconds pass at each look
    for _ in 0..2 {
        ask(&mut session, &board, &paused, |_| ());
        let scanned = statistics(&mut session, &board).frames_scanned;
        wait(&mut session, 400);
        // Who only asks does not prolong the lease; any other request does.
        let (configuration, left_ms) = in_force(&mut session, &board);
        assert_eq!(configuration, quiet());
        assert!(left(101).contains(&left_ms), "{left_ms}");
        decode(&mut session, &board, &frame_at_rest());
        wait(&mut session, 400);
        assert!(left(101).contains(&in_force(&mut session, &board).1));
        assert_eq!(statistics(&mut session, &board).frames_scanned, scanned);
        wait(&mut session, 100);
        assert_eq!(in_force(&mut session, &board), (own, 0));
        wait(&mut session, 10);
        assert_eq!(statistics(&mut session, &board).frames_scanned, scanned + 1);
    }
    // A host that says goodbye need not be waited for.
    ask(&mut session, &board, &paused, |_| ());
    assert_eq!(ask(&mut session, &board, &Request::Resume, |_| ()).1, None);
    assert_eq!(in_force(&mut session, &board), (own, 0));
    // A configuration without a lease becomes the device's own.
    let lasting = Configuration { frame_period_us: 20_000, ..quiet() };
    ask(&mut session, &board, &configure(lasting), |_| ());
    ask(&mut session, &board, &paused, |_| ());
    wait(&mut session, 501);
    assert_eq!(in_force(&mut session, &board), (lasting, 0));
    wait(&mut session, 3_600_000);
    assert_eq!(in_force(&mut session, &board), (lasting, 0));
}

#[test]
fn a_request_that_waited_during_a_long_scan_prolongs_a_lease_in_time() {
    let own = quiet();
    let slow = Configuration { frame_period_us: 1000, ..quiet() };
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(own);
    bench.board.pins.borrow_mut().scan_us = 700_000;
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let leased = Request::Configure { configuration: slow, lease_ms: 500 };
    ask(&mut session, &board, &leased, |_| ());
    board.pins.borrow_mut().now_us += 1000;
    for _ in 0..5 {
        // It arrives at the start of a scan, and waits for the scan's end.
        session.step();
        board.pins.borrow_mut().to_device.extend(request_bytes(5, &leased));
    }
    settle(&mut session, &board);
    assert_eq!(in_force(&mut session, &board).0, slow);
    for _ in 0..2 {
        session.step();
    }
    assert_eq!(in_force(&mut session, &board).0, own);
}

#[test]
fn a_lease_that_ends_gives_up_the_baseline_and_keeps_time() {
    let own = Configuration { frame_period_us: 1_000_000, ..quiet() };
    let mut slots = Flash::slots_with(&blob(3, 4));
    let mut bench = Bench::new(own);
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let leased = Request::Configure {
        configuration: Configuration { frame_period_us: 1000, ..quiet() },
        lease_ms: 100,
    };
    ask(&mut session, &board, &leased, |_| ());
    let request = request_bytes(9, &Request::CaptureBaseline { frames: 1000 });
    board.pins.borrow_mut().to_device.extend(request);
    settle(&mut session, &board);
    while board.pins.borrow().now_us < 50_000 {
        session.step();
    }
    // The same lease again changes nothing: frames stay in time, and the baseline goes on.
    let before = statistics(&mut session, &board).frames_scanned;
    for _ in 0..20 {
        ask(&mut session, &board, &leased, |_| ());
    }
    let start_us = board.pins.borrow().now_us;
    while board.pins.borrow().now_us < start_us + 20_000 {
        session.step();
        assert!(!reports(&board.pins.borrow().to_host).iter().any(|(number, _)| *number == 9));
    }
    let scanned = statistics(&mut session, &board).frames_scanned - before;
    assert!((20..=22).contains(&scanned), "{scanned}");
    board.pins.borrow_mut().to_host.clear();
    while board.pins.borrow().now_us < start_us + 150_000 {
        session.step();
    }
    let refused = (9, format!("{:?}", Report::Refused(Refusal::Baseline)));
    assert!(reports(&board.pins.borrow().to_host).contains(&refused));
    assert_eq!(in_force(&mut session, &board), (own, 0));
}

//! The application loop on a virtual board.

mod common;

use common::*;
use firmware::app::{Leave, Session};
use firmware::link::message::{
    Configuration, ConfigurationField, EstimateReport, Refusal, Report, Request, Statistics,
};
use firmware::link::packet;
use firmware::link::receive::{Received, Receiver};
use model_core::blob::{Columns, Floats, Metadata, Model, ModelParts, ModelShape, encode_to_vec};
use model_core::checksum::CRC_32;
use model_core::rbf::Shape;
use model_core::rbf::direct::{self, Parameters};
use model_core::{Aligned, AlignedBytes, Decoder};

fn statistics(session: &mut TestSession<'_>, board: &Board) -> Statistics {
    ask(session, board, &Request::Statistics, |report| match report {
        Report::Statistics(statistics) => statistics,
        other => panic!("{other:?}"),
    })
    .0
}

/// Outputs of model-core itself.
fn expected(blob: &[u8], frame: &TestFrame) -> [[f32; OUTPUTS]; ROWS] {
    let mut aligned = Aligned([0; 2048]);
    aligned.0[..blob.len()].copy_from_slice(blob);
    let decoder = Decoder::<ROWS>::load(&aligned.0[..blob.len()]).unwrap();
    let outputs = decoder.decode(frame.as_flattened()).unwrap().outputs;
    std::array::from_fn(|row| outputs.as_chunks().0[row])
}

fn bits(values: impl Iterator<Item = f32>) -> Vec<u32> {
    values.map(f32::to_bits).collect()
}

/// Asks for an estimate of `frame`, and returns its flags, row status and bits.
fn decode(
    session: &mut TestSession<'_>,
    board: &Board,
    frame: &TestFrame,
) -> (u8, Vec<u8>, Vec<u32>) {
    let readings_ohm = Floats::of(frame.as_flattened());
    let request = Request::Decode { frame: 5, readings_ohm };
    ask(session, board, &request, |report| match report {
        Report::Estimate(e) => {
            assert_eq!(e.frame, 5);
            (e.flags, e.row_status.to_vec(), bits(e.outputs.iter()))
        }
        other => panic!("{other:?}"),
    })
    .0
}

#[test]
fn readings_from_the_host_are_decoded_as_model_core_does() {
    let blob = blob(3, 4);
    let mut slots = MockSlot::pair_with(&blob);
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let frame = frame_at_rest();
    let (flags, status, found) = decode(&mut session, &bench.board, &frame);
    assert_eq!((flags, &status[..]), (0, &[0, 0][..]));
    assert_eq!(found, bits(expected(&blob, &frame).into_iter().flatten()));
}

#[test]
fn a_faulty_reading_spoils_its_row_alone_and_is_told() {
    let blob = blob(3, 4);
    let mut slots = MockSlot::pair_with(&blob);
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let good = frame_at_rest();
    for bad in [f32::NAN, 0.0, f32::INFINITY, 1.0, 2000.0, -60.0] {
        let mut frame = good;
        frame[0][2] = bad;
        let (flags, status, found) = decode(&mut session, &bench.board, &frame);
        assert_eq!((flags, &status[..]), (EstimateReport::FAULTY_READING, &[1, 0][..]), "{bad}");
        assert!(found[..OUTPUTS].iter().all(|value| f32::from_bits(*value).is_nan()));
        assert_eq!(found[OUTPUTS..], bits(expected(&blob, &good)[1].into_iter()));
    }
}

#[test]
fn without_a_model_the_answer_says_so() {
    let mut slots = MockSlot::pair();
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let (flags, status, found) = decode(&mut session, &bench.board, &frame_at_rest());
    assert_eq!((flags, &status[..]), (EstimateReport::NO_MODEL, &[1, 1][..]));
    assert!(found.is_empty());
}

#[test]
fn a_frame_of_another_length_is_refused() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    for readings in [&[60.0; 5][..], &[60.0; 7], &[]] {
        let request = Request::Decode { frame: 0, readings_ohm: Floats::of(readings) };
        let (refused, _) = ask(&mut session, &bench.board, &request, |report| {
            report == Report::Refused(Refusal::FrameLength { expected: 6 })
        });
        assert!(refused);
    }
}

#[test]
fn frames_are_scanned_on_time_numbered_and_reported() {
    let blob = blob(3, 4);
    let mut slots = MockSlot::pair_with(&blob);
    let configuration = Configuration { frame_period_us: 1000, send_readings: true, ..quiet() };
    let mut bench = Bench::new(configuration);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    while bench.board.0.borrow().now_us < 5500 {
        assert_eq!(session.step(), None);
    }
    let reports = reports(&bench.board.0.borrow().to_host);
    assert_eq!(reports.len(), 10, "{reports:?}"); // readings and estimate, five times
    for (i, (number, text)) in reports.iter().enumerate() {
        assert_eq!(*number, 0);
        let kind = if i % 2 == 0 { "Readings { " } else { "Estimate(EstimateReport { " };
        let start = format!("{kind}frame: {}, start_us: {}", i / 2 + 1, i / 2 + 1);
        assert!(text.starts_with(&start), "{text} instead of {start}");
    }
    let s = statistics(&mut session, &bench.board);
    assert_eq!((s.frames_scanned, s.frames_decoded, s.frames_missed), (5, 5, 0));
    assert!(s.longest_scan_us >= 10 && s.longest_scan_us < 20);
}

#[test]
fn a_scan_longer_than_the_period_is_an_overrun() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let configuration = Configuration { frame_period_us: 100, ..quiet() };
    let mut bench = Bench::new(configuration);
    let board = bench.board.clone();
    let source = Source::new(&bench.frame, &board, 250);
    bench.app = TestApp::new(board.clone(), source, configuration, buffers());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    while board.0.borrow().now_us < 2000 {
        session.step();
    }
    let all = reports(&board.0.borrow().to_host);
    let flagged =
        |flag: u8| all.iter().filter(|(_, t)| t.contains(&format!("flags: {flag},"))).count();
    assert_eq!(flagged(0), 1, "{all:?}"); // the first was on time
    assert_eq!(flagged(EstimateReport::OVERRUN), all.len() - 1);
    let s = statistics(&mut session, &board);
    assert!(s.frames_missed >= s.frames_scanned - 1, "{s:?}");
}

#[test]
fn the_watchdog_is_fed_by_good_loops_only() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    let feeds = || board.0.borrow().feeds;
    for _ in 0..50 {
        let before = feeds();
        session.step();
        assert_eq!(feeds(), before + 1);
    }
    // With a converter that gives nothing, no loop is good from the next scan on, whether it scans or not.
    *bench.frame.borrow_mut() = [[f32::NAN; COLS]; ROWS];
    let scanned = statistics(&mut session, &board).frames_scanned;
    while statistics(&mut session, &board).frames_scanned == scanned {
        session.step();
    }
    let (fed, bad) = (feeds(), statistics(&mut session, &board).bad_loops);
    for _ in 0..2000 {
        session.step();
    }
    assert_eq!(feeds(), fed);
    assert!(statistics(&mut session, &board).bad_loops >= bad + 2000);
    // One reading is enough.
    bench.frame.borrow_mut()[1][1] = 60.0;
    let scanned = statistics(&mut session, &board).frames_scanned;
    while statistics(&mut session, &board).frames_scanned == scanned {
        session.step();
    }
    let fed = feeds();
    for _ in 0..2000 {
        session.step();
    }
    assert_eq!(feeds(), fed + 2000);
    // Without scans, a silent sensor must not restart the device.
    *bench.frame.borrow_mut() = [[f32::NAN; COLS]; ROWS];
    for _ in 0..2000 {
        session.step();
    }
    ask(&mut session, &board, &configure(quiet()), |_| ());
    let fed = feeds();
    session.step();
    assert_eq!(feeds(), fed + 1);
}

#[test]
fn a_baseline_is_captured_and_contact_is_told_against_it() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    board
        .0
        .borrow_mut()
        .to_device
        .extend(request_bytes(9, &Request::CaptureBaseline { frames: 4 }));
    while !reports(&board.0.borrow().to_host).iter().any(|(number, _)| *number == 9) {
        session.step();
        assert!(board.0.borrow().now_us < 10_000, "no answer");
    }
    let all = reports(&board.0.borrow().to_host);
    let baseline = &all.iter().find(|(number, _)| *number == 9).unwrap().1;
    let rest = Floats::of(&[60.0, 61.0, 62.0, 63.0, 64.0, 65.0]);
    assert_eq!(*baseline, format!("{:?}", Report::Baseline { readings_ohm: rest }));

    let rest = frame_at_rest();
    assert_eq!(decode(&mut session, &board, &rest).0 & EstimateReport::CONTACT, 0);
    let mut pressed = rest;
    pressed[1][0] *= 0.97;
    assert_ne!(decode(&mut session, &board, &pressed).0 & EstimateReport::CONTACT, 0);
    let mut nearly = rest;
    nearly[1][0] *= 0.985;
    assert_eq!(decode(&mut session, &board, &nearly).0 & EstimateReport::CONTACT, 0);
}

/// Captures a baseline of `frames` scans. Then sets a configuration that scans only on request, in which rows are
/// at rest within 2 %.
fn capture(session: &mut TestSession<'_>, board: &Board, frames: u16) {
    let scanning = Configuration { frame_period_us: 100, ..quiet() };
    ask(session, board, &configure(scanning), |_| ());
    let request = request_bytes(9, &Request::CaptureBaseline { frames });
    board.0.borrow_mut().to_device.extend(request);
    board.0.borrow_mut().to_host.clear();
    while !reports(&board.0.borrow().to_host).iter().any(|(number, _)| *number == 9) {
        assert_eq!(session.step(), None);
        assert!(board.0.borrow().now_us < 1_000_000, "no answer");
    }
    let gating = Configuration { rest_tolerance: 0.02, ..quiet() };
    ask(session, board, &configure(gating), |_| ());
}

#[test]
fn rows_at_rest_answer_as_the_baseline_and_the_others_as_without_a_gate() {
    let blob = blob(3, 4);
    let mut slots = MockSlot::pair_with(&blob);
    let mut bench = Bench::new(Configuration { rest_tolerance: 0.02, ..quiet() });
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let rest = frame_at_rest();
    let touched = [[60.5, 60.5, 62.5], [63.0, 64.0, 63.0]];
    let row = |frame: &TestFrame, row: usize| bits(expected(&blob, frame)[row].into_iter());
    let ungated = [row(&touched, 0), row(&touched, 1)].concat();

    // Without a baseline there is no gate.
    let (_, status, found) = decode(&mut session, &board, &touched);
    assert_eq!((&status[..], &found), (&[0, 0][..], &ungated));
    capture(&mut session, &board, 3);
    assert_eq!(statistics(&mut session, &board).rows_at_rest, 0);

    let (_, status, found) = decode(&mut session, &board, &touched);
    assert_eq!(status, [3, 0]);
    assert_eq!(found, [row(&rest, 0), row(&touched, 1)].concat());
    assert_ne!(found, ungated);
    assert_eq!(statistics(&mut session, &board).rows_at_rest, 1);

    // A row with a faulty reading is not at rest.
    let mut faulty = rest;
    faulty[0][1] = f32::NAN;
    assert_eq!(decode(&mut session, &board, &faulty).1, [1, 3]);
    assert_eq!(statistics(&mut session, &board).rows_at_rest, 2);

    // With the gate switched off, or while a new baseline is captured, every row is decoded.
    ask(&mut session, &board, &configure(quiet()), |_| ());
    assert_eq!(decode(&mut session, &board, &touched).2, ungated);
    let scanning = Configuration { frame_period_us: 1_000_000, rest_tolerance: 0.02, ..quiet() };
    ask(&mut session, &board, &configure(scanning), |_| ());
    assert_eq!(decode(&mut session, &board, &rest).1, [3, 3]);
    let again = request_bytes(9, &Request::CaptureBaseline { frames: 1000 });
    board.0.borrow_mut().to_device.extend(again);
    settle(&mut session, &board);
    assert_eq!(decode(&mut session, &board, &rest).1, [0, 0]);
}

#[test]
fn another_model_gives_its_own_answer_for_rest() {
    let (first, second) = (blob(3, 4), blob(5, 4));
    let mut slots = MockSlot::pair_with(&first);
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let mut nearly = frame_at_rest();
    nearly[1][2] = 64.5;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    capture(&mut session, &board, 1);
    let rest = |blob: &[u8]| bits(expected(blob, &frame_at_rest()).into_iter().flatten());
    let (_, status, found) = decode(&mut session, &board, &nearly);
    assert_eq!((&status[..], found), (&[3, 3][..], rest(&first)));
    for step in upload_steps(&second, 64) {
        ask(&mut session, &board, &Request::Upload(step), |_| ());
    }
    let _ = session;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&second)));
    let (_, status, found) = decode(&mut session, &board, &nearly);
    assert_eq!((&status[..], found), (&[3, 3][..], rest(&second)));
}

#[test]
fn a_frame_without_a_baseline_is_flagged_until_one_is_complete() {
    let absolute = blob(3, 4);
    let model = Model::decode(&absolute).unwrap();
    let networks: Vec<_> = model.networks().collect();
    let metadata = Metadata { relative_inputs: true, ..Metadata::unnamed(model.shape()) };
    let parts =
        ModelParts { projection: None, networks: &networks, row_network: &[0; ROWS], metadata };
    let mut slots = MockSlot::pair_with(&encode_to_vec(&parts).unwrap());
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
        ask(session, &board, &configure(scanning), |_| ());
        let request = request_bytes(8, &Request::CaptureBaseline { frames: 1000 });
        board.0.borrow_mut().to_device.extend(request);
        settle(session, &board);
    };
    let scan_some = |session: &mut TestSession<'_>| {
        let until_us = board.0.borrow().now_us + 1000;
        while board.0.borrow().now_us < until_us {
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
    ask(&mut session, &board, &configure(quiet()), |_| ());
    assert_eq!(read(&mut session), decoded);
    // While another is captured, and if that is given up, readings are relative to the one before.
    begin(&mut session);
    assert_eq!(read(&mut session), decoded);
    scan_some(&mut session);
    assert_eq!(read(&mut session), decoded);
    ask(&mut session, &board, &configure(quiet()), |_| ());
    assert_eq!(read(&mut session), decoded);
    // A baseline of no known reading is none.
    let unknown = Request::SetBaseline { readings_ohm: Floats::of(&[f32::NAN; ROWS * COLS]) };
    ask(&mut session, &board, &unknown, |_| ());
    assert_eq!(read(&mut session), without);
}

#[test]
fn a_baseline_that_will_not_come_is_refused_and_one_that_comes_is_counted_once() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    let say = |session: &mut TestSession<'_>, number: u16, request: &Request<'_>| {
        board.0.borrow_mut().to_device.extend(request_bytes(number, request));
        settle(session, &board);
    };
    let refused = format!("{:?}", Report::Refused(Refusal::Baseline));
    let answer = |number: u16| {
        let all = reports(&board.0.borrow().to_host);
        all.into_iter()
            .filter(|(found, _)| *found == number)
            .map(|(_, text)| text)
            .collect::<Vec<_>>()
    };
    // Another capture, and then a configuration without scans, end the previous capture.
    say(&mut session, 10, &Request::CaptureBaseline { frames: 1000 });
    say(&mut session, 11, &Request::CaptureBaseline { frames: 1000 });
    assert_eq!(answer(10), [refused.as_str()]);
    say(&mut session, 12, &configure(quiet()));
    assert_eq!(answer(11), [refused.as_str()]);
    say(&mut session, 13, &Request::CaptureBaseline { frames: 1 });
    assert_eq!(answer(13), [refused]);
    // The same request again goes on counting.
    say(&mut session, 14, &configure(Configuration { frame_period_us: 100, ..quiet() }));
    say(&mut session, 15, &Request::CaptureBaseline { frames: 3 });
    say(&mut session, 15, &Request::CaptureBaseline { frames: 3 });
    while answer(15).is_empty() {
        assert!(board.0.borrow().now_us < 100_000, "no answer");
        session.step();
    }
    for _ in 0..2000 {
        session.step();
    }
    assert_eq!(answer(15).len(), 1);
}

#[test]
fn configurations_are_checked_and_a_bad_one_changes_nothing() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
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
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(own);
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let wait = |session: &mut TestSession<'_>, ms: u32| {
        board.0.borrow_mut().now_us += 1000 * ms;
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
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(own);
    let board = bench.board.clone();
    let source = Source::new(&bench.frame, &board, 700_000);
    bench.app = TestApp::new(board.clone(), source, own, buffers());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let leased = Request::Configure { configuration: slow, lease_ms: 500 };
    ask(&mut session, &board, &leased, |_| ());
    board.0.borrow_mut().now_us += 1000;
    for _ in 0..5 {
        // It arrives at the start of a scan, and waits for the scan's end.
        session.step();
        board.0.borrow_mut().to_device.extend(request_bytes(5, &leased));
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
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(own);
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let leased = Request::Configure {
        configuration: Configuration { frame_period_us: 1000, ..quiet() },
        lease_ms: 100,
    };
    ask(&mut session, &board, &leased, |_| ());
    let request = request_bytes(9, &Request::CaptureBaseline { frames: 1000 });
    board.0.borrow_mut().to_device.extend(request);
    settle(&mut session, &board);
    while board.0.borrow().now_us < 50_000 {
        session.step();
    }
    // The same lease again changes nothing: frames stay in time, and the baseline goes on.
    let before = statistics(&mut session, &board).frames_scanned;
    for _ in 0..20 {
        ask(&mut session, &board, &leased, |_| ());
    }
    let start_us = board.0.borrow().now_us;
    while board.0.borrow().now_us < start_us + 20_000 {
        session.step();
        assert!(!reports(&board.0.borrow().to_host).iter().any(|(number, _)| *number == 9));
    }
    let scanned = statistics(&mut session, &board).frames_scanned - before;
    assert!((20..=22).contains(&scanned), "{scanned}");
    board.0.borrow_mut().to_host.clear();
    while board.0.borrow().now_us < start_us + 150_000 {
        session.step();
    }
    let refused = (9, format!("{:?}", Report::Refused(Refusal::Baseline)));
    assert!(reports(&board.0.borrow().to_host).contains(&refused));
    assert_eq!(in_force(&mut session, &board), (own, 0));
}

#[test]
fn a_baseline_of_another_count_under_the_same_number_starts_anew() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    for frames in [1000, 3] {
        let request = request_bytes(9, &Request::CaptureBaseline { frames });
        board.0.borrow_mut().to_device.extend(request);
        settle(&mut session, &board);
    }
    while board.0.borrow().now_us < 10_000 {
        session.step();
    }
    let answers = reports(&board.0.borrow().to_host);
    let answers: Vec<_> = answers.iter().filter(|(number, _)| *number == 9).collect();
    assert_eq!(answers[0].1, format!("{:?}", Report::Refused(Refusal::Baseline)));
    assert!(answers.len() == 2 && answers[1].1.starts_with("Baseline"), "{answers:?}");
}

/// Longest time in µs in which the watchdog is not fed, when a byte is taken every `gap_us` and each scan takes
/// `scan_us`.
fn longest_unfed_us(gap_us: u32, scan_us: u32) -> u32 {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let scanning = Configuration { frame_period_us: 10_000, send_readings: true, ..quiet() };
    let mut bench = Bench::new(scanning);
    let board = bench.board.clone();
    // A faulty reading, so that all kinds of reports are sent.
    bench.frame.borrow_mut()[0][0] = f32::NAN;
    let source = Source::new(&bench.frame, &board, scan_us);
    bench.app = TestApp::new(board.clone(), source, scanning, buffers());
    board.0.borrow_mut().gap_us = gap_us;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let mut longest_us = 0;
    for _ in 0..30 {
        let request = request_bytes(5, &Request::Identify);
        board.0.borrow_mut().to_device.extend(request);
        let start_us = board.0.borrow().now_us;
        session.step();
        longest_us = longest_us.max(board.0.borrow().now_us - start_us);
    }
    longest_us
}

#[test]
fn however_slowly_bytes_are_taken_the_watchdog_is_fed() {
    // The fastest watchdog of the board waits 5.4 s; its longest scan, of 256 samples a reading, takes 1.66 s.
    for gap_us in [0, 1_000, 10_000, 49_000, 1_000_000] {
        for scan_us in [6_400, 1_660_000] {
            let unfed_us = longest_unfed_us(gap_us, scan_us);
            assert!(unfed_us < 2_060_000 + scan_us, "{gap_us} {scan_us}: {unfed_us}");
        }
    }
    assert!(longest_unfed_us(49_000, 6_400) > 2_000_000, "the line is not slow");
}

#[test]
fn readings_far_beyond_the_training_range_are_flagged_and_counted() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    // The training range is 50 to 70 Ω, and an eighth of it more on either side is not clamped.
    for (reading, clamped) in
        [(47.6, false), (72.4, false), (47.4, true), (72.6, true), (900.0, true)]
    {
        let mut frame = frame_at_rest();
        frame[1][2] = reading;
        let (flags, _, _) = decode(&mut session, &board, &frame);
        assert_eq!(flags & EstimateReport::CLAMPED != 0, clamped, "{reading}");
    }
    assert_eq!(statistics(&mut session, &board).frames_clamped, 3);
    // A row that is not decoded is not clamped.
    let mut frame = frame_at_rest();
    (frame[1][2], frame[1][0]) = (900.0, f32::NAN);
    assert_eq!(decode(&mut session, &board, &frame).0, EstimateReport::FAULTY_READING);
}

#[test]
fn the_identity_tells_what_the_model_was_trained_on() {
    let network = |metadata: Metadata<'static>| {
        let network = blob_of_one_row(3, 2);
        let model = Model::decode(&network).unwrap();
        let networks: Vec<_> = model.networks().collect();
        let parts =
            ModelParts { projection: None, networks: &networks, row_network: &[0], metadata };
        encode_to_vec(&parts).unwrap()
    };
    let plain = Metadata::unnamed(ModelShape { rows: 1, inputs: 3, outputs: 2 });
    let read = |metadata: Metadata<'static>| {
        let mut slots = MockSlot::pair_with(&network(metadata));
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        ask(&mut session, &bench.board, &Request::Identify, |report| match report {
            Report::Identity(identity) => (identity.model_name.to_owned(), identity.model.unwrap()),
            other => panic!("{other:?}"),
        })
        .0
    };
    let (name, model) = read(Metadata { name: "press", scene_digest: 7, ..plain });
    assert_eq!((&name[..], model.scene_digest), ("press", 7));
    let crc = |text: &str| CRC_32.checksum(text.as_bytes());
    assert_eq!((model.inputs_crc_32, model.outputs_crc_32), (crc("x\nx\nx\n\n"), crc("y\ny\n")));
    let (_, other) = read(Metadata { output_units: Columns("N\nN"), ..plain });
    assert_eq!(other.inputs_crc_32, model.inputs_crc_32);
    assert_eq!(other.outputs_crc_32, crc("y\nyN\nN"));
    // A long name is cut between letters.
    let long = "äöüßäöüßäöüßäöüßäöüßäöüß";
    let (name, _) = read(Metadata { name: long, ..plain });
    assert_eq!(name, &long[..40]);
    let (name, _) =
        read(Metadata { name: "xäöüßäöüßäöüßäöüßäöüßäöüß", ..plain });
    assert_eq!(name.len(), 39);
}

#[test]
fn a_host_that_takes_no_bytes_costs_a_report_but_not_the_device() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(Configuration { frame_period_us: 1000, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    board.0.borrow_mut().room = Some(10);
    while board.0.borrow().now_us < 500_000 {
        session.step();
    }
    // The report that was cut is a broken frame, which does not damage the next report.
    board.0.borrow_mut().room = None;
    board.0.borrow_mut().to_device.extend(request_bytes(7, &Request::Statistics));
    settle(&mut session, &board);
    let bytes = std::mem::take(&mut board.0.borrow_mut().to_host);
    let mut receiver = Receiver::new([0; 1024]);
    let mut numbers = Vec::new();
    for byte in bytes {
        numbers.extend(receiver.push(byte).map(|received| match received {
            Received::Frame(bytes) => packet::decode::<Report<'_>>(bytes).map(|p| p.number).ok(),
            _ => None,
        }));
    }
    assert_eq!(numbers[..2], [None, Some(7)], "{numbers:?}");
    let s = statistics(&mut session, &board);
    assert!(s.lost_reports >= 5 && s.frames_missed > 0, "{s:?}");
}

#[test]
fn a_restart_is_answered_and_ends_the_session() {
    let mut slots = MockSlot::pair_with(&blob(3, 4));
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let (answer, leave) =
        ask(&mut session, &bench.board, &Request::Restart, |r| r == Report::Restarting);
    assert_eq!((answer, leave), (true, Some(Leave::Restart)));
}

/// A blob for one row of `inputs` readings and `outputs` outputs.
fn blob_of_one_row(inputs: usize, outputs: usize) -> AlignedBytes {
    let shape = ModelShape { rows: 1, inputs, outputs };
    blob_with(shape, Metadata::unnamed(shape))
}

/// A blob of one network with this `shape` of one row.
fn blob_with(shape: ModelShape, metadata: Metadata<'_>) -> AlignedBytes {
    let ModelShape { inputs, outputs, .. } = shape;
    let number = |i: usize| ((i * 37) % 101) as f32 / 50.0 - 1.0;
    let list = |from: usize, count: usize| (from..from + count).map(number).collect::<Vec<_>>();
    let (centre, weights, bias) = (list(1, inputs), list(2, outputs), list(3, outputs));
    let (minimum, per_span) = (vec![50.0; inputs], vec![0.05; inputs]);
    let network = direct::Network::try_new(
        Shape { inputs, centres: 1, outputs },
        Parameters {
            input_minimum: &minimum,
            input_per_span: &per_span,
            centres: &centre,
            decay: &[1.5],
            output_weights: &weights,
            bias: &bias,
            affine: &[],
        },
    );
    let networks = &[network.unwrap().into()];
    encode_to_vec(&ModelParts { projection: None, networks, row_network: &[0], metadata }).unwrap()
}

#[test]
fn the_model_says_what_is_scanned_and_decoded() {
    let rest = frame_at_rest();
    // A column and an output less; one network for all six readings; one output of one row.
    for (inputs, outputs, wires) in [(2, 1, 2), (6, 4, 6), (3, 2, 3), (1, 1, 1)] {
        let blob = blob_of_one_row(inputs, outputs);
        let mut slots = MockSlot::pair_with(&blob);
        let scanning = Configuration { frame_period_us: 1000, send_readings: true, ..quiet() };
        let mut bench = Bench::new(scanning);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        while bench.board.0.borrow().now_us < 1500 {
            assert_eq!(session.step(), None);
        }
        let readings = &rest.as_flattened()[..wires];
        let decoder = Decoder::<1>::load(&blob).unwrap();
        let outputs = decoder.decode(readings).unwrap().outputs;
        let all = reports(&bench.board.0.borrow().to_host);
        let found = |debug: String| all.iter().any(|(_, text)| text.contains(&debug));
        assert!(found(format!("readings_ohm: {:?}", Floats::of(readings))), "{all:?}");
        let row = format!("row_status: [0], outputs: {:?}", Floats::of(&outputs));
        assert!(found(row), "{all:?}");
    }
}

#[test]
fn the_names_of_readings_say_which_rows_are_scanned() {
    let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    for (names, row) in [("r1c1_ohm\nr1c2_ohm", 0), ("r2c1_ohm\nr2c2_ohm", 1), ("a\nb", 0)] {
        let metadata = Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) };
        let mut slots = MockSlot::pair_with(&blob_with(shape, metadata));
        let scanning = Configuration { frame_period_us: 1000, send_readings: true, ..quiet() };
        let mut bench = Bench::new(scanning);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        while bench.board.0.borrow().now_us < 1500 {
            assert_eq!(session.step(), None);
        }
        let all = reports(&bench.board.0.borrow().to_host);
        let expected = format!("readings_ohm: {:?}", Floats::of(&frame_at_rest()[row][..2]));
        assert!(all[0].1.contains(&expected), "{names}: {all:?}");
    }
    let metadata =
        Metadata { input_names: Columns("r3c1_ohm\nr3c2_ohm"), ..Metadata::unnamed(shape) };
    let mut slots = MockSlot::pair_with(&blob_with(shape, metadata));
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    assert_eq!(model_crc(&mut session, &bench.board), None, "there are two rows");
}

#[test]
fn a_model_without_room_is_not_put_in_force() {
    for (inputs, outputs) in [(4, 1), (7, 1), (3, 5)] {
        let mut slots = MockSlot::pair_with(&blob_of_one_row(inputs, outputs));
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        assert_eq!(model_crc(&mut session, &bench.board), None, "{inputs} {outputs}");
    }
}

#[test]
fn a_model_is_decoded_from_ram_where_it_fits() {
    let blob = blob(3, 4);
    let words = blob.len().div_ceil(4);
    for (room, in_ram) in [(words, true), (words - 1, false)] {
        let mut slots = MockSlot::pair_with(&blob);
        let mut weights = vec![0; room];
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut weights);
        let read = |report: Report<'_>| match report {
            Report::Identity(identity) => identity.model.map(|model| model.in_ram),
            other => panic!("{other:?}"),
        };
        let found = ask(&mut session, &bench.board, &Request::Identify, read).0;
        assert_eq!(found, Some(in_ram));
        let frame = frame_at_rest();
        let (_, _, found) = decode(&mut session, &bench.board, &frame);
        assert_eq!(found, bits(expected(&blob, &frame).into_iter().flatten()));
        let _ = session;
        assert_eq!(bytemuck::cast_slice::<u32, u8>(&weights).starts_with(&blob), in_ram);
    }
}

#[test]
fn behind_a_damaged_model_the_other_slots_is_decoded_from_there() {
    let (first, second) = (blob(3, 4), blob(5, 4));
    let mut slots = MockSlot::pair_with(&first);
    let mut weights = vec![0; second.len().div_ceil(4)];
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut weights);
    for step in upload_steps(&second, 64) {
        ask(&mut session, &bench.board, &Request::Upload(step), |_| ());
    }
    let _ = session;
    let mut in_force = |slots: &mut [MockSlot; 2]| {
        let mut session = Session::start(&mut bench.app, slots, &mut weights);
        let frame = frame_at_rest();
        let (_, _, found) = decode(&mut session, &bench.board, &frame);
        let read = |report: Report<'_>| match report {
            Report::Identity(identity) => identity.model.map(|model| (model.slot, model.in_ram)),
            other => panic!("{other:?}"),
        };
        (ask(&mut session, &bench.board, &Request::Identify, read).0, found)
    };
    let outputs = |blob: &[u8]| bits(expected(blob, &frame_at_rest()).into_iter().flatten());
    assert_eq!(in_force(&mut slots), (Some((1, true)), outputs(&second)));
    slots[1].decay(second.len() / 8, 1);
    assert_eq!(in_force(&mut slots), (Some((0, false)), outputs(&first)));
}

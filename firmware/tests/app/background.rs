//! Scans that go on by themselves while the frame before is decoded.

use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::{Configuration, Report, Request};

use crate::mock::*;

/// A host of a device with a model, whose sensor scans by itself for `scan_us` and 10 µs.
fn started_alone(period_us: u32, scan_us: u32) -> Host<'static, 'static> {
    let configuration = Configuration { send_readings: true, ..every(period_us) };
    let host = started(configuration, &blob(3, 4));
    host.pins_mut().scans_alone = true;
    host.pins_mut().scan_us = scan_us;
    host
}

/// Runs turns of the loop until so many more scans were started.
fn run_until_started(host: &mut Host<'_, '_>, more: u32) {
    let started = host.pins().started + more;
    while host.pins().started < started {
        assert_eq!(host.step(), None);
    }
}

/// Number of each frame whose readings were reported, when its scan began, and its first reading.
fn readings(host: &Host<'_, '_>) -> Vec<(u32, u64, f32)> {
    let mut found = Vec::new();
    host.find(|_, report| {
        if let Report::Readings { frame, start_us, readings_ohm } = report {
            found.push((frame, start_us, readings_ohm.iter().next().unwrap()));
        }
        None::<()>
    });
    found
}

#[test]
fn the_next_frame_is_scanned_during_decoding_and_none_is_missed() {
    for alone in [true, false] {
        let mut host = started_alone(1000, 790);
        host.pins_mut().scans_alone = alone;
        // Reports take longer than the scan leaves of a period.
        host.pins_mut().gap_us = 7;
        host.run_until(40_000);
        let frames = readings(&host);
        let s = host.statistics();
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
    let mut host = started_alone(1000, 500);
    let circuit = ZeroPotential::<ROWS, COLS> { drive_v: 0.21, ..ZeroPotential::TYPICAL };
    let slower = Configuration { frame_period_us: 2000, send_readings: true, ..quiet() };
    let changes = [
        Request::Configure(slower),
        Request::SetConstants(circuit.constants()),
        Request::CaptureBaseline { frames: 1 },
    ];
    for (index, change) in changes.iter().enumerate() {
        run_until_started(&mut host, 1);
        // What the scan has read so far belongs to no frame any more.
        host.frame()[0][0] = 70.0 + index as f32;
        host.pins_mut().to_host.clear();
        let (stopped, changed_us) = (host.pins().stopped, host.pins().now_us);
        host.send(9, change);
        assert_eq!(host.pins().stopped, stopped + 1, "{change:?}");
        while readings(&host).is_empty() {
            host.step();
        }
        let (_, start_us, first_ohm) = readings(&host)[0];
        assert!(start_us > u64::from(changed_us), "{change:?}");
        assert_eq!(first_ohm.to_bits(), (70.0 + index as f32).to_bits(), "{change:?}");
    }
    // The baseline is of the one frame that began behind the request: 72 Ω as bytes.
    let answers = host.answers(9);
    assert!(answers.iter().any(|text| text.contains("[0, 0, 144, 66")), "{answers:?}");
    // Nothing is given up where nothing changes, and what a host wants decoded disturbs no scan.
    let stopped = host.pins().stopped;
    run_until_started(&mut host, 1);
    host.configure(slower);
    host.decode(&[[33.0; COLS]; ROWS]);
    assert!(readings(&host).is_empty());
    run_until_started(&mut host, 1);
    assert_eq!(readings(&host)[0].2.to_bits(), 72.0_f32.to_bits());
    assert_eq!(host.pins().stopped, stopped);
    assert_eq!(host.statistics().frames_missed, 0);
}

#[test]
fn a_scan_of_other_wires_is_stopped_when_a_model_becomes_active() {
    let mut bench = Bench::new(every(1000), &[]);
    let mut host = bench.session();
    host.pins_mut().scans_alone = true;
    host.pins_mut().scan_us = 500;
    run_until_started(&mut host, 1);
    bench.slots = Flash::slots_with(&blob_of_names("r2c1_ohm\nr2c3_ohm", 1));
    let mut host = bench.session();
    assert_eq!(host.pins().stopped, 1);
    run_until_started(&mut host, 2);
    // It has as many readings as the model: the mock panics for another number.
    assert!(host.statistics().frames_decoded >= 1);
}

#[test]
fn a_scan_that_never_ends_is_a_silent_sensor_and_is_diagnosed() {
    let mut host = started_alone(1000, 1_000_000_000);
    run_until_started(&mut host, 1);
    host.pins_mut().look_us = 1000;
    while host.pins().stopped == 0 {
        assert_eq!(host.step(), None); // and the host is served
        assert!(host.pins().now_us < 2_100_000, "the scan has no end");
    }
    let fed = host.pins().feeds;
    host.run_for(6_000_000);
    assert_eq!(host.pins().feeds, fed, "the watchdog is fed");
    assert!(host.pins().started > 2, "it is not tried again");
    let frames = readings(&host);
    let told = host.answers(0).iter().filter(|text| text.contains("Diagnosis")).count();
    assert_eq!(told, frames.len(), "one for each scan");
    let s = host.statistics();
    assert_eq!(s.failed_samples, s.frames_scanned * (ROWS * COLS) as u32);
    assert!(!frames.is_empty() && frames.iter().all(|(.., first_ohm)| first_ohm.is_nan()));
}

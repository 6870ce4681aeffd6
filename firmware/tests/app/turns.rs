//! Turns of the loop: scans in time, the watchdog, and a host that takes no bytes.

use taxel_core::checksum::CRC_32;
use taxel_firmware::app::SessionEnd;
use taxel_firmware::link::message::{Configuration, EstimateReport, Refusal, Report, Request};
use taxel_firmware::link::packet::PROTOCOL_VERSION;

use crate::mock::*;

#[test]
fn frames_are_scanned_on_time_numbered_and_reported() {
    let mut host = started(Configuration { send_readings: true, ..every(1000) }, &blob(3, 4));
    host.run_until(5500);
    let reports = host.reports();
    assert_eq!(reports.len(), 10, "{reports:?}"); // readings and estimate, five times
    for (i, (number, text)) in reports.iter().enumerate() {
        assert_eq!(*number, 0);
        let kind = if i % 2 == 0 { "Readings { " } else { "Estimate(EstimateReport { " };
        let start = format!("{kind}frame: {}, start_us: {}", i / 2 + 1, i / 2 + 1);
        assert!(text.starts_with(&start), "{text} instead of {start}");
    }
    let s = host.statistics();
    assert_eq!((s.frames_scanned, s.frames_decoded, s.frames_missed), (5, 5, 0));
    assert!(s.longest_scan_us >= 10 && s.longest_scan_us < 20);
    // The second look of the first frame, and that of the last.
    assert_eq!((s.longest_decode_cycles, s.shortest_decode_cycles), (500, 100));
    assert!(s.longest_decode_us > 0);
}

#[test]
fn a_scan_longer_than_the_period_is_an_overrun() {
    let mut host = started(every(100), &blob(3, 4));
    host.pins_mut().scan_us = 250;
    host.run_until(2000);
    let all = host.reports();
    let flagged =
        |flag: u8| all.iter().filter(|(_, t)| t.contains(&format!("flags: {flag},"))).count();
    assert_eq!(flagged(0), 1, "{all:?}"); // the first was on time
    assert_eq!(flagged(EstimateReport::OVERRUN), all.len() - 1);
    let s = host.statistics();
    assert!(s.frames_missed >= s.frames_scanned - 1, "{s:?}");
}

#[test]
fn the_watchdog_is_fed_by_good_loops_only() {
    let mut host = started(every(100), &blob(3, 4));
    let fed = |host: &mut Host<'_, '_>, turns: u32| {
        let before = host.pins().feeds;
        host.turn(turns);
        host.pins().feeds - before
    };
    for _ in 0..50 {
        assert_eq!(fed(&mut host, 1), 1);
    }
    // With a converter that gives nothing, no loop is good from the next scan on, whether it scans or not.
    *host.frame() = [[f32::NAN; COLS]; ROWS];
    host.run_for(200);
    let bad = host.statistics().bad_loops;
    assert_eq!(fed(&mut host, 2000), 0);
    assert!(host.statistics().bad_loops >= bad + 2000);
    // One reading is enough.
    host.frame()[1][1] = 60.0;
    host.run_for(200);
    assert_eq!(fed(&mut host, 2000), 2000);
    // Without scans, a silent sensor must not restart the device.
    *host.frame() = [[f32::NAN; COLS]; ROWS];
    host.turn(2000);
    host.configure(quiet());
    assert_eq!(fed(&mut host, 1), 1);
}

/// Longest time in µs in which the watchdog is not fed, when a byte is taken every `gap_us` and each scan takes
/// `scan_us`.
fn longest_unfed_us(gap_us: u32, scan_us: u32) -> u32 {
    let scanning = Configuration { send_readings: true, ..every(10_000) };
    let mut host = started(scanning, &blob(3, 4));
    host.pins_mut().scan_us = scan_us;
    host.pins_mut().gap_us = gap_us;
    host.pins_mut().look_us = 20;
    // A faulty reading, so that all kinds of reports are sent.
    host.frame()[0][0] = f32::NAN;
    let mut longest_us = 0;
    for _ in 0..30 {
        host.pins_mut().to_device.extend(request_bytes(5, &Request::Identify));
        let start_us = host.pins().now_us;
        host.step();
        longest_us = longest_us.max(host.pins().now_us - start_us);
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
fn a_host_that_takes_no_bytes_costs_a_report_but_not_the_device() {
    let mut host = started(every(1000), &blob(3, 4));
    host.pins_mut().room = Some(10);
    host.run_until(500_000);
    // The report that was cut is a broken frame, which does not damage the next report.
    host.pins_mut().room = None;
    host.send(7, &Request::Statistics);
    assert_eq!(host.find(|number, _| Some(number)), Some(7));
    let s = host.statistics();
    assert!(s.lost_reports >= 5 && s.frames_missed > 0, "{s:?}");
    // One that takes them slowly costs none, however long it lasts.
    host.configure(every(1_000_000));
    host.pins_mut().look_us = 100;
    host.pins_mut().gap_us = 5_000;
    host.run_for(10_000_000);
    host.pins_mut().gap_us = 0;
    assert_eq!(host.statistics().lost_reports, s.lost_reports);
}

#[test]
fn a_restart_is_answered_and_ends_the_session() {
    let mut host = started(quiet(), &blob(3, 4));
    // A board without a brown-out level goes on.
    assert_eq!(host.refusal(&Request::SetBrownOut), Refusal::Flash);
    assert_eq!(host.step(), None);
    let (answer, end) = host.ask(&Request::Restart, |report| report == Report::Restarting);
    assert_eq!((answer, end), (true, Some(SessionEnd::Restart)));
}

#[test]
fn what_is_no_request_is_counted_and_refused_if_it_is_whole() {
    let mut host = started(quiet(), &[]);
    let whole = |covered: &[u8]| [covered, &CRC_32.checksum(covered).to_le_bytes()].concat();
    for (packet, refusal) in [
        (whole(&[PROTOCOL_VERSION + 1, 9, 0]), Some(Refusal::Version(PROTOCOL_VERSION))),
        (whole(&[PROTOCOL_VERSION, 9, 255]), Some(Refusal::Unknown)),
        (vec![PROTOCOL_VERSION, 9, 0], None),
        (vec![1; 1000], None),
    ] {
        host.pins_mut().to_host.clear();
        host.pins_mut().to_device.extend(framed(&packet));
        host.turn(10);
        let refused = refusal.map(|it| format!("{:?}", Report::Refused(it)));
        assert_eq!(host.answers(9), Vec::from_iter(refused));
    }
    let s = host.statistics();
    assert_eq!((s.bad_packets, s.requests), (4, 1));
}

//! Configurations, in force and kept.

use taxel_firmware::link::message::{
    Configuration, ConfigurationField as Field, Refusal, Report, Request, Setting,
};

use crate::mock::*;

#[test]
fn configurations_are_checked_and_a_bad_one_changes_nothing() {
    let (mut session, board) = started(quiet(), &blob(3, 4));
    let good = Configuration { frame_period_us: 20_000, send_readings: true, ..quiet() };
    tell(&mut session, &board, &Request::Configure(good));
    assert_eq!(in_force(&mut session, &board), good);
    let bad = Request::Configure(Configuration { report_every: 0, ..good });
    let refused = answer!(&mut session, &board, &bad, Report::Refused(it) => it);
    assert_eq!(refused, Refusal::Configuration(Field::ReportEvery));
    assert_eq!(in_force(&mut session, &board), good);
}

/// The configuration in force.
fn in_force(session: &mut TestSession<'_>, board: &Board) -> Configuration {
    answer!(session, board, &Request::Configuration, Report::Configuration(it) => it)
}

#[test]
fn a_configuration_that_is_not_kept_lasts_until_the_host_resumes_what_is() {
    let default = every(10_000);
    let (mut session, board) = started(default, &blob(3, 4));
    let mut own = default;
    for kept in [None, Some(every(20_000))] {
        if let Some(kept) = kept {
            tell(&mut session, &board, &Request::Configure(kept));
            tell(&mut session, &board, &Request::Keep(Setting::Configuration));
            own = kept;
        }
        tell(&mut session, &board, &Request::Configure(quiet()));
        let scanned = statistics(&mut session, &board).frames_scanned;
        board.pins.borrow_mut().now_us += 1_000_000_000;
        session.step();
        assert_eq!(in_force(&mut session, &board), quiet());
        assert_eq!(statistics(&mut session, &board).frames_scanned, scanned);
        let (resumed, _) = ask(&mut session, &board, &Request::Resume, |report| {
            report == Report::Configuration(own)
        });
        assert!(resumed);
        board.pins.borrow_mut().now_us += own.frame_period_us;
        session.step();
        assert_eq!(statistics(&mut session, &board).frames_scanned, scanned + 1);
    }
}

#[test]
fn the_same_configuration_again_keeps_time_and_the_baseline_goes_on() {
    let fast = Request::Configure(every(1000));
    let (mut session, board) = started(quiet(), &blob(3, 4));
    tell(&mut session, &board, &fast);
    send(&mut session, &board, 9, &Request::CaptureBaseline { frames: 1000 });
    run_until(&mut session, &board, 50_000);
    let before = statistics(&mut session, &board).frames_scanned;
    for _ in 0..20 {
        tell(&mut session, &board, &fast);
    }
    let start_us = board.pins.borrow().now_us;
    while board.pins.borrow().now_us < start_us + 20_000 {
        session.step();
        assert!(!reports(&board.pins.borrow().to_host).iter().any(|(number, _)| *number == 9));
    }
    let scanned = statistics(&mut session, &board).frames_scanned - before;
    assert!((20..=22).contains(&scanned), "{scanned}");
}

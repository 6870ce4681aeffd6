//! Configurations, in force and kept.

use taxel_firmware::link::message::{
    Configuration, ConfigurationField as Field, Refusal, Report, Request, Setting,
};

use crate::mock::*;

/// The configuration in force.
fn in_force(host: &mut Host<'_, '_>) -> Configuration {
    answer!(host, &Request::Configuration, Report::Configuration(it) => it)
}

#[test]
fn a_bad_configuration_changes_nothing() {
    let mut host = started(quiet(), &blob(3, 4));
    let good = Configuration { frame_period_us: 20_000, send_readings: true, ..quiet() };
    host.configure(good);
    let bad = Request::Configure(Configuration { report_every: 0, ..good });
    assert_eq!(host.refusal(&bad), Refusal::Configuration(Field::ReportEvery));
    assert_eq!(in_force(&mut host), good);
}

#[test]
fn a_configuration_lasts_until_the_host_resumes_the_stored_one() {
    let mut host = started(every(10_000), &blob(3, 4));
    for own in [every(10_000), every(20_000)] {
        // The first is the board's own.
        if own == every(20_000) {
            host.configure(own);
            host.tell(&Request::Keep(Setting::Configuration));
        }
        host.configure(quiet());
        let scanned = host.statistics().frames_scanned;
        host.pass(1_000_000_000);
        assert_eq!(in_force(&mut host), quiet());
        assert_eq!(host.statistics().frames_scanned, scanned);
        assert!(host.ask(&Request::Resume, |report| report == Report::Configuration(own)).0);
        host.pass(own.frame_period_us);
        assert_eq!(host.statistics().frames_scanned, scanned + 1);
    }
}

#[test]
fn an_equal_configuration_keeps_the_schedule_and_the_baseline() {
    let mut host = started(every(1000), &blob(3, 4));
    host.send(9, &Request::CaptureBaseline { frames: 1000 });
    host.run_until(50_000);
    let before = host.statistics().frames_scanned;
    for _ in 0..20 {
        host.configure(every(1000));
    }
    host.run_for(20_000);
    assert!(host.answers(9).is_empty());
    let scanned = host.statistics().frames_scanned - before;
    assert!((20..=22).contains(&scanned), "{scanned}");
}

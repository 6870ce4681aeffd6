//! Settings are kept over restarts, and what does not fit the device is not believed.

use crate::mock::*;
use taxel_core::blob::Floats;
use taxel_firmware::app::Session;
use taxel_firmware::circuit::{Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{
    Configuration, KeepFault, Kept, KeptBaseline, Refusal, Report, Request, Setting,
};
use taxel_firmware::store::{Journal, Kind};

fn kept(report: &Report<'_>) -> Kept {
    match report {
        Report::Kept(kept) => *kept,
        other => panic!("{other:?}"),
    }
}

fn refusal(report: &Report<'_>) -> Refusal {
    match report {
        Report::Refused(refusal) => *refusal,
        other => panic!("{other:?}"),
    }
}

/// Circuit with constants that are all different.
fn circuit() -> ZeroPotential<ROWS, COLS> {
    ZeroPotential {
        sensor_rows: 2,
        reference_v: 3.25,
        drive_v: 0.21,
        row_source_ohm: [0.3, 0.5],
        feedback_ohm: [550.0, 560.0, 570.0],
        series_ohm: [0.0, 0.125, 0.25],
    }
}

#[test]
fn every_setting_survives_a_restart_and_can_be_forgotten() {
    let mut journal = Flash::journal();
    let configuration = Configuration { contact_threshold: 0.25, ..quiet() };
    let scanning = Configuration { frame_period_us: 1000, ..configuration };
    let mut slots = Flash::slots_with(&blob(1, 3));
    {
        let mut bench = Bench::with_journal(quiet(), journal.clone());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let mut ask =
            |request: &Request<'_>| ask(&mut session, &bench.board, request, |r| kept(&r)).0;
        assert_eq!(
            ask(&Request::Kept),
            Kept { configuration: None, constants: false, baseline: None, writes_left: 100 }
        );
    }
    {
        let mut bench = Bench::with_journal(quiet(), journal.clone());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let constants = circuit();
        let set = Request::SetConstants(constants.constants());
        ask(&mut session, &bench.board, &set, |report| match report {
            Report::Constants(found) => assert_eq!(found, constants.constants()),
            other => panic!("{other:?}"),
        });
        let capture = [Request::Configure(scanning), Request::CaptureBaseline { frames: 3 }];
        for (number, request) in (1..).zip(&capture) {
            bench.board.pins.borrow_mut().to_device.extend(request_bytes(number, request));
        }
        for _ in 0..10_000 {
            session.step();
        }
        let mut ask =
            |request: &Request<'_>| ask(&mut session, &bench.board, request, |r| kept(&r)).0;
        for setting in Setting::ALL {
            ask(&Request::Keep(setting));
        }
        let baseline = Some(KeptBaseline { rows: 2, columns: 3, frames: 3 });
        let all =
            Kept { configuration: Some(scanning), constants: true, baseline, writes_left: 97 };
        assert_eq!(ask(&Request::Kept), all);
        // What is kept already is not written again.
        for setting in Setting::ALL {
            assert_eq!(ask(&Request::Keep(setting)), all);
        }
        journal = bench.journal();
    }
    {
        let mut bench = Bench::with_journal(quiet(), journal.clone());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        ask(&mut session, &bench.board, &Request::Configuration, |report| match report {
            Report::Configuration(configuration) => assert_eq!(configuration, scanning),
            other => panic!("{other:?}"),
        });
        ask(&mut session, &bench.board, &Request::Constants, |report| match report {
            Report::Constants(found) => assert_eq!(found, circuit().constants()),
            other => panic!("{other:?}"),
        });
        // The baseline is in force: a frame that differs from it is a contact.
        let decode = |session: &mut TestSession<'_>, ohm: f32| {
            let mut frame = frame_at_rest();
            frame[1][2] = ohm;
            let readings_ohm = Floats::new(frame.as_flattened());
            let request = Request::Decode { frame: 1, start_us: 0, readings_ohm };
            ask(session, &bench.board, &request, |report| match report {
                Report::Estimate(estimate) => estimate.flags,
                other => panic!("{other:?}"),
            })
            .0
        };
        assert_eq!(decode(&mut session, 65.0) & 16, 0);
        assert_eq!(decode(&mut session, 40.0) & 16, 16);
        // With other constants it means nothing, and with the former ones it does again.
        for (circuit, contact) in [(ZeroPotential::TYPICAL, 0), (circuit(), 16)] {
            let set = Request::SetConstants(circuit.constants());
            tell(&mut session, &bench.board, &set);
            assert_eq!(decode(&mut session, 40.0) & 16, contact);
        }

        let mut ask =
            |request: &Request<'_>| ask(&mut session, &bench.board, request, |r| kept(&r)).0;
        for setting in Setting::ALL {
            ask(&Request::Forget(setting));
        }
        let none = Kept { configuration: None, constants: false, baseline: None, writes_left: 97 };
        assert_eq!(ask(&Request::Kept), none);
        journal = bench.journal();
    }
    let mut bench = Bench::with_journal(quiet(), journal);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    ask(&mut session, &bench.board, &Request::Constants, |report| match report {
        Report::Constants(found) => {
            assert_eq!(found, ZeroPotential::<ROWS, COLS>::TYPICAL.constants());
        }
        other => panic!("{other:?}"),
    });
    let keep = Request::Keep(Setting::Baseline);
    let refused = ask(&mut session, &bench.board, &keep, |report| refusal(&report)).0;
    assert_eq!(refused, Refusal::Keep(KeepFault::Nothing));
}

#[test]
fn a_configuration_of_another_version_is_not_believed_and_constants_are() {
    let mut slots = Flash::slots_with(&blob(1, 3));
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    for setting in [Setting::Configuration, Setting::Constants] {
        tell(&mut session, &bench.board, &Request::Keep(setting));
    }
    let _ = session;
    let mut journal = bench.journal();
    let kept_now = |slots: &mut [Flash; 2], journal: &Journal<Flash>| {
        let mut bench = Bench::with_journal(quiet(), journal.clone());
        let mut session = Session::start(&mut bench.app, slots, &mut []);
        ask(&mut session, &bench.board, &Request::Kept, |report| kept(&report)).0
    };
    let found = kept_now(&mut slots, &journal);
    assert_eq!((found.configuration, found.constants), (Some(quiet()), true));
    // As earlier firmware kept it: without what is sent of a confidence, and without a filter.
    let limits = b"\0\0\xa0\x40\0\0\x7a\x44\x0a\xd7\xa3\x3c\0\0\0\0";
    for before in [&b"\x01\x90\x4e\x64\x01\0\x01"[..], b"\x02\x90\x4e\x14\x01\0\x01\0"] {
        // The second time with bytes behind it that a filter could be read from.
        for more in [&[][..], &[0, 0, 1]] {
            journal.keep(Kind::Configuration, &[before, limits, more]).unwrap();
            let found = kept_now(&mut slots, &journal);
            assert_eq!((found.configuration, found.constants), (None, true));
        }
    }
}

#[test]
fn a_baseline_of_other_wires_is_ignored_until_a_model_of_its_wires_comes() {
    let mut journal = Flash::journal();
    let readings: Vec<u8> = [60.0_f32; 4].iter().flat_map(|ohm| ohm.to_le_bytes()).collect();
    let bytes = [&[2, 2, 2, 7, 0, 0, 0, 0, 0][..], &readings].concat();
    journal.keep(Kind::Baseline, &[&bytes]).unwrap();
    let mut slots = Flash::slots_with(&blob(1, 3));
    let mut bench = Bench::with_journal(quiet(), journal);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let keep = Request::Keep(Setting::Baseline);
    let refused = ask(&mut session, &bench.board, &keep, |report| refusal(&report)).0;
    assert_eq!(refused, Refusal::Keep(KeepFault::Nothing)); // none is in force
    let (found, _) = ask(&mut session, &bench.board, &Request::Kept, |report| kept(&report));
    assert_eq!(found.baseline, Some(KeptBaseline { rows: 2, columns: 2, frames: 7 }));
}

#[test]
fn what_is_out_of_range_is_refused_and_what_was_in_force_stays() {
    let (mut session, board) = started(quiet(), &[]);
    let good = circuit();
    let mut set = |constants: Constants<'_>| {
        let request = Request::SetConstants(constants);
        ask(&mut session, &board, &request, |report| match report {
            Report::Refused(Refusal::Constants(fault)) => Err(fault),
            Report::Constants(_) => Ok(()),
            other => panic!("{other:?}"),
        })
        .0
    };
    let series_ohm = [0.0, 0.0, -0.1];
    let bad: [(ZeroPotential<ROWS, COLS>, ConstantsFault); 6] = [
        (ZeroPotential { reference_v: 0.0, ..good }, ConstantsFault::Reference),
        (ZeroPotential { drive_v: f32::NAN, ..good }, ConstantsFault::Drive),
        (ZeroPotential { row_source_ohm: [0.1, -0.1], ..good }, ConstantsFault::RowSource),
        (ZeroPotential { feedback_ohm: [1.0, 0.0, 1.0], ..good }, ConstantsFault::Feedback),
        (ZeroPotential { feedback_ohm: [f32::INFINITY; 3], ..good }, ConstantsFault::Feedback),
        (ZeroPotential { series_ohm, ..good }, ConstantsFault::Series),
    ];
    assert_eq!(set(good.constants()), Ok(()));
    for (circuit, fault) in &bad {
        assert_eq!(set(circuit.constants()), Err(*fault));
    }
    assert_eq!(set(ZeroPotential::<2, 2>::TYPICAL.constants()), Err(ConstantsFault::Length));
    assert_eq!(set(ZeroPotential::<3, 3>::TYPICAL.constants()), Err(ConstantsFault::Length));
    ask(&mut session, &board, &Request::Constants, |report| match report {
        Report::Constants(found) => assert_eq!(found, good.constants()),
        other => panic!("{other:?}"),
    });
}

#[test]
fn writes_are_limited_between_restarts() {
    let mut journal = Flash::journal();
    let mut slots = Flash::slots();
    for _ in 0..2 {
        let mut bench = Bench::with_journal(quiet(), journal.clone());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let mut kept_times = 0;
        let refused = loop {
            let threshold = 0.001 + kept_times as f32 * 1e-5;
            let configuration = Configuration { contact_threshold: threshold, ..quiet() };
            tell(&mut session, &bench.board, &Request::Configure(configuration));
            let keep = Request::Keep(Setting::Configuration);
            let answer = ask(&mut session, &bench.board, &keep, |report| match report {
                Report::Kept(kept) => Ok(kept.writes_left),
                Report::Refused(refusal) => Err(refusal),
                other => panic!("{other:?}"),
            });
            match answer.0 {
                Ok(left) => {
                    kept_times += 1;
                    assert_eq!(u32::from(left), 100 - kept_times);
                }
                Err(refusal) => break refusal,
            }
        };
        assert_eq!((refused, kept_times), (Refusal::Keep(KeepFault::TooOften), 100));
        journal = bench.journal();
    }
}

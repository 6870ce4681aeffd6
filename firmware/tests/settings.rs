//! Settings are kept over restarts, and what does not fit the device is not believed.

use crate::mock::*;
use taxel_firmware::circuit::{Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{
    Configuration, KeepFault, Kept, KeptBaseline, Refusal, Report, Request, Setting,
};
use taxel_firmware::store::Kind;

const NOTHING: Refusal = Refusal::Keep(KeepFault::Nothing);

fn ask_kept(host: &mut Host<'_, '_>, request: &Request<'_>) -> Kept {
    answer!(host, request, Report::Kept(kept) => kept)
}

/// Circuit with constants that are all different.
fn circuit() -> ZeroPotential<ROWS, COLS> {
    ZeroPotential {
        saturated_v: 3.1,
        sensor_rows: 2,
        reference_v: 3.25,
        drive_v: 0.21,
        row_source_ohm: [0.3, 0.5],
        feedback_ohm: [550.0, 560.0, 570.0],
        series_ohm: [0.0, 0.125, 0.25],
    }
}

/// Checks that the constants in force are those of `circuit`.
fn expect(host: &mut Host<'_, '_>, circuit: &ZeroPotential<ROWS, COLS>) {
    let expected = circuit.constants();
    answer!(host, &Request::Constants, Report::Constants(it) => assert_eq!(it, expected));
}

#[test]
fn every_setting_survives_a_restart_and_can_be_forgotten() {
    let scanning = Configuration { contact_threshold: 0.25, ..every(1000) };
    let mut device = Device::new(Flash::slots_with(&blob(1, 3)));
    let none =
        |writes_left| Kept { configuration: None, constants: false, baseline: None, writes_left };
    device.session(|host| {
        assert_eq!(ask_kept(host, &Request::Kept), none(100));
        host.tell(&Request::SetConstants(circuit().constants()));
        expect(host, &circuit());
        host.send(1, &Request::Configure(scanning));
        host.send(2, &Request::CaptureBaseline { frames: 3 });
        host.run_for(1500);
        assert_eq!(host.refusal(&Request::Keep(Setting::Baseline)), NOTHING);
        host.turn(10_000);
        for setting in Setting::ALL {
            ask_kept(host, &Request::Keep(setting));
        }
        let baseline = Some(KeptBaseline { rows: 2, columns: 3, frames: 3 });
        let all =
            Kept { configuration: Some(scanning), constants: true, baseline, writes_left: 97 };
        assert_eq!(ask_kept(host, &Request::Kept), all);
        // What is kept already is not written again.
        for setting in Setting::ALL {
            assert_eq!(ask_kept(host, &Request::Keep(setting)), all);
        }
    });
    device.session(|host| {
        let found = answer!(host, &Request::Configuration, Report::Configuration(it) => it);
        assert_eq!(found, scanning);
        expect(host, &circuit());
        // The baseline is in force: a frame that differs from it is a contact. With other constants it means nothing, and
        // with the former ones it does again.
        for (circuit, ohm, is_contact) in [
            (circuit(), 65.0, false),
            (circuit(), 40.0, true),
            (ZeroPotential { drive_v: 0.22, ..circuit() }, 40.0, false),
            (ZeroPotential { series_ohm: [0.0; 3], ..circuit() }, 40.0, false),
            (circuit(), 40.0, true),
        ] {
            host.tell(&Request::SetConstants(circuit.constants()));
            assert_eq!(host.is_contact(frame_with(1, 2, ohm).as_flattened()), is_contact);
        }
        for setting in Setting::ALL {
            ask_kept(host, &Request::Forget(setting));
        }
        assert_eq!(ask_kept(host, &Request::Kept), none(97));
    });
    device.session(|host| {
        expect(host, &ZeroPotential::TYPICAL);
        assert_eq!(host.refusal(&Request::Keep(Setting::Baseline)), NOTHING);
    });
}

#[test]
fn stored_constants_outlast_a_version_and_configurations_do_not() {
    let mut device = Device::new(Flash::slots_with(&blob(1, 3)));
    device.session(|host| {
        for setting in [Setting::Configuration, Setting::Constants] {
            host.tell(&Request::Keep(setting));
        }
    });
    let kept_now = |device: &mut Device| {
        let kept = device.session(|host| ask_kept(host, &Request::Kept));
        (kept.configuration, kept.constants)
    };
    assert_eq!(kept_now(&mut device), (Some(quiet()), true));
    let longer = [device.journal.read(Kind::Configuration).unwrap(), &[0]].concat();
    device.keep(Kind::Configuration, &longer).unwrap();
    assert_eq!(kept_now(&mut device), (None, true));
    // As earlier firmware kept it: without what is sent of a confidence, and without a filter.
    let limits = b"\0\0\xa0\x40\0\0\x7a\x44\x0a\xd7\xa3\x3c\0\0\0\0";
    for before in [&b"\x01\x90\x4e\x64\x01\0\x01"[..], b"\x02\x90\x4e\x14\x01\0\x01\0"] {
        // The second time with bytes behind it that a filter could be read from.
        for more in [&[][..], &[0, 0, 1]] {
            device.keep(Kind::Configuration, &[before, limits, more].concat()).unwrap();
            assert_eq!(kept_now(&mut device), (None, true));
        }
    }
}

#[test]
fn what_is_out_of_range_is_refused_and_what_was_in_force_stays() {
    let mut host = started(quiet(), &[]);
    let good = circuit();
    host.tell(&Request::SetConstants(good.constants()));
    let mut check = |constants: Constants<'_>, fault: ConstantsFault| {
        let found = host.refusal(&Request::SetConstants(constants));
        assert_eq!(found, Refusal::Constants(fault));
        expect(&mut host, &good);
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
    bad.iter().for_each(|(circuit, fault)| check(circuit.constants(), *fault));
    check(ZeroPotential::<2, 2>::TYPICAL.constants(), ConstantsFault::Length);
    check(ZeroPotential::<3, 3>::TYPICAL.constants(), ConstantsFault::Length);
}

#[test]
fn writes_are_limited_between_restarts() {
    let mut device = Device::new(Flash::slots());
    for _ in 0..2 {
        device.session(|host| {
            let keep = Request::Keep(Setting::Configuration);
            for left in (0..100).rev() {
                let contact_threshold = 0.001 + f32::from(left) * 1e-5;
                host.configure(Configuration { contact_threshold, ..quiet() });
                assert_eq!(ask_kept(host, &keep).writes_left, left);
            }
            host.configure(quiet());
            for request in [keep, Request::Forget(Setting::Configuration)] {
                assert_eq!(host.refusal(&request), Refusal::Keep(KeepFault::TooOften));
            }
        });
    }
}

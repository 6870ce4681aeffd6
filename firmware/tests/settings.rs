//! Settings survive restarts, power cuts at any word, and pages that hold anything.

use firmware::app::Session;
use firmware::circuit::{Circuit, Constants, ConstantsFault, ZeroPotential};
use firmware::link::message::{
    Configuration, KeepFault, Kept, KeptBaseline, Refusal, Report, Request, Setting,
};
use firmware::settings::{KeepError, Keeper, PAGE_BYTES};
use mock_board::*;
use model_core::blob::Floats;
use model_core::checksum::CRC_32;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

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
    let settings = SharedSettings::default();
    let configuration = Configuration { contact_threshold: 0.25, ..quiet() };
    let scanning = Configuration { frame_period_us: 1000, ..configuration };
    let mut slots = Flash::slots_with(&blob(1, 3));
    {
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let mut ask =
            |request: &Request<'_>| ask(&mut session, &bench.board, request, |r| kept(&r)).0;
        assert_eq!(
            ask(&Request::Kept),
            Kept { configuration: None, constants: false, baseline: None, writes_left: 100 }
        );
    }
    {
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let constants = circuit();
        let set = Request::SetConstants(constants.constants().unwrap());
        ask(&mut session, &bench.board, &set, |report| match report {
            Report::Constants(found) => assert_eq!(Some(found), constants.constants()),
            other => panic!("{other:?}"),
        });
        let capture = [
            Request::Configure { configuration: scanning, lease_ms: 0 },
            Request::CaptureBaseline { frames: 3 },
        ];
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
        let written = settings.words_written();
        for setting in Setting::ALL {
            assert_eq!(ask(&Request::Keep(setting)), all);
        }
        assert_eq!(settings.words_written(), written);
    }
    {
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        ask(&mut session, &bench.board, &Request::Configuration, |report| match report {
            Report::Configuration { configuration, .. } => assert_eq!(configuration, scanning),
            other => panic!("{other:?}"),
        });
        ask(&mut session, &bench.board, &Request::Constants, |report| match report {
            Report::Constants(found) => assert_eq!(Some(found), circuit().constants()),
            other => panic!("{other:?}"),
        });
        // The baseline is in force: a frame that differs from it is a contact.
        let decode = |session: &mut TestSession<'_>, ohm: f32| {
            let mut frame = frame_at_rest();
            frame[1][2] = ohm;
            let readings_ohm = Floats::new(frame.as_flattened());
            let request = Request::Decode { frame: 1, readings_ohm };
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
            let set = Request::SetConstants(circuit.constants().unwrap());
            ask(&mut session, &bench.board, &set, |_| ());
            assert_eq!(decode(&mut session, 40.0) & 16, contact);
        }

        let mut ask =
            |request: &Request<'_>| ask(&mut session, &bench.board, request, |r| kept(&r)).0;
        for setting in Setting::ALL {
            ask(&Request::Forget(setting));
        }
        let none = Kept { configuration: None, constants: false, baseline: None, writes_left: 97 };
        assert_eq!(ask(&Request::Kept), none);
    }
    let mut bench = Bench::with_settings(quiet(), &settings);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    ask(&mut session, &bench.board, &Request::Constants, |report| match report {
        Report::Constants(found) => {
            assert_eq!(Some(found), ZeroPotential::<ROWS, COLS>::TYPICAL.constants());
        }
        other => panic!("{other:?}"),
    });
    let keep = Request::Keep(Setting::Baseline);
    let refused = ask(&mut session, &bench.board, &keep, |report| refusal(&report)).0;
    assert_eq!(refused, Refusal::Keep(KeepFault::Nothing));
}

#[test]
fn a_configuration_that_is_kept_under_a_lease_outlasts_the_lease() {
    let mut slots = Flash::slots_with(&blob(1, 3));
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let leased = Configuration { contact_threshold: 0.25, ..quiet() };
    let requests = [
        Request::Configure { configuration: leased, lease_ms: 500 },
        Request::Keep(Setting::Configuration),
    ];
    for request in &requests {
        ask(&mut session, &bench.board, request, |_| ());
    }
    bench.board.pins.borrow_mut().now_us += 501_000;
    session.step();
    let asked = ask(&mut session, &bench.board, &Request::Configuration, |report| match report {
        Report::Configuration { configuration, lease_left_ms } => (configuration, lease_left_ms),
        other => panic!("{other:?}"),
    });
    assert_eq!(asked.0, (leased, 0));
}

#[test]
fn a_configuration_of_another_version_is_not_believed_and_constants_are() {
    let mut settings = SharedSettings::default();
    let mut slots = Flash::slots_with(&blob(1, 3));
    {
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        for setting in [Setting::Configuration, Setting::Constants] {
            ask(&mut session, &bench.board, &Request::Keep(setting), |_| ());
        }
    }
    let kept_now = |slots: &mut [Flash; 2], settings: &SharedSettings| {
        let mut bench = Bench::with_settings(quiet(), settings);
        let mut session = Session::start(&mut bench.app, slots, &mut []);
        ask(&mut session, &bench.board, &Request::Kept, |report| kept(&report)).0
    };
    let found = kept_now(&mut slots, &settings);
    assert_eq!((found.configuration, found.constants), (Some(quiet()), true));
    // As the firmware before kept it: without what is sent of a confidence.
    let before = b"\x01\x90\x4e\x64\x01\0\x01\0\0\xa0\x40\0\0\x7a\x44\x0a\xd7\xa3\x3c\0\0\0\0";
    settings.keep_bytes(Setting::Configuration, before).unwrap();
    let found = kept_now(&mut slots, &settings);
    assert_eq!((found.configuration, found.constants), (None, true));
}

#[test]
fn a_baseline_of_other_wires_is_ignored_until_a_model_of_its_wires_comes() {
    let mut settings = SharedSettings::default();
    let readings: Vec<u8> = [60.0_f32; 4].iter().flat_map(|ohm| ohm.to_le_bytes()).collect();
    let bytes = [&[2, 2, 2, 7, 0, 0, 0, 0, 0][..], &readings].concat();
    settings.keep_bytes(Setting::Baseline, &bytes).unwrap();
    let mut slots = Flash::slots_with(&blob(1, 3));
    let mut bench = Bench::with_settings(quiet(), &settings);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let keep = Request::Keep(Setting::Baseline);
    let refused = ask(&mut session, &bench.board, &keep, |report| refusal(&report)).0;
    assert_eq!(refused, Refusal::Keep(KeepFault::Nothing)); // none is in force
    let (found, _) = ask(&mut session, &bench.board, &Request::Kept, |report| kept(&report));
    assert_eq!(found.baseline, Some(KeptBaseline { rows: 2, columns: 2, frames: 7 }));
}

#[test]
fn what_is_out_of_range_is_refused_and_what_was_in_force_stays() {
    let mut slots = Flash::slots();
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let good = circuit();
    let mut set = |circuit: &dyn AnyCircuit| {
        let request = Request::SetConstants(circuit.all());
        ask(&mut session, &bench.board, &request, |report| match report {
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
    assert_eq!(set(&good), Ok(()));
    for (circuit, fault) in &bad {
        assert_eq!(set(circuit), Err(*fault));
    }
    assert_eq!(set(&ZeroPotential::<2, 2>::TYPICAL), Err(ConstantsFault::Length));
    assert_eq!(set(&ZeroPotential::<3, 3>::TYPICAL), Err(ConstantsFault::Length));
    ask(&mut session, &bench.board, &Request::Constants, |report| match report {
        Report::Constants(found) => assert_eq!(Some(found), good.constants()),
        other => panic!("{other:?}"),
    });
}

/// A circuit of any size.
trait AnyCircuit {
    fn all(&self) -> Constants<'_>;
}

impl<C: Circuit> AnyCircuit for C {
    fn all(&self) -> Constants<'_> {
        self.constants().unwrap()
    }
}

#[test]
fn writes_are_limited_between_restarts() {
    let settings = SharedSettings::default();
    let mut slots = Flash::slots();
    for _ in 0..2 {
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let mut kept_times = 0;
        let refused = loop {
            let threshold = 0.001 + kept_times as f32 * 1e-5;
            let configuration = Configuration { contact_threshold: threshold, ..quiet() };
            ask(
                &mut session,
                &bench.board,
                &Request::Configure { configuration, lease_ms: 0 },
                |_| (),
            );
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
    }
}

/// Bytes of a setting, different for each `seed`.
fn bytes_of(setting: Setting, seed: usize) -> Vec<u8> {
    let length = [40, 187, 585][setting as usize];
    (0..length).map(|i| ((i * 7 + seed * 13) % 251) as u8).collect()
}

/// Places of the start items in a page.
fn starts(page: &[u8]) -> Vec<usize> {
    let is_start = |place: &usize| page[*place..].starts_with(b"ITEM\xFF\0\x04\0");
    (0..PAGE_BYTES).step_by(32).filter(is_start).collect()
}

#[test]
fn no_flipped_bit_of_a_start_item_loses_a_setting() {
    let mut settings = SharedSettings::default();
    settings.keep_bytes(Setting::Constants, &[7; 100]).unwrap();
    let pages = settings.bytes();
    let starts = starts(&pages[1]);
    assert_eq!(starts.len(), 2);
    for bit in starts.iter().flat_map(|start| 8 * start..8 * (start + 32)) {
        let mut page = pages[1].clone();
        page[bit / 8] ^= 1 << (bit % 8);
        let mut settings = SharedSettings::holding([&pages[0], &page]);
        assert_eq!(settings.recover(), Ok(()));
        assert_eq!(settings.read_owned(Setting::Constants), Some(vec![7; 100]), "{bit}");
    }
}

#[test]
fn an_item_that_was_torn_at_one_start_does_not_count_at_the_next() {
    let mut settings = SharedSettings::default();
    settings.keep_bytes(Setting::Constants, &[1; 40]).unwrap();
    settings.keep_bytes(Setting::Constants, &[2; 40]).unwrap();
    let whole = settings.bytes();
    let item = whole[1].rchunks(64).find(|cells| cells.starts_with(b"ITEM")).unwrap();
    let crc = item.as_ptr().addr() - whole[1].as_ptr().addr() + 48;
    // The power was cut in its CRC-32, whose bits are weak: they read as erased, and then as they should.
    let mut torn = whole.clone();
    torn[1][crc..crc + 8].fill(0xFF);
    let mut settings = SharedSettings::holding([&torn[0], &torn[1]]);
    assert_eq!(settings.recover(), Ok(()));
    assert_eq!(settings.read_owned(Setting::Constants), Some(vec![1; 40]));
    let mut later = settings.bytes();
    later[1][crc..crc + 4].copy_from_slice(&whole[1][crc..crc + 4]);
    let mut settings = SharedSettings::holding([&later[0], &later[1]]);
    assert_eq!(settings.read_owned(Setting::Constants), Some(vec![1; 40]));
}

#[test]
fn the_number_of_a_page_goes_on_at_0_behind_its_largest_value() {
    let mut settings = SharedSettings::default();
    settings.keep_bytes(Setting::Constants, &[7; 100]).unwrap();
    let mut pages = settings.bytes();
    for start in starts(&pages[1]) {
        let item = &mut pages[1][start..];
        item[8..12].fill(0xFF);
        let crc = CRC_32.checksum(&item[4..12]);
        item[12..16].copy_from_slice(&crc.to_le_bytes());
    }
    let mut settings = SharedSettings::holding([&pages[0], &pages[1]]);
    for number in 0..=255 {
        assert_eq!(settings.keep_bytes(Setting::Configuration, &[number; 40]), Ok(true));
        assert_eq!(settings.read_owned(Setting::Configuration), Some(vec![number; 40]));
        assert_eq!(settings.read_owned(Setting::Constants), Some(vec![7; 100]), "{number}");
    }
    assert!(settings.erases() > 1);
}

#[test]
fn pages_that_hold_anything_are_no_harm_and_can_be_used() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    for case in 0..1000 {
        let mut pages = [0, 1].map(|_| vec![0; PAGE_BYTES]);
        pages.iter_mut().for_each(|page| random.fill_bytes(page));
        // Half of them are noise behind the marks of items.
        let cells = pages.iter_mut().flat_map(|page| page.as_chunks_mut::<16>().0);
        for cell in cells.filter(|_| case % 2 == 1) {
            let kind = [0, 1, 2, 3, 0xFF][random.next_u32() as usize % 5];
            let length = cell[6];
            cell[..8].copy_from_slice(&[b'I', b'T', b'E', b'M', kind, 0, length, 0]);
        }
        let mut settings = SharedSettings::holding([&pages[0], &pages[1]]);
        for setting in Setting::ALL {
            assert_eq!(settings.read_owned(setting), None, "case {case}");
        }
        for setting in Setting::ALL {
            let new = bytes_of(setting, case);
            assert_eq!(settings.keep_bytes(setting, &new), Ok(true), "case {case}");
            assert_eq!(settings.read_owned(setting), Some(new), "case {case}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_lost() {
    let mut settings = SharedSettings::default();
    settings.keep_bytes(Setting::Constants, &[7; 100]).unwrap();
    assert_eq!(
        settings.keep_bytes(Setting::Baseline, &[1; PAGE_BYTES - 100]),
        Err(KeepError::TooLarge)
    );
    assert_eq!(settings.read_owned(Setting::Constants), Some(vec![7; 100]));
    assert_eq!(settings.erases(), 1); // before the first one was kept
    settings.keep_bytes(Setting::Constants, &[]).unwrap();
    // Beside two settings of nothing, and room for four start items.
    let most = PAGE_BYTES - 2 * 32 - 4 * 32 - 16;
    for (length, outcome) in [(most + 1, Err(KeepError::TooLarge)), (most, Ok(true))] {
        assert_eq!(settings.keep_bytes(Setting::Baseline, &vec![1; length]), outcome);
    }
}

#[test]
fn the_settings_of_a_sensor_of_16_rows_and_32_columns_fit_however_often_they_change() {
    let settings = SharedSettings::default();
    let mut buffer = [0; 2200];
    let lengths = [40, 11 + 4 * (16 + 2 * 32), 9 + 4 * 16 * 32];
    for seed in 0..30_u8 {
        for (setting, length) in Setting::ALL.into_iter().zip(lengths) {
            let bytes = vec![seed; length];
            let mut pages = settings.0.borrow_mut();
            assert_eq!(pages.keep(setting, &[&bytes]), Ok(true), "{seed}");
            assert_eq!(pages.read(setting, &mut buffer), Some(&bytes[..]), "{seed}");
        }
    }
    assert!(settings.erases() > 4);
}

//! Settings survive restarts, power cuts at any word, and pages that hold anything.

use firmware::app::Session;
use firmware::circuit::{Circuit, Constants, ConstantsFault, ZeroPotential};
use firmware::link::message::{
    Configuration, KeepFault, Kept, KeptBaseline, Refusal, Report, Request, Setting,
};
use firmware::settings::{KeepError, Keeper, PAGE_BYTES};
use mock_board::*;
use model_core::blob::Floats;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Bits that a cut leaves as they were.
const CUTS: [u32; 3] = [0x0F0F_0F0F, 0xFFFF_FFF0, 0x3F7F_7F3F];

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
    let mut slots = MockSlot::pair_with(&blob(1, 3));
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
            let readings_ohm = Floats::of(frame.as_flattened());
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
fn a_configuration_of_another_version_is_not_believed_and_constants_are() {
    let mut settings = SharedSettings::default();
    let mut slots = MockSlot::pair_with(&blob(1, 3));
    {
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        for setting in [Setting::Configuration, Setting::Constants] {
            ask(&mut session, &bench.board, &Request::Keep(setting), |_| ());
        }
    }
    let kept_now = |slots: &mut [MockSlot; 2], settings: &SharedSettings| {
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
    let bytes = [&[1, 2, 2, 7, 0, 0, 0, 0, 0][..], &readings].concat();
    settings.keep_bytes(Setting::Baseline, &bytes).unwrap();
    let mut slots = MockSlot::pair_with(&blob(1, 3));
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
    let mut slots = MockSlot::pair();
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
    let mut slots = MockSlot::pair();
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

#[test]
fn the_power_may_go_in_the_middle_of_any_word_also_while_pages_are_exchanged() {
    // Enough writes for an exchange of the pages.
    let mut base = SharedSettings::default();
    for setting in Setting::ALL {
        assert_eq!(base.keep_bytes(setting, &bytes_of(setting, 0)), Ok(true));
    }
    let (mut cuts, mut exchanges) = (0, 0);
    let mut newest = [0; 3];
    for seed in 1..35 {
        let setting = Setting::ALL[seed % 3];
        let new = bytes_of(setting, seed);
        let before = base.bytes();
        for untouched in CUTS {
            for operations in 0.. {
                let mut settings = SharedSettings::holding([&before[0], &before[1]]);
                settings.cut_power_after(operations, untouched);
                let kept = settings.keep_bytes(setting, &new);
                if !settings.power_on() {
                    assert_eq!(kept, Ok(true));
                    break;
                }
                cuts += 1;
                for (other, seed) in Setting::ALL.into_iter().zip(newest) {
                    let found = settings.read_owned(other);
                    let old = Some(bytes_of(other, seed));
                    let is_new = other == setting && found.as_ref() == Some(&new);
                    assert!(
                        found == old || is_new,
                        "{other:?} after {operations} words of keeping {setting:?} {seed}: {found:?}"
                    );
                }
                // It can be kept at the next attempt.
                assert!(settings.keep_bytes(setting, &new).is_ok(), "{operations} words");
                assert_eq!(settings.read_owned(setting).as_ref(), Some(&new));
            }
        }
        let erases = base.erases();
        assert_eq!(base.keep_bytes(setting, &new), Ok(true));
        exchanges += usize::from(base.erases() > erases);
        newest[setting as usize] = seed;
    }
    assert!(exchanges >= 1, "{exchanges}");
    assert!(cuts > 3 * 2048 * exchanges, "{cuts}"); // at every word of every erase, and more
    // Wear: the pages were erased once in so many writes.
    assert!(base.erases() <= 4, "{}", base.erases());
}

/// What both pages hold.
type Pages = [Vec<u8>; 2];

/// Pages just before and after settings moved to the other one, eight times, and the number of that one.
fn exchanges() -> Vec<(Pages, Pages, usize)> {
    let mut settings = SharedSettings::default();
    let mut exchanges = Vec::new();
    for seed in 0.. {
        let (erases, before) = (settings.erases(), settings.bytes());
        let setting = Setting::ALL[seed % 3];
        settings.keep_bytes(setting, &bytes_of(setting, seed)).unwrap();
        if settings.erases() > erases && erases > 0 {
            let after = settings.bytes();
            let new = usize::from(before[0] == after[0]);
            exchanges.push((before, after, new));
        }
        if exchanges.len() == 8 {
            break;
        }
    }
    exchanges
}

fn all(pages: &Pages) -> [Option<Vec<u8>>; 3] {
    let mut settings = SharedSettings::holding([&pages[0], &pages[1]]);
    Setting::ALL.map(|setting| settings.read_owned(setting))
}

#[test]
fn an_older_page_whose_erase_was_cut_does_not_count() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut torn = [0, 0];
    for (before, _, new) in exchanges() {
        let mut expected = all(&before);
        for density in [1, 3, 7, 10] {
            let mut few = || (0..density).fold(0xFF, |bits, _| bits & random.next_u32() as u8);
            let mut pages = before.clone();
            pages[new].iter_mut().for_each(|byte| *byte |= few());
            assert_eq!(all(&pages), expected, "{density}");
            let mut cut = SharedSettings::holding([&pages[0], &pages[1]]);
            assert_eq!(cut.make_firm(), Ok(()));
            assert_eq!(all(&cut.bytes()), expected, "{density}");
            let setting = Setting::ALL[density % 3];
            assert_eq!(cut.keep_bytes(setting, &[7]), Ok(true));
            let earlier = expected[setting as usize].replace(vec![7]);
            assert_eq!(all(&cut.bytes()), expected, "{density}");
            expected[setting as usize] = earlier;
        }
        torn[new] += usize::from(before[new].iter().any(|byte| *byte != 0xFF));
    }
    assert!(torn[0] >= 1 && torn[1] >= 1, "{torn:?}");
}

/// Bytes of a start item.
const START_BYTES: usize = 32;
/// Place of its CRC-32, behind which its last word is.
const START_CRC: usize = 12;

/// Pages just before and after exchanges, the number of the new one, and the places of its start items.
fn with_starts() -> Vec<(Pages, Pages, usize, [usize; 2])> {
    let with_starts = |(before, after, new): (Pages, Pages, usize)| {
        let last = after[new].iter().rposition(|byte| *byte != 0xFF).unwrap();
        let end = (last + 1).next_multiple_of(START_BYTES);
        let starts = [end - 2 * START_BYTES, end - START_BYTES];
        assert!(starts.iter().all(|start| after[new][*start..].starts_with(b"ITEM\xFF\0\x04\0")));
        (before, after, new, starts)
    };
    exchanges().into_iter().map(with_starts).collect()
}

#[test]
fn a_weak_start_item_does_not_count_again_behind_erases_that_were_cut() {
    let mut cuts = 0;
    for (before, after, new, starts) in with_starts() {
        // The power was cut in the CRC-32 of the first start item: its bits are weak, and read as erased now.
        let mut pages = before.clone();
        pages[new].clone_from(&after[new]);
        pages[new][starts[0] + START_CRC..].fill(0xFF);
        let expected = all(&before);
        // The mark is being overwritten, or not yet, when the power is cut again; and then in the middle of the erase.
        for first in [None, Some(0xFFFF_FFFE), Some(0xFFFF_0000)] {
            for operations in (1..).step_by(7) {
                let mut settings = SharedSettings::holding([&pages[0], &pages[1]]);
                if let Some(untouched) = first {
                    settings.cut_power_after(0, untouched);
                    let _ = settings.make_firm();
                    assert!(settings.power_on());
                }
                settings.cut_power_after(operations, 0xFFFF_FFFF);
                let _ = settings.make_firm();
                let was_cut = settings.power_on();
                cuts += usize::from(was_cut);
                // At this start weak bits read as they should have become, or as they were.
                let mut found = settings.bytes();
                for place in starts[0] + START_CRC..starts[0] + START_CRC + 4 {
                    found[new][place] &= after[new][place];
                }
                let mark = &mut found[new][starts[0]..starts[0] + 4];
                if mark.iter().any(|byte| *byte != 0) {
                    mark.copy_from_slice(b"ITEM");
                }
                let mut settings = SharedSettings::holding([&found[0], &found[1]]);
                assert_eq!(settings.make_firm(), Ok(()));
                let is_right = all(&settings.bytes()) == expected;
                assert!(is_right, "{first:08x?}, then {operations} operations");
                if !was_cut {
                    break;
                }
            }
        }
    }
    assert!(cuts > 1000, "{cuts}");
}

#[test]
fn what_is_added_behind_a_weak_start_item_does_not_seem_a_part_of_it() {
    for (before, after, new, starts) in with_starts() {
        // The power was cut in the CRC-32 of the first start item, which reads right now; then in the second one.
        let mut pages = before.clone();
        pages[new].clone_from(&after[new]);
        pages[new][starts[0] + START_CRC + 4..].fill(0xFF);
        for operations in 0..4 {
            let mut settings = SharedSettings::holding([&pages[0], &pages[1]]);
            settings.cut_power_after(operations, 0xFFFF_0000);
            let _ = settings.make_firm();
            assert!(settings.power_on(), "{operations}");
            // Now it reads right, and at the next start wrong.
            let mut found = settings.bytes();
            settings.cut_power_after(0, 0xFFFF_FFFF);
            let _ = settings.make_firm();
            found[new][starts[0] + START_CRC] |= 0xFF;
            assert_eq!(settings.bytes()[1 - new], before[1 - new], "it was erased: {operations}");
            assert_eq!(all(&found), all(&before), "{operations}");
        }
    }
}

#[test]
fn a_page_that_reads_as_erased_is_erased_before_it_is_written() {
    // Behind an erase that was cut, weak bits may read as ones, and later as zeros.
    for (before, after, new) in exchanges() {
        let mut pages = before.clone();
        pages[new].fill(0xFF);
        let settings = SharedSettings::holding([&pages[0], &pages[1]]);
        let (old, expected) = (all(&before), all(&after));
        let is_changed = |setting: &Setting| old[*setting as usize] != expected[*setting as usize];
        let changed = Setting::ALL.into_iter().find(is_changed).unwrap();
        let content = expected[changed as usize].as_ref().unwrap();
        settings.clone().keep_bytes(changed, content).unwrap();
        assert_eq!((settings.erases(), all(&settings.bytes())), (1, expected));
    }
}

#[test]
fn pages_that_hold_anything_are_no_harm_and_can_be_used() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut full = SharedSettings::default();
    for seed in 0..20 {
        for setting in Setting::ALL {
            full.keep_bytes(setting, &bytes_of(setting, seed)).unwrap();
        }
    }
    let full = full.bytes();
    let mut readable = 0;
    for case in 0..3000 {
        let mut pages = match case % 3 {
            // Noise; noise behind the marks of items; what was kept, with damage.
            0 | 1 => [0, 1].map(|_| {
                let mut page = vec![0; PAGE_BYTES];
                random.fill_bytes(&mut page);
                page
            }),
            _ => full.clone(),
        };
        if case % 3 == 1 {
            for page in &mut pages {
                for cell in page.as_chunks_mut::<16>().0 {
                    let kind = [0, 1, 2, 3, 0xFF][random.next_u32() as usize % 5];
                    let length = cell[6];
                    cell[..8].copy_from_slice(&[b'I', b'T', b'E', b'M', kind, 0, length, 0]);
                }
            }
        }
        if case % 3 == 2 {
            for _ in 0..=random.next_u32() % 8 {
                let place = random.next_u32() as usize % PAGE_BYTES;
                pages[random.next_u32() as usize % 2][place] ^= 1 << (random.next_u32() % 8);
            }
        }
        let mut settings = SharedSettings::holding([&pages[0], &pages[1]]);
        for setting in Setting::ALL {
            if let Some(found) = settings.read_owned(setting) {
                readable += 1;
                assert!((0..20).any(|seed| found == bytes_of(setting, seed)), "case {case}");
            }
        }
        for setting in Setting::ALL {
            let new = bytes_of(setting, 100 + case);
            let kept = settings.keep_bytes(setting, &new);
            assert!(kept.is_ok(), "case {case}: {kept:?}");
            assert_eq!(settings.read_owned(setting), Some(new), "case {case}");
        }
    }
    assert!((2900..=3000).contains(&readable), "{readable}"); // hardly any damage reaches the newest items
}

#[test]
fn an_application_starts_with_its_defaults_whatever_the_bytes_of_a_setting_are() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(12);
    for case in 0..500 {
        let mut settings = SharedSettings::default();
        for setting in Setting::ALL {
            let mut bytes = vec![0; random.next_u32() as usize % 60];
            random.fill_bytes(&mut bytes);
            if let Some(version) = bytes.first_mut().filter(|_| case % 2 == 0) {
                *version = 1;
            }
            settings.keep_bytes(setting, &bytes).unwrap();
        }
        let mut slots = MockSlot::pair_with(&blob(1, 3));
        let mut bench = Bench::with_settings(quiet(), &settings);
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let (kept, _) = ask(&mut session, &bench.board, &Request::Kept, |report| kept(&report));
        assert!(!kept.constants && kept.configuration.is_none(), "case {case}: {kept:?}");
        ask(&mut session, &bench.board, &Request::Constants, |report| match report {
            Report::Constants(found) => {
                assert_eq!(Some(found), ZeroPotential::<ROWS, COLS>::TYPICAL.constants());
            }
            other => panic!("{other:?}"),
        });
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

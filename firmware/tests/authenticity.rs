//! With a key on the device, a host without it changes nothing. Each test is an attack of docs/reliability.md.

use mock_board::*;
use taxel_core::blob::Floats;
use taxel_core::checksum::CRC_32;
use taxel_firmware::app::{Session, SessionEnd};
use taxel_firmware::circuit::{Circuit, ZeroPotential};
use taxel_firmware::link::cobs;
use taxel_firmware::link::message::{
    Configuration, KeyState, Refusal, Report, Request, SealFault, Setting, UploadState, UploadStep,
};
use taxel_firmware::link::packet::PROTOCOL_VERSION;
use taxel_firmware::store::{Kind, Slot};

const KEY: [u8; 32] = [0x42; 32];
const OTHER: [u8; 32] = [0x43; 32];
/// Number of an attacker's requests.
const NUMBER: u16 = 77;

fn fault<T>(fault: SealFault) -> Result<T, Refusal> {
    Err(Refusal::Seal(fault))
}

/// A device with a key and the model `blob(1, 3)`, flashed.
fn with_key() -> Device {
    Device::with_key(Flash::slots_with(&blob(1, 3)), &KEY)
}

/// What the device says to the bytes of a request: why it refuses it, if it does.
fn said(session: &mut Running<'_, '_>, board: &Board, bytes: Vec<u8>) -> Result<(), Refusal> {
    let read = |report: Report<'_>| match report {
        Report::Refused(refusal) => Err(refusal),
        _ => Ok(()),
    };
    send(session, board, bytes, read).0
}

#[test]
fn whoever_comes_first_sets_no_key_unless_somebody_at_the_board_allows_it() {
    let old = blob(1, 3);
    let mut device = Device::new(Flash::slots_with(&old));
    assert_eq!(device.provision(KEY), fault(SealFault::NotAllowed));
    assert_eq!(device.identity().1, KeyState::None);
    let next = blob(2, 4);
    assert_eq!(device.install(&next), confirmed(&next), "the owner is not locked out");
    device.is_held = true;
    assert_eq!(device.provision(KEY), Ok(()));
    device.is_held = false;
    assert_eq!(device.provision(KEY), Ok(()), "the answer was lost");
    let (model, key, _) = device.identity();
    assert_eq!((model.unwrap().crc_32, key), (crc_of(&next), KeyState::Set), "the model stays");
}

#[test]
fn the_watchdog_is_fed_before_flash_is_erased_for_a_key_or_a_counter() {
    let mut device = Device::new(Flash::slots_with(&blob(1, 3)));
    device.is_held = true;
    device.session(|session, board| {
        let fed = board.pins.borrow().feeds;
        assert_eq!(provision(session, board, KEY), (Ok(()), None));
        assert_eq!(board.pins.borrow().feeds - fed, 2, "in its turn, and before");
        let fed = board.pins.borrow().feeds;
        assert_eq!(said(session, board, sealed(&KEY, 1, &Request::Resume)), Ok(()));
        assert_eq!(board.pins.borrow().feeds - fed, 2);
    });
}

#[test]
fn a_key_is_replaced_by_whoever_has_it_and_by_nobody_else() {
    let mut device = with_key();
    device.is_held = true;
    device.key = None;
    assert_eq!(device.provision(OTHER), fault(SealFault::Missing), "not even with the button");
    device.key = Some(OTHER);
    assert_eq!(device.provision(OTHER), fault(SealFault::Forged));
    device.key = Some(KEY);
    assert_eq!(device.provision(OTHER), Ok(()));
    assert_eq!(device.undo(1), fault(SealFault::Forged), "the old one counts no more");
    device.key = Some(OTHER);
    assert_eq!(device.undo(1), Err(Refusal::NothingToUndo));
}

#[test]
fn a_model_comes_into_force_by_whoever_has_the_key_alone() {
    let new = blob(2, 4);
    let mut device = with_key();
    for (key, why) in [(None, SealFault::Missing), (Some(OTHER), SealFault::Forged)] {
        device.key = key;
        assert_eq!(device.install(&new), fault(why));
        assert_eq!(device.slots[1].erases, 0);
    }
    device.key = Some(KEY);
    // Somebody else puts chunks of another model of that length into the owner's upload.
    let other = blob(5, 4);
    let forged = trial_steps(&other)[1];
    device.session(|session, board| {
        ask(session, board, &Request::Upload(begin(&new)), |_| ());
        let refused = said(session, board, request_bytes(NUMBER, &Request::Upload(forged)));
        assert_eq!(refused, fault(SealFault::Missing));
    });
    assert_eq!(device.slots[1].words_written, 0);
    assert_eq!(device.install(&new), confirmed(&new));
    assert_eq!(device.restart(), Some(crc_of(&new)));
}

#[test]
fn an_older_model_comes_back_neither_by_a_replay_nor_by_an_undo() {
    let (first, second) = (blob(2, 4), blob(3, 4));
    let mut device = with_key();
    let steps: Vec<Vec<u8>> = (1..)
        .zip(confirmed_steps(&first))
        .map(|(counter, step)| sealed(&KEY, counter, &Request::Upload(step)))
        .collect();
    device.install(&first).unwrap();
    device.install(&second).unwrap();
    device.key = None;
    assert_eq!(device.undo(crc_of(&second)), fault(SealFault::Missing));
    let last = device.identity().2;
    for _ in 0..2 {
        let erases = device.slots[0].erases;
        device.session(|session, board| {
            let begun = said(session, board, steps[0].clone());
            assert_eq!(begun, fault(SealFault::Counter { last }));
            let confirmed = said(session, board, steps[steps.len() - 1].clone());
            assert_eq!(confirmed, fault(SealFault::Counter { last }));
        });
        assert_eq!(device.slots[0].erases, erases);
        assert_eq!(device.restart(), Some(crc_of(&second)));
    }
    // Whoever has the key may go back.
    device.key = Some(KEY);
    assert_eq!(device.undo(crc_of(&second)), confirmed(&first));
}

/// Calls `use_it` with each request that changes what estimates are made of.
fn settings(mut use_it: impl FnMut(&Request<'_>)) {
    let ohm = [70.0; 6];
    let circuit = ZeroPotential::<ROWS, COLS> { drive_v: 0.25, ..ZeroPotential::TYPICAL };
    let other = Configuration { contact_threshold: 0.5, ..quiet() };
    use_it(&configure(other));
    use_it(&Request::SetConstants(circuit.constants().unwrap()));
    use_it(&Request::SetBaseline { readings_ohm: Floats::new(&ohm) });
    for setting in Setting::ALL {
        use_it(&Request::Keep(setting));
    }
}

/// What the device shows of its settings.
fn shown(session: &mut Running<'_, '_>, board: &Board) -> String {
    let ohm = [60.0; 6];
    let decode = Request::Decode { frame: 1, start_us: 0, readings_ohm: Floats::new(&ohm) };
    let requests = [Request::Configuration, Request::Constants, Request::Kept, decode];
    requests.map(|request| ask(session, board, &request, |report| format!("{report:?}")).0).concat()
}

#[test]
fn nobody_without_the_key_changes_constants_baseline_or_configuration_not_even_by_a_replay() {
    let mut device = with_key();
    device.session(|session, board| {
        let original = shown(session, board);
        board.pins.borrow_mut().key = None;
        settings(|request| {
            let refused = ask(session, board, request, |report| format!("{report:?}")).0;
            assert!(refused.contains("Seal(Missing)"), "{request:?}: {refused}");
        });
        assert_eq!(shown(session, board), original);
        // The owner changes them, and back again.
        let mut recorded = Vec::new();
        settings(|request| {
            recorded.push(sealed(&KEY, recorded.len() as u64 + 1, request));
        });
        recorded.iter().for_each(|it| assert_eq!(said(session, board, it.clone()), Ok(())));
        let changed = shown(session, board);
        assert_ne!(changed, original);
        let last = recorded.len() as u64;
        let back = configure(quiet());
        assert_eq!(said(session, board, sealed(&KEY, last + 1, &back)), Ok(()));
        let now = shown(session, board);
        for replayed in &recorded {
            let refused = said(session, board, replayed.clone());
            assert_eq!(refused, fault(SealFault::Counter { last: last + 1 }));
        }
        assert_eq!(shown(session, board), now);
    });
    // At the next start the counter is beyond all of them.
    device.session(|session, board| {
        let replayed = sealed(&KEY, 1, &configure(quiet()));
        let refused = said(session, board, replayed);
        assert_eq!(refused, fault(SealFault::Counter { last: 1001 }));
    });
}

#[test]
fn a_seal_for_one_device_is_none_for_another_and_none_holds_another_seal() {
    let mut device = with_key();
    device.session(|session, board| {
        let mut buffer = [0; 64];
        let request = postcard::to_slice(&Request::Restart, &mut buffer).unwrap();
        let tag = taxel_firmware::seal::tag(&KEY, b"mock board 2", 1, request);
        let elsewhere = Request::Sealed { counter: 1, tag, request };
        let refused = said(session, board, request_bytes(NUMBER, &elsewhere));
        assert_eq!(refused, fault(SealFault::Forged));
        let mut inner = [0; 64];
        let inner = postcard::to_slice(&elsewhere, &mut inner).unwrap();
        let tag = taxel_firmware::seal::tag(&KEY, &Board::UNIQUE_ID, 1, inner);
        let outer = Request::Sealed { counter: 1, tag, request: inner };
        assert_eq!(said(session, board, request_bytes(NUMBER, &outer)), Err(Refusal::Unknown));
        // What follows a request in its seal, or is none.
        for bytes in [&[7, 0][..], &[250], &[]] {
            let tag = taxel_firmware::seal::tag(&KEY, &Board::UNIQUE_ID, 2, bytes);
            let more = Request::Sealed { counter: 2, tag, request: bytes };
            let said = said(session, board, request_bytes(NUMBER, &more));
            let expected = Err(Refusal::Unknown);
            assert!(said == expected || said == fault(SealFault::Counter { last: 2 }), "{said:?}");
        }
    });
}

#[test]
fn no_counter_uses_up_those_that_follow_and_a_thousand_cost_one_write() {
    let mut device = with_key();
    device.session(|session, board| {
        for counter in [u64::MAX, u64::MAX - 1000, 1_000_001, 0] {
            let refused = said(session, board, sealed(&KEY, counter, &Request::Resume));
            assert_eq!(refused, fault(SealFault::Counter { last: 0 }), "{counter}");
        }
        assert_eq!(said(session, board, sealed(&KEY, 1_000_000, &Request::Resume)), Ok(()));
    });
    let written = |device: &mut Device| -> usize {
        device.journal.pages().iter().map(|page| page.words_written).sum()
    };
    let before = written(&mut device);
    device.session(|session, board| {
        for counter in 1_001_001..=1_002_000 {
            assert_eq!(said(session, board, sealed(&KEY, counter, &Request::Resume)), Ok(()));
        }
    });
    assert_eq!(written(&mut device) - before, 6, "mark, head, counter, CRC-32, zeros");
    assert_eq!(device.identity().2, 1_002_001);
}

#[test]
fn a_counter_that_cannot_be_written_down_does_not_count() {
    let mut device = with_key();
    device.session(|session, board| {
        assert_eq!(said(session, board, sealed(&KEY, 5, &Request::Resume)), Ok(()));
    });
    let supply = device.journal.pages()[0].supply();
    device.session(|session, board| {
        supply.borrow_mut().on(Some(0));
        let next = sealed(&KEY, 2000, &configure(Configuration::DEFAULT));
        assert_eq!(said(session, board, next.clone()), Err(Refusal::Flash));
        supply.borrow_mut().on(None);
        assert_eq!(said(session, board, next), Ok(()));
    });
}

#[test]
fn no_request_without_the_key_wears_flash_and_a_host_with_it_is_limited() {
    let mut device = with_key();
    let model = blob(2, 4);
    device.slots.iter_mut().for_each(|slot| slot.erase_interval_s = 600);
    let worn = |device: &mut Device| -> usize {
        let flashes = device.slots.iter().chain(device.journal.pages().iter());
        flashes.map(|flash| flash.erases + flash.words_written).sum()
    };
    let before = worn(&mut device);
    device.key = None;
    device.session(|session, board| {
        for _ in 0..1000 {
            for request in [
                Request::Upload(begin(&model)),
                Request::Keep(Setting::Configuration),
                Request::Forget(Setting::Constants),
                Request::Undo { crc_32: crc_of(&blob(1, 3)) },
                Request::Provision { key: OTHER },
            ] {
                let bytes = request_bytes(NUMBER, &request);
                assert_eq!(said(session, board, bytes), fault(SealFault::Missing));
            }
            assert!(said(session, board, sealed(&OTHER, 1, &Request::Restart)).is_err());
        }
    });
    assert_eq!(worn(&mut device), before);
    device.key = Some(KEY);
    device.session(|session, board| {
        let steps = trial_steps(&model);
        let erased = (0..1000).take_while(|_| {
            let begun = upload_step(session, board, steps[0]).0;
            let _ = upload_step(session, board, steps[1]);
            begun == Ok(UploadState::Receiving { received: 0 })
        });
        assert_eq!(erased.count(), 100);
    });
}

#[test]
fn requests_without_the_key_prolong_no_lease() {
    let mut device = with_key();
    device.session(|session, board| {
        let leased = Configuration { contact_threshold: 0.25, ..quiet() };
        let request = Request::Configure { configuration: leased, lease_ms: 10_000 };
        ask(session, board, &request, |_| ());
        let (ohm, model) = ([60.0; 6], blob(2, 4));
        let chunk = UploadStep::Chunk { offset: 0, bytes: &[0; 4] };
        ask(session, board, &Request::Upload(begin(&model)), |_| ());
        for request in [
            Request::Decode { frame: 1, start_us: 0, readings_ohm: Floats::new(&ohm) },
            Request::Kept,
            Request::Resume,
            Request::Upload(chunk),
        ] {
            board.pins.borrow_mut().now_us += 3_000_000;
            let _ = said(session, board, request_bytes(NUMBER, &request));
        }
        session.step();
        let (configuration, left) =
            ask(session, board, &Request::Configuration, |report| match report {
                Report::Configuration { configuration, lease_left_ms } => {
                    (configuration, lease_left_ms)
                }
                other => panic!("{other:?}"),
            })
            .0;
        assert_eq!((configuration, left), (quiet(), 0));
    });
}

#[test]
fn a_key_that_decayed_lets_nothing_change_and_the_model_stays() {
    let mut device = with_key();
    let places: Vec<usize> = {
        let page = device.journal.pages()[1].bytes();
        (0..page.len()).step_by(32).filter(|at| page[*at..].starts_with(b"ITEM\x05")).collect()
    };
    assert_eq!(places.len(), 2);
    for place in places {
        device.journal.pages()[1].decay(place / 4 + 4, 1 << 9);
    }
    let (model, key, _) = device.identity();
    assert_eq!((model.unwrap().crc_32, key), (crc_of(&blob(1, 3)), KeyState::Damaged));
    for key in [None, Some(KEY)] {
        device.key = key;
        device.is_held = true;
        assert_eq!(device.install(&blob(2, 4)), fault(SealFault::KeyDamaged));
        assert_eq!(device.provision(KEY), fault(SealFault::KeyDamaged));
    }
}

#[test]
fn only_erasing_the_flash_removes_a_key_which_needs_a_debugger() {
    let mut device = with_key();
    device.journal.pages().iter_mut().for_each(|page| page.erase().unwrap());
    device.key = None;
    assert_eq!(device.identity().1, KeyState::None);
    assert_eq!(device.install(&blob(2, 4)), confirmed(&blob(2, 4)));
}

/// The device learns from nobody's presses: a recalibrated model comes as any other.
#[test]
fn there_is_no_request_behind_the_last_one() {
    let mut device = with_key();
    device.session(|session, board| {
        for variant in 18..=255_u8 {
            let covered = [&[PROTOCOL_VERSION, NUMBER as u8, variant][..], &[1; 8]].concat();
            let packet = [&covered[..], &CRC_32.checksum(&covered).to_le_bytes()].concat();
            let mut line = Vec::new();
            cobs::encode(&packet, |byte| {
                line.push(byte);
                true
            });
            assert_eq!(said(session, board, line), Err(Refusal::Unknown), "{variant}");
        }
    });
}

#[test]
fn a_sealed_restart_restarts() {
    let mut slots = Flash::slots_with(&blob(1, 3));
    let mut journal = Flash::journal();
    journal.keep(Kind::Key, &[&KEY]).unwrap();
    let mut bench = Bench::with_journal(quiet(), journal);
    let board = bench.board.clone();
    board.pins.borrow_mut().key = Some(KEY);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let ((), end) = ask(&mut session, &board, &Request::Restart, |_| ());
    assert_eq!(end, Some(SessionEnd::Restart));
}

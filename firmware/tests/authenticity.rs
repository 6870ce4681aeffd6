//! With a key on the device, only models sealed with it come into force, and no older ones.

use firmware::app::{Session, SessionEnd};
use firmware::link::message::{KeyState, Refusal, SealFault, UploadStep};
use firmware::seal::{Key, Seal};
use firmware::store::Slot;
use mock_board::*;

const KEY: Key = [0x42; 32];
/// Words of a copy of the key.
const COPY: usize = 12;

/// A device with this key, and a model of version 5 in force.
fn with_key() -> Device {
    let mut device = Device::new(Flash::slots());
    device.key = Flash::with_key(&KEY);
    install(&mut device, 5, &blob(1, 3)).unwrap();
    device
}

/// Uploads `blob`, sealed as this version.
fn install(device: &mut Device, version: u32, blob: &[u8]) -> Answer {
    device.install(blob, Some(Seal::new(&KEY, version, blob)))
}

/// A model's CRC-32, and the version that it was sealed with.
type Versioned = (u32, Option<u32>);

/// The model in force, whether there is a key, and the highest version.
fn identity(device: &mut Device) -> (Option<Versioned>, KeyState, Option<u32>) {
    let (model, key, highest) = device.identity();
    (model.map(|model| (model.crc_32, model.version)), key, highest)
}

fn fault(fault: SealFault) -> Answer {
    Err(Refusal::Seal(fault))
}

#[test]
fn a_sealed_model_comes_into_force_and_stays() {
    let mut device = with_key();
    for version in [6, 7, 4_000_000_000] {
        let next = blob(version as usize % 10, 4);
        assert_eq!(install(&mut device, version, &next), confirmed(&next));
        let expected = (Some((crc_of(&next), Some(version))), KeyState::Set, Some(version));
        assert_eq!(identity(&mut device), expected);
    }
}

#[test]
fn no_older_model_comes_back() {
    let mut device = with_key();
    let [first, second, third] = [blob(1, 3), blob(2, 4), blob(3, 4)];
    let outdated = fault(SealFault::Outdated { highest: 6 });
    assert_eq!(install(&mut device, 6, &second), confirmed(&second));
    assert_eq!(install(&mut device, 5, &first), outdated, "replayed");
    assert_eq!(install(&mut device, 6, &third), outdated, "same version");
    // The refused uploads have erased the other slot.
    assert_eq!(device.undo(crc_of(&second)), Err(Refusal::NothingToUndo));
    // The same once more is no step back.
    assert_eq!(install(&mut device, 6, &second), confirmed(&second));
    assert_eq!(install(&mut device, 7, &third), confirmed(&third));
    assert_eq!(device.undo(crc_of(&third)), fault(SealFault::Outdated { highest: 7 }));
    assert_eq!(identity(&mut device).0, Some((crc_of(&third), Some(7))));
}

#[test]
fn a_trial_that_ends_leaves_the_version_unused() {
    let mut device = with_key();
    let (second, third) = (blob(2, 4), blob(3, 4));
    let mut steps = trial_steps(&second, Some(Seal::new(&KEY, 6, &second)));
    steps.push(UploadStep::Abort);
    device.upload(&steps).unwrap();
    assert_eq!(identity(&mut device).2, Some(5));
    assert_eq!(install(&mut device, 6, &third), confirmed(&third));
}

#[test]
fn a_key_is_set_once_and_models_from_before_are_left() {
    let old = blob(1, 3);
    let mut slots = Flash::slots_with(&old);
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let feeds = || board.pins.borrow().feeds;
    let fed = feeds();
    assert_eq!(provision(&mut session, &board, KEY), (Ok(()), Some(SessionEnd::NewModel)));
    assert_eq!(feeds() - fed, 2, "in its turn, and before flash is erased");
    let _ = session;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    assert_eq!(model_crc(&mut session, &board), None, "it has no seal");
    assert_eq!(provision(&mut session, &board, KEY), (Ok(()), None), "the answer was lost");
    let is_set = Err(Refusal::Seal(SealFault::KeyIsSet));
    assert_eq!(provision(&mut session, &board, [1; 32]), (is_set, None));
    let _ = session;
    let mut device = Device::new(slots);
    device.key = bench.app.platform().key.clone();
    assert_eq!(install(&mut device, 0, &old), confirmed(&old));
    assert_eq!(identity(&mut device).0, Some((crc_of(&old), Some(0))));
    assert_eq!(device.undo(crc_of(&old)), fault(SealFault::Missing));
}

#[test]
fn without_a_key_a_seal_is_refused_and_with_a_decayed_one_every_model() {
    let next = blob(2, 4);
    let mut device = Device::new(Flash::slots_with(&blob(1, 3)));
    assert_eq!(install(&mut device, 6, &next), fault(SealFault::NoKey));
    assert_eq!(identity(&mut device).1, KeyState::None);

    let mut device = with_key();
    device.key.decay(1, 1 << 24);
    device.key.decay(1 + COPY, 1 << 24);
    let damaged = fault(SealFault::KeyDamaged);
    assert_eq!((install(&mut device, 6, &next), device.install(&next, None)), (damaged, damaged));
    assert_eq!(identity(&mut device), (None, KeyState::Damaged, None));
    // Only whoever has the key can set it again.
    assert_eq!(device.provision([0x43; 32]), Err(Refusal::Seal(SealFault::KeyDamaged)));
    assert_eq!(device.provision(KEY), Ok(()));
    assert_eq!(identity(&mut device).1, KeyState::Set);
    assert_eq!(install(&mut device, 6, &next), confirmed(&next));
}

#[test]
fn a_blob_that_leaves_room_for_its_seal_alone_is_taken_and_a_longer_one_costs_no_erase() {
    let mut device = with_key();
    let most = Flash::SLOT_BYTES - 16 - 40;
    let too_large = Err(Refusal::TooLarge { slot_bytes: most as u32 });
    for (length, erases) in [(most + 4, 0), (most, 1)] {
        let blob = blob_of_length(length);
        let before = device.slots[0].erases + device.slots[1].erases;
        let expected = if erases == 0 { too_large } else { confirmed(&blob) };
        assert_eq!(install(&mut device, 6, &blob), expected);
        assert_eq!(device.slots[0].erases + device.slots[1].erases, before + erases);
    }
}

#[test]
fn a_model_whose_seal_decays_or_is_written_by_a_debugger_is_not_in_force() {
    let mut device = with_key();
    let second = blob(2, 4);
    install(&mut device, 6, &second).unwrap();
    let seal = second.len().div_ceil(4);
    assert_eq!(&device.slots[0].bytes()[4 * seal..4 * seal + 4], b"SEAL");
    device.slots[0].decay(seal + 3, 1 << 9);
    let (model, _, highest) = identity(&mut device);
    assert_eq!((model, highest), (Some((crc_of(&blob(1, 3)), Some(5))), Some(5)));
}

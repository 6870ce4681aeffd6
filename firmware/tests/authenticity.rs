//! With a key on the device, only models sealed with it come into force, and no older ones.

use firmware::app::{Leave, Session};
use firmware::link::message::{
    Identity, KeyState, RecalibrationFault, RecalibrationStep, Refusal, Report, Request, SealFault,
    UploadState, UploadStep,
};
use firmware::platform::Platform;
use firmware::seal::{Key, Seal};
use firmware::store::Slot;
use mock_board::*;

const CHUNK: usize = 60;
const KEY: Key = [0x42; 32];
/// Bytes of a copy of the key.
const COPY: usize = 48;

/// A device with a key, and its flash.
struct Device {
    slots: [Flash; 2],
    key: Flash,
}

/// A model's CRC-32, and the version that it was sealed with.
type Versioned = (u32, Option<u32>);

impl Device {
    /// A device with this key, and a model of version 5 in force.
    fn new() -> Self {
        let mut device = Self { slots: Flash::slots(), key: Flash::with_key(&KEY) };
        let first = blob(1, 3);
        device.install(&first, Some(Seal::of(&KEY, 5, &first))).unwrap();
        device
    }

    /// Starts it anew, uploads `blob` and confirms it.
    fn install(&mut self, blob: &[u8], seal: Option<Seal>) -> Result<UploadState, Refusal> {
        let mut steps = upload_steps(blob, CHUNK);
        steps.pop();
        steps.extend([UploadStep::Try { seal }, UploadStep::Confirm]);
        upload(&mut Bench::with_key(quiet(), &self.key), &mut self.slots, &mut [], &steps)
    }

    /// Starts it anew, and asks for its identity: the model's CRC-32 and version, and the highest version.
    fn identity(&mut self) -> (Option<Versioned>, KeyState, Option<u32>) {
        let mut bench = Bench::with_key(quiet(), &self.key);
        let mut session = Session::start(&mut bench.app, &mut self.slots, &mut []);
        let identity = ask(&mut session, &bench.board, &Request::Identify, |report| match report {
            Report::Identity(Identity { model, key, highest_version, .. }) => {
                (model.map(|model| (model.crc_32, model.version)), key, highest_version)
            }
            other => panic!("{other:?}"),
        });
        self.key = bench.app.platform().key_area().clone();
        identity.0
    }

    /// Starts it anew, and sets `key`.
    fn provision(&mut self, key: Key) -> Result<(), Refusal> {
        let mut bench = Bench::with_key(quiet(), &self.key);
        let mut session = Session::start(&mut bench.app, &mut self.slots, &mut []);
        let done =
            ask(&mut session, &bench.board, &Request::Provision { key }, |report| match report {
                Report::Provisioned => Ok(()),
                Report::Refused(refusal) => Err(refusal),
                other => panic!("{other:?}"),
            });
        self.key = bench.app.platform().key_area().clone();
        done.0
    }

    fn undo(&mut self, left: u32) -> Result<(), Refusal> {
        let mut bench = Bench::with_key(quiet(), &self.key);
        let mut session = Session::start(&mut bench.app, &mut self.slots, &mut []);
        let step = Request::Recalibrate(RecalibrationStep::Undo { crc_32: left });
        ask(&mut session, &bench.board, &step, |report| match report {
            Report::Recalibration(_) => Ok(()),
            Report::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        })
        .0
    }
}

fn fault(fault: SealFault) -> Result<UploadState, Refusal> {
    Err(Refusal::Seal(fault))
}

fn confirmed(blob: &[u8]) -> UploadState {
    UploadState::Confirmed { crc_32: crc_of(blob) }
}

#[test]
fn a_sealed_model_comes_into_force_and_stays() {
    let mut device = Device::new();
    for version in [6, 7, 4_000_000_000] {
        let next = blob(version as usize % 10, 4);
        assert_eq!(
            device.install(&next, Some(Seal::of(&KEY, version, &next))),
            Ok(confirmed(&next))
        );
        let expected = (Some((crc_of(&next), Some(version))), KeyState::Set, Some(version));
        assert_eq!(device.identity(), expected);
    }
}

#[test]
fn no_older_model_comes_back() {
    let mut device = Device::new();
    let [first, second, third] = [blob(1, 3), blob(2, 4), blob(3, 4)];
    let outdated = fault(SealFault::Outdated { highest: 6 });
    assert_eq!(device.install(&second, Some(Seal::of(&KEY, 6, &second))), Ok(confirmed(&second)));
    assert_eq!(device.install(&first, Some(Seal::of(&KEY, 5, &first))), outdated, "replayed");
    assert_eq!(device.install(&third, Some(Seal::of(&KEY, 6, &third))), outdated, "same version");
    // The refused uploads have erased the other slot.
    let nothing = Refusal::Recalibration(RecalibrationFault::NothingToUndo);
    assert_eq!(device.undo(crc_of(&second)), Err(nothing));
    // The same once more is no step back.
    assert_eq!(device.install(&second, Some(Seal::of(&KEY, 6, &second))), Ok(confirmed(&second)));
    let third_seal = Seal::of(&KEY, 7, &third);
    assert_eq!(device.install(&third, Some(third_seal)), Ok(confirmed(&third)));
    let back = device.undo(crc_of(&third));
    assert_eq!(back, Err(Refusal::Seal(SealFault::Outdated { highest: 7 })));
    assert_eq!(device.identity().0, Some((crc_of(&third), Some(7))));
}

#[test]
fn a_trial_that_ends_leaves_the_version_unused() {
    let mut device = Device::new();
    let (second, third) = (blob(2, 4), blob(3, 4));
    let mut steps = upload_steps(&second, CHUNK);
    steps.pop();
    steps.extend([UploadStep::Try { seal: Some(Seal::of(&KEY, 6, &second)) }, UploadStep::Abort]);
    let mut bench = Bench::with_key(quiet(), &device.key);
    upload(&mut bench, &mut device.slots, &mut [], &steps).unwrap();
    assert_eq!(device.identity().2, Some(5));
    assert_eq!(device.install(&third, Some(Seal::of(&KEY, 6, &third))), Ok(confirmed(&third)));
}

#[test]
fn a_key_is_set_once_and_models_from_before_are_left() {
    let old = blob(1, 3);
    let mut slots = Flash::slots_with(&old);
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let provision = |session: &mut TestSession<'_>, key: Key| {
        ask(session, &board, &Request::Provision { key }, |report| match report {
            Report::Provisioned => Ok(()),
            Report::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        })
    };
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let feeds = || board.pins.borrow().feeds;
    let fed = feeds();
    assert_eq!(provision(&mut session, KEY), (Ok(()), Some(Leave::NewModel)));
    assert_eq!(feeds() - fed, 2, "in its turn, and before flash is erased");
    let _ = session;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    assert_eq!(model_crc(&mut session, &board), None, "it has no seal");
    assert_eq!(provision(&mut session, KEY), (Ok(()), None), "the answer was lost");
    let is_set = Err(Refusal::Seal(SealFault::KeyIsSet));
    assert_eq!(provision(&mut session, [1; 32]), (is_set, None));
    let _ = session;
    let key = bench.app.platform().key_area().clone();
    let mut device = Device { slots, key };
    assert_eq!(device.install(&old, Some(Seal::of(&KEY, 0, &old))), Ok(confirmed(&old)));
    assert_eq!(device.identity().0, Some((crc_of(&old), Some(0))));
    assert_eq!(device.undo(crc_of(&old)), Err(Refusal::Seal(SealFault::Missing)));
}

#[test]
fn without_a_key_a_seal_is_refused_and_with_a_decayed_one_every_model() {
    let next = blob(2, 4);
    let seal = Seal::of(&KEY, 6, &next);
    let mut device = Device { slots: Flash::slots_with(&blob(1, 3)), key: Flash::without_key() };
    assert_eq!(device.install(&next, Some(seal)), fault(SealFault::NoKey));
    assert_eq!(device.identity().1, KeyState::None);

    let mut device = Device::new();
    device.key.decay(1, 1 << 24);
    device.key.decay(1 + COPY / 4, 1 << 24);
    let damaged = fault(SealFault::KeyDamaged);
    assert_eq!(
        (device.install(&next, Some(seal)), device.install(&next, None)),
        (damaged, damaged)
    );
    assert_eq!(device.identity(), (None, KeyState::Damaged, None));
    // Only whoever has the key can set it again.
    assert_eq!(device.provision([0x43; 32]), Err(Refusal::Seal(SealFault::KeyDamaged)));
    assert_eq!(device.provision(KEY), Ok(()));
    assert_eq!(device.identity().1, KeyState::Set);
    assert_eq!(device.install(&next, Some(seal)), Ok(confirmed(&next)));
}

#[test]
fn a_blob_that_leaves_room_for_its_seal_alone_is_taken_and_a_longer_one_costs_no_erase() {
    let mut device = Device::new();
    let most = Flash::SLOT_BYTES - 16 - 40;
    let erases = |device: &Device| device.slots[0].erases + device.slots[1].erases;
    let [fits, longer] = [most, most + 4].map(blob_of_length);
    let mut install = |blob: &[u8]| {
        let before = erases(&device);
        let outcome = device.install(blob, Some(Seal::of(&KEY, 6, blob)));
        (outcome, erases(&device) - before)
    };
    let too_large = Refusal::TooLarge { slot_bytes: most as u32 };
    assert_eq!(install(&longer), (Err(too_large), 0));
    assert_eq!(install(&fits), (Ok(confirmed(&fits)), 1));
}

#[test]
fn a_model_whose_seal_decays_or_is_written_by_a_debugger_is_not_in_force() {
    let mut device = Device::new();
    let second = blob(2, 4);
    device.install(&second, Some(Seal::of(&KEY, 6, &second))).unwrap();
    let seal = second.len().div_ceil(4);
    assert_eq!(&device.slots[0].bytes()[4 * seal..4 * seal + 4], b"SEAL");
    device.slots[0].decay(seal + 3, 1 << 9);
    let (model, _, highest) = device.identity();
    assert_eq!((model, highest), (Some((crc_of(&blob(1, 3)), Some(5))), Some(5)));
}

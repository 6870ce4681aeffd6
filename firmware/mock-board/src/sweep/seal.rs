//! Requests to a device with a key: only what was sealed with it, for this device and just now, changes anything.

use taxel_core::blob::Floats;
use taxel_firmware::link::message::{Refusal, Report, Request, SealFault, Setting, UploadStep};
use taxel_firmware::seal::{KEY_BYTES, Key, tag};
use taxel_firmware::store::Slot;

use crate::bench::{Running, quiet};
use crate::board::Board;
use crate::device::{Device, confirmed};
use crate::flash::Flash;
use crate::host::{ask, configure, request_bytes, sealed, send};
use crate::models::{blob, crc_of};

/// Kinds of attack.
pub const KINDS: u64 = 9;

/// Number of an attacker's requests.
const NUMBER: u16 = 77;

/// Counter of the last request that was sealed before the attack.
const LAST: u64 = 40_000;

/// Calls `attack` with a request that changes something: each in turn.
fn with_request<T>(turn: u64, head: &[u8], attack: impl FnOnce(&Request<'_>) -> T) -> T {
    let ohm = [60.0_f32; 6];
    let readings_ohm = Floats::new(&ohm);
    attack(&match turn % 14 {
        0 => configure(quiet()),
        1 => Request::SetBaseline { readings_ohm },
        2 => Request::CaptureBaseline { frames: 1 },
        3 => Request::Keep(Setting::Configuration),
        4 => Request::Forget(Setting::Constants),
        5 => Request::Undo { crc_32: crc_of(&blob(1, 3)) },
        6 => Request::Restart,
        7 => Request::Resume,
        8 => Request::Provision { key: [9; KEY_BYTES] },
        9 => Request::Upload(UploadStep::Abort),
        10 => Request::Upload(UploadStep::Confirm),
        11 => Request::Upload(UploadStep::Try { lease_ms: 60_000 }),
        12 => Request::Upload(UploadStep::Chunk { offset: 0, bytes: head }),
        _ => Request::Upload(UploadStep::Begin { head }),
    })
}

/// The bytes that an attacker sends, and what the device must say to them: each kind in turn, and with each kind another
/// bit or number.
fn attack(seed: u64, key: &Key, request: &Request<'_>) -> (Vec<u8>, SealFault) {
    let place = (seed / KINDS) as usize;
    let mut buffer = [0; 256];
    let bytes = postcard::to_slice(request, &mut buffer).expect("it is short");
    let genuine = tag(key, &Board::UNIQUE_ID, LAST + 1, bytes);
    let with = |counter, tag, request: &[u8]| {
        request_bytes(NUMBER, &Request::Sealed { counter, tag, request })
    };
    let other = |bytes: &[u8]| {
        let mut other = bytes.to_vec();
        let bit = place % (8 * bytes.len());
        other[bit / 8] ^= 1 << (bit % 8);
        other
    };
    let replayed = SealFault::Counter { last: LAST };
    match seed % KINDS {
        0 => (request_bytes(NUMBER, request), SealFault::Missing),
        1 => {
            let tag = other(&genuine).try_into().expect("as long as it was");
            (with(LAST + 1, tag, bytes), SealFault::Forged)
        }
        2 => (with(LAST + 1, genuine, &other(bytes)), SealFault::Forged),
        3 => (with(LAST + 1 + (1 << (place % 20)), genuine, bytes), SealFault::Forged),
        4 => {
            let key = other(key).try_into().expect("as long as it was");
            (sealed(&key, LAST + 1, request), SealFault::Forged)
        }
        5 => {
            let id = other(&Board::UNIQUE_ID).try_into().expect("as long as it was");
            (with(LAST + 1, tag(key, &id, LAST + 1, bytes), bytes), SealFault::Forged)
        }
        6 => (sealed(key, LAST - place as u64 * 7 % LAST, request), replayed),
        7 => (sealed(key, LAST + 1_000_001 + place as u64, request), replayed),
        _ => (sealed(key, u64::MAX - place as u64, request), replayed),
    }
}

/// What a device's flash holds.
fn flash(slots: &[Flash; 2], device: &mut Device) -> Vec<u8> {
    let pages = device.journal.pages().iter().flat_map(Slot::bytes);
    slots.iter().flat_map(Slot::bytes).chain(pages).copied().collect()
}

/// Attacks a device by a request that its key's owner has not sealed just now: it must be refused, nothing in flash may
/// change, and what the owner asks for must be done then.
///
/// # Errors
/// What is wrong.
pub fn forge(seed: u64) -> Result<f64, String> {
    let key: Key = std::array::from_fn(|i| (seed.wrapping_mul(31) >> (i % 8)) as u8 ^ i as u8);
    let mut device = Device::with_key(Flash::slots_with(&blob(1, 3)), &key);
    device.is_held = true; // which is of no use once there is a key
    let model = blob(2, 4);
    let head = &model[..16];
    let before = flash(&device.slots.clone(), &mut device);
    let outcome = device.session(|session, board| {
        let last = sealed(&key, LAST, &Request::Resume);
        let resumed = send(session, board, last, |report| !matches!(report, Report::Refused(_)));
        if !resumed.0 {
            return Err("a genuine request is refused".to_owned());
        }
        with_request(seed / KINDS, head, |request| {
            let (bytes, fault) = attack(seed, &key, request);
            expect(session, board, bytes, fault)
                .map_err(|why| format!("attack {} by {request:?}: {why}", seed % KINDS))
        })
    });
    outcome?;
    // The one request that was sealed has had its counter written down, and nothing else.
    let after = flash(&device.slots.clone(), &mut device);
    let slots = 2 * Flash::SLOT_BYTES;
    if before[..slots] != after[..slots] || device.restart() != Some(crc_of(&blob(1, 3))) {
        return Err(format!("attack {}: it changes a slot or the model", seed % KINDS));
    }
    let taken = device.install(&model);
    let stays = taken == confirmed(&model) && device.restart() == Some(crc_of(&model));
    if stays { Ok(0.0) } else { Err(format!("a genuine model: {taken:?}")) }
}

/// Sends bytes that must be refused for this reason, and change nothing that the device shows.
fn expect(
    session: &mut Running<'_, '_>,
    board: &Board,
    bytes: Vec<u8>,
    fault: SealFault,
) -> Result<(), String> {
    let before = shown(session, board);
    let (found, end) = send(session, board, bytes, |report| match report {
        Report::Refused(refusal) => Ok(refusal),
        other => Err(format!("{other:?}")),
    });
    let is_right = found? == Refusal::Seal(fault) && end.is_none();
    match shown(session, board) {
        after if is_right && after == before => Ok(()),
        after => Err(format!("refused otherwise, or it changes {before} to {after}")),
    }
}

/// What the device shows of itself.
fn shown(session: &mut Running<'_, '_>, board: &Board) -> String {
    let requests = [Request::Identify, Request::Configuration, Request::Constants, Request::Kept];
    requests.map(|request| ask(session, board, &request, |report| format!("{report:?}")).0).concat()
}

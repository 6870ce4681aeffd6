//! Models for a device with a key: only what was sealed with it, and nothing older, comes into force.

use firmware::app::Session;
use firmware::link::message::{Refusal, SealFault, UploadState, UploadStep};
use firmware::seal::{KEY_BYTES, Key, Seal};
use mock_board::{
    Bench, KeyArea, Memory, MockSlot, blob, crc_of, model_crc, quiet, upload, upload_steps,
};
use model_core::checksum::CRC_32;

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const FORGED: Promise = Promise {
    name: "seal-forged",
    text: "no forged, replayed or older model is confirmed",
    share: 1,
    check: forged,
};

/// Bytes of a chunk of an upload.
const CHUNK: usize = 60;
/// Version of the model in force.
const VERSION: u32 = 1000;
/// Kinds of attack.
const KINDS: u64 = 9;

/// What an attacker sends.
struct Attack {
    blob: Vec<u8>,
    seal: Option<Seal>,
    /// Number of chunks that are left out at the end.
    lost: usize,
    /// The refusal that names it, if it is always the same.
    named: Option<SealFault>,
}

/// Each kind in turn, and with each kind another byte, bit or version in turn.
fn attack(seed: u64, key: &Key) -> Attack {
    let mut genuine = blob(2, 4).to_vec();
    let place = (seed / KINDS) as usize;
    let seal = |version, blob: &[u8]| Some(Seal::of(key, version, blob));
    let good = Seal::of(key, VERSION + 1, &genuine);
    let (mut lost, mut named) = (0, Some(SealFault::Forged));
    let outdated = Some(SealFault::Outdated { highest: VERSION });
    let seal = match seed % KINDS {
        0 => {
            let mut tag = good.tag;
            tag[place % KEY_BYTES] ^= 1 << (place / KEY_BYTES % 8);
            Some(Seal { tag, ..good })
        }
        1 => Some(Seal { version: good.version ^ 1 << (place % 32), ..good }),
        2 => {
            // Any bit but those of the closing CRC-32, which is made right again.
            let bits = 8 * (genuine.len() - 4);
            let bit = place % bits;
            genuine[bit / 8] ^= 1 << (bit % 8);
            let (covered, crc) =
                genuine.split_last_chunk_mut::<4>().expect("it ends with a CRC-32");
            *crc = CRC_32.checksum(covered).to_le_bytes();
            named = None; // it may be no sound model either
            Some(good)
        }
        3 => {
            named = outdated;
            seal((place as u32).wrapping_mul(7) % VERSION, &genuine)
        }
        4 => {
            named = outdated;
            seal(VERSION, &genuine)
        }
        5 => {
            lost = 1 + place % 3;
            named = None;
            Some(good)
        }
        6 => {
            let mut other = *key;
            other[place % KEY_BYTES] ^= 1 << (place / KEY_BYTES % 8);
            Some(Seal::of(&other, VERSION + 1, &genuine))
        }
        7 => {
            named = Some(SealFault::Missing);
            None
        }
        _ => {
            // Another sound model under the seal of this one.
            genuine = blob(3 + place % 7, 4).to_vec();
            Some(good)
        }
    };
    Attack { blob: genuine, seal, lost, named }
}

/// A device with a key, and what survives a restart.
struct Device {
    slots: [MockSlot; 2],
    key: KeyArea,
    memory: Box<Memory>,
}

impl Device {
    /// Starts it, uploads `blob` without its last `lost` chunks, and confirms it.
    fn install(
        &mut self,
        blob: &[u8],
        seal: Option<Seal>,
        lost: usize,
    ) -> Result<UploadState, Refusal> {
        let mut steps = upload_steps(blob, CHUNK);
        steps.truncate(steps.len() - 1 - lost);
        steps.extend([UploadStep::Try { seal }, UploadStep::Confirm]);
        let mut bench = Bench::within_with_key(&mut self.memory, quiet(), &self.key);
        upload(&mut bench, &mut self.slots, &mut [0; 512], &steps)
    }

    /// Starts it; returns the CRC-32 of the model in force.
    fn model(&mut self) -> Option<u32> {
        let mut bench = Bench::within_with_key(&mut self.memory, quiet(), &self.key);
        let mut session = Session::start(&mut bench.app, &mut self.slots, &mut []);
        model_crc(&mut session, &bench.board)
    }
}

fn forged(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let case = |seed: u64| {
        let key: Key = std::array::from_fn(|i| (seed.wrapping_mul(31) >> (i % 8)) as u8 ^ i as u8);
        let mut device = Device {
            slots: MockSlot::pair(),
            key: KeyArea::with(&key),
            memory: Box::new(Memory::new()),
        };
        let first = blob(1, 3);
        let genuine = |device: &mut Device, version, blob: &[u8]| {
            let taken = device.install(blob, Some(Seal::of(&key, version, blob)), 0);
            let is_right = taken == Ok(UploadState::Confirmed { crc_32: crc_of(blob) });
            if is_right { Ok(()) } else { Err(format!("a genuine model: {taken:?}")) }
        };
        genuine(&mut device, VERSION, &first)?;
        let attack = attack(seed, &key);
        let outcome = device.install(&attack.blob, attack.seal, attack.lost);
        let is_named = attack.named.is_none_or(|fault| outcome == Err(Refusal::Seal(fault)));
        if outcome.is_ok() || !is_named || device.model() != Some(crc_of(&first)) {
            return Err(format!("attack {}: {outcome:?}", seed % KINDS));
        }
        let next = blob(2, 4);
        genuine(&mut device, VERSION + 1, &next)?;
        if device.model() == Some(crc_of(&next)) { Ok(0.0) } else { Err("it is lost".to_owned()) }
    };
    Ok(effort.worst((8 * KINDS * 256, 10_000_000), (0.0, "taken"), case))
}

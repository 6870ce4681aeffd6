//! Models for a device with a key: only what was sealed with it, and nothing older, comes into force.

use firmware::link::message::{Refusal, SealFault};
use firmware::seal::{KEY_BYTES, Key, Seal};
use model_core::checksum::CRC_32;

use crate::device::{Device, confirmed, confirmed_steps};
use crate::flash::Flash;
use crate::models::{blob, crc_of};

/// Version of the model in force.
const VERSION: u32 = 1000;
/// Kinds of attack.
pub const KINDS: u64 = 9;

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
    let seal = |version, blob: &[u8]| Some(Seal::new(key, version, blob));
    let good = Seal::new(key, VERSION + 1, &genuine);
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
            Some(Seal::new(&other, VERSION + 1, &genuine))
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

/// Attacks a device by a model that its key's owner has not sealed: it must be refused, and a genuine one must come into
/// force then.
///
/// # Errors
/// What is wrong.
pub fn forge(seed: u64) -> Result<f64, String> {
    let key: Key = std::array::from_fn(|i| (seed.wrapping_mul(31) >> (i % 8)) as u8 ^ i as u8);
    let mut device = Device::new(Flash::slots());
    device.key = Flash::with_key(&key);
    let first = blob(1, 3);
    let genuine = |device: &mut Device, version, blob: &[u8]| {
        let taken = device.install(blob, Some(Seal::new(&key, version, blob)));
        if taken == confirmed(blob) { Ok(()) } else { Err(format!("a genuine model: {taken:?}")) }
    };
    genuine(&mut device, VERSION, &first)?;
    let attack = attack(seed, &key);
    let mut steps = confirmed_steps(&attack.blob, attack.seal);
    let chunks = steps.len() - 2;
    steps.drain(chunks - attack.lost..chunks);
    let outcome = device.upload(&steps);
    let is_named = attack.named.is_none_or(|fault| outcome == Err(Refusal::Seal(fault)));
    if outcome.is_ok() || !is_named || device.restart() != Some(crc_of(&first)) {
        return Err(format!("attack {}: {outcome:?}", seed % KINDS));
    }
    let next = blob(2, 4);
    genuine(&mut device, VERSION + 1, &next)?;
    if device.restart() == Some(crc_of(&next)) { Ok(0.0) } else { Err("it is lost".to_owned()) }
}

//! Keys of devices, and seals made with them.

use std::time::Duration;

use firmware::link::message::{KeyState, Report, Request};
use firmware::seal::{Key, Seal};
use model_core::blob::Model;
use taxel_data::BadValue;

use super::{Device, DeviceIdentity, Wire};
use crate::error::{Error, KEY_DAMAGED, NO_KEY, Result};

/// Longest time in which a board sets a key: it may erase flash.
const SETTING: Duration = Duration::from_secs(5);

/// What a model is sealed with.
#[derive(Clone, Copy)]
pub struct Sealing {
    pub key: Key,
    /// Version of the model; if not given, the next one of the device.
    pub version: Option<u32>,
}

impl Sealing {
    /// Reads a key from the content of a file: 32 bytes, or 64 hexadecimal digits and white space.
    ///
    /// # Errors
    /// [`BadValue`] for anything else, and for a key whose bytes are all alike.
    pub fn key(content: &[u8]) -> std::result::Result<Key, BadValue> {
        let bad = |rule: &str| BadValue::new("key", format!("{} bytes", content.len()), rule);
        let key = Key::try_from(content).ok().or_else(|| of_digits(content));
        let key = key.ok_or_else(|| {
            bad("give 32 bytes or 64 hexadecimal digits; `openssl rand -hex 32` makes them")
        })?;
        if key.iter().all(|byte| *byte == key[0]) {
            return Err(bad("give other bytes than the same one again and again"));
        }
        Ok(key)
    }

    /// The seal of `blob` for the device of this `identity`. A blob that the device has in force keeps its version.
    fn seal(&self, identity: &DeviceIdentity, blob: &[u8]) -> Seal {
        let same = || {
            let model = identity.model?;
            let is_same = Model::decode(blob).is_ok_and(|new| new.crc() == model.crc_32);
            model.version.filter(|_| is_same)
        };
        let next = || identity.highest_version.map_or(1, |highest| highest.saturating_add(1));
        let version = self.version.or_else(same).unwrap_or_else(next);
        Seal::new(&self.key, version, blob)
    }
}

/// The key that these hexadecimal digits are.
fn of_digits(text: &[u8]) -> Option<Key> {
    let digits = text.iter().filter(|byte| !byte.is_ascii_whitespace());
    let digits: Option<Vec<u8>> =
        digits.map(|byte| Some(char::from(*byte).to_digit(16)? as u8)).collect();
    let bytes: Vec<u8> =
        digits?.chunks(2).map(|pair| pair.iter().fold(0, |b, d| b << 4 | d)).collect();
    let whole = text.iter().filter(|byte| !byte.is_ascii_whitespace()).count() == 2 * bytes.len();
    Key::try_from(bytes).ok().filter(|_| whole)
}

/// Checks that the device of this `identity` takes models with such a `sealing`.
///
/// # Errors
/// [`Error::Data`] for a seal that is missing or too many, and for a key that has decayed.
pub fn check_sealing(identity: &DeviceIdentity, sealing: Option<&Sealing>) -> Result<()> {
    match (identity.key, sealing) {
        (KeyState::None, None) | (KeyState::Set, Some(_)) => Ok(()),
        (KeyState::Set, None) => Err(Error::failed(
            "the device takes sealed models only: give its key, `upload --key FILE`",
        )),
        (KeyState::None, Some(_)) => Err(Error::failed(NO_KEY)),
        (KeyState::Damaged, _) => Err(Error::failed(KEY_DAMAGED)),
    }
}

/// The seal that the device of this `identity` needs for `blob`, if any.
pub(super) fn seal_for(
    identity: &DeviceIdentity,
    blob: &[u8],
    sealing: Option<&Sealing>,
) -> Result<Option<Seal>> {
    check_sealing(identity, sealing)?;
    Ok(sealing.map(|sealing| sealing.seal(identity, blob)))
}

impl<W: Wire> Device<W> {
    /// Sets the device's key, once and for all.
    pub fn provision(&mut self, key: &Key) -> Result<()> {
        let request = Request::Provision { key: *key };
        let timeout = SETTING.max(self.patience);
        let answer = self
            .ask(&request, timeout, |report| matches!(report, Report::Provisioned).then_some(()));
        answer?.map_err(Error::Refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_bytes_or_digits() {
        let bytes: Vec<u8> = (0..32).collect();
        let digits = bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().concat();
        let key = Sealing::key(&bytes).unwrap();
        assert_eq!(key.to_vec(), bytes);
        assert_eq!(Sealing::key(format!("{digits}\n").as_bytes()).unwrap(), key);
        for bad in [&bytes[1..], &digits.as_bytes()[1..], b"", &[7; 32], &[b'z'; 64], &[b'0'; 64]] {
            assert!(Sealing::key(bad).is_err(), "{bad:?}");
        }
    }
}

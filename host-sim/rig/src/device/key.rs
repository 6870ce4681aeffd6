//! Keys of devices, and requests sealed with them.

use taxel_data::BadValue;
use taxel_firmware::link::message::{KeyState, Refusal, Report, Request, SealFault};
use taxel_firmware::seal::{Key, tag};

use super::{Device, DeviceIdentity, WRITING};
use crate::error::{Error, KEY_DAMAGED, NO_KEY, Result};

/// Largest size of a request in a seal.
const MOST_BYTES: usize = 4096;

/// What a request is sealed with, besides the key.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counter {
    unique_id: [u8; 12],
    /// Counter of the last sealed request.
    last: u64,
}

impl Counter {
    /// The counter of the device of this `identity`.
    pub fn new(identity: &DeviceIdentity) -> Self {
        Self { unique_id: identity.unique_id, last: identity.counter }
    }

    /// Goes on behind the counter `last`.
    pub fn go_on(&mut self, last: u64) {
        self.last = last;
    }

    /// Passes the `request`, sealed with `key` and the next counter, to `send`.
    pub fn seal<T>(
        &mut self,
        key: &Key,
        request: &Request<'_>,
        send: impl FnOnce(&Request<'_>) -> Result<T>,
    ) -> Result<T> {
        let mut buffer = [0; MOST_BYTES];
        let request = postcard::to_slice(request, &mut buffer)
            .map_err(|cause| Error::failed(format!("a request that cannot be sealed: {cause}")))?;
        self.last = self.last.saturating_add(1);
        let (counter, tag) = (self.last, tag(key, &self.unique_id, self.last, request));
        send(&Request::Sealed { counter, tag, request })
    }
}

/// Reads a key from the content of a file: 32 bytes, or 64 hexadecimal digits and white space.
///
/// # Errors
/// [`BadValue`] for anything else, and for a key whose bytes are all alike.
pub fn key_of(content: &[u8]) -> std::result::Result<Key, BadValue> {
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

impl Device {
    /// Checks that this host may change something on the device of this `identity`, before work that would be in vain.
    ///
    /// # Errors
    /// [`Error::Data`] for a key that is missing or too many, and for one that has decayed.
    pub fn check_key(&self, identity: &DeviceIdentity) -> Result<()> {
        match (identity.key, self.key) {
            (KeyState::None, None) | (KeyState::Set, Some(_)) => Ok(()),
            (KeyState::Set, None) => Err(Error::failed(crate::error::KEY_MISSING)),
            (KeyState::None, Some(_)) => Err(Error::failed(NO_KEY)),
            (KeyState::Damaged, _) => Err(Error::failed(KEY_DAMAGED)),
        }
    }

    /// Sets the device's key. The first one needs somebody at the board; another one replaces it, sealed by the one before.
    pub fn provision(&mut self, key: &Key) -> Result<()> {
        let mut answer = self.ask_to_provision(key)?;
        if answer == Err(Refusal::Seal(SealFault::Forged)) {
            // The answer was lost, and the old key counts no more. The key that is in force already needs no seal.
            let old = self.key.take();
            if self.ask_to_provision(key)?.is_ok() {
                answer = Ok(());
            }
            self.key = old;
        }
        answer.map_err(Error::Refused)?;
        self.key = Some(*key);
        Ok(())
    }

    fn ask_to_provision(&mut self, key: &Key) -> Result<std::result::Result<(), Refusal>> {
        let request = Request::Provision { key: *key };
        let timeout = WRITING.max(self.patience);
        self.ask(&request, timeout, |report| matches!(report, Report::Provisioned).then_some(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_bytes_or_digits() {
        let bytes: Vec<u8> = (0..32).collect();
        let digits = bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().concat();
        let key = key_of(&bytes).unwrap();
        assert_eq!(key.to_vec(), bytes);
        assert_eq!(key_of(format!("{digits}\n").as_bytes()).unwrap(), key);
        for bad in [&bytes[1..], &digits.as_bytes()[1..], b"", &[7; 32], &[b'z'; 64], &[b'0'; 64]] {
            assert!(key_of(bad).is_err(), "{bad:?}");
        }
    }
}

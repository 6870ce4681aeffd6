//! Seals: a device with a key changes nothing for whoever does not have it.

use hmac::{Hmac, Mac};
use sha2::Sha256;

/// Length of a key and of a tag in bytes.
pub const KEY_BYTES: usize = 32;

/// A device's key.
pub type Key = [u8; KEY_BYTES];

/// First bytes that a tag covers, so that a tag of something else is none of a request.
const PURPOSE: &[u8; 16] = b"taxel request v1";

/// Tag of a sealed request: the HMAC-SHA256 of purpose, device, counter (little-endian) and request.
#[inline(never)] // so that its stack is not part of its callers'
pub fn tag(key: &Key, unique_id: &[u8; 12], counter: u64, request: &[u8]) -> [u8; KEY_BYTES] {
    // Longer than any key, so that none has to be hashed.
    let mut block = [0; 64];
    block.iter_mut().zip(key).for_each(|(place, byte)| *place = *byte);
    let mut mac = Hmac::<Sha256>::new((&block).into());
    for part in [&PURPOSE[..], unique_id, &counter.to_le_bytes(), request] {
        mac.update(part);
    }
    mac.finalize().into_bytes().into()
}

/// Whether two keys or tags are the same. No early exit: the time tells nothing of them.
pub fn is_same(one: &[u8; KEY_BYTES], other: &[u8; KEY_BYTES]) -> bool {
    one.iter().zip(other).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: Key = [7; KEY_BYTES];

    #[test]
    fn a_tag_is_of_its_own_key_device_counter_and_request_alone() {
        let request: Vec<u8> = (0..=255).cycle().take(1000).collect();
        let right = tag(&KEY, &[1; 12], 5, &request);
        let others = [
            tag(&[8; KEY_BYTES], &[1; 12], 5, &request),
            tag(&KEY, &[2; 12], 5, &request),
            tag(&KEY, &[1; 12], 6, &request),
            tag(&KEY, &[1; 12], 5, &request[1..]),
        ];
        assert!(is_same(&right, &tag(&KEY, &[1; 12], 5, &request)));
        assert!(others.iter().all(|other| !is_same(&right, other)));
        for bit in 0..8 * KEY_BYTES {
            let mut forged = right;
            forged[bit / 8] ^= 1 << (bit % 8);
            assert!(!is_same(&right, &forged), "bit {bit}");
        }
    }

    /// Made by `openssl dgst -sha256 -mac HMAC -macopt hexkey:0707…07` of these bytes in a file.
    #[test]
    fn a_tag_is_an_ordinary_hmac() {
        let tag = tag(&KEY, &[1; 12], 0x0102_0304, b"request");
        assert_eq!(
            tag.map(|byte| format!("{byte:02x}")).concat(),
            "1c5afe7fbdb8d1ae64be7d4c7a3381332dc0fc2f985ed86916b63aedcf24c402"
        );
    }
}

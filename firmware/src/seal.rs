//! Seals: who has a device's key may give it models, and nobody else.
//!
//! A seal is a version number and an HMAC-SHA256 over purpose, version and blob. The device makes the same to check
//! it.

use hmac::{Hmac, Mac};
use serde::{Deserialize, Serialize};
use sha2::Sha256;

/// Length of a key and of a tag, in bytes.
pub const KEY_BYTES: usize = 32;

/// A device's key.
pub type Key = [u8; KEY_BYTES];

/// First bytes that a tag covers, so that a tag of something else is none of a model.
const PURPOSE: &[u8; 16] = b"taxel model seal";

/// What proves that a blob may come into force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seal {
    /// Number that rises from model to model, so that no older one comes back.
    pub version: u32,
    /// HMAC-SHA256 of purpose, version (little-endian) and blob.
    pub tag: [u8; KEY_BYTES],
}

impl Seal {
    /// Seals `blob` as `version`.
    pub fn new(key: &Key, version: u32, blob: &[u8]) -> Self {
        Self { version, tag: tag(key, version, blob) }
    }

    /// Whether this is the seal of `blob`, found in a time that does not depend on the tag.
    pub fn fits(&self, key: &Key, blob: &[u8]) -> bool {
        is_same(&self.tag, &Self::new(key, self.version, blob).tag)
    }
}

/// Whether two keys or tags are the same. No early exit: the time tells nothing of them.
pub(crate) fn is_same(one: &[u8; KEY_BYTES], other: &[u8; KEY_BYTES]) -> bool {
    one.iter().zip(other).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

#[inline(never)] // so that its stack is not part of its callers'
fn tag(key: &Key, version: u32, blob: &[u8]) -> [u8; KEY_BYTES] {
    // Longer than any key, so that none has to be hashed.
    let mut block = [0; 64];
    block.iter_mut().zip(key).for_each(|(place, byte)| *place = *byte);
    let mut mac = Hmac::<Sha256>::new((&block).into());
    mac.update(PURPOSE);
    mac.update(&version.to_le_bytes());
    mac.update(blob);
    mac.finalize().into_bytes().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: Key = [7; KEY_BYTES];

    #[test]
    fn a_seal_fits_its_own_blob_key_and_version_alone() {
        let blob: Vec<u8> = (0..=255).cycle().take(1000).collect();
        let seal = Seal::new(&KEY, 5, &blob);
        assert!(seal.fits(&KEY, &blob));
        assert!(!seal.fits(&[8; KEY_BYTES], &blob) && !seal.fits(&KEY, &blob[1..]));
        assert!(!Seal { version: 6, ..seal }.fits(&KEY, &blob));
        for bit in 0..8 * KEY_BYTES {
            let mut forged = seal;
            forged.tag[bit / 8] ^= 1 << (bit % 8);
            assert!(!forged.fits(&KEY, &blob), "bit {bit}");
        }
    }

    /// Made by `openssl dgst -sha256 -mac HMAC -macopt hexkey:0707…07`, of these bytes in a file.
    #[test]
    fn a_tag_is_an_ordinary_hmac() {
        let seal = Seal::new(&KEY, 0x0102_0304, b"TAXL blob");
        let hex: Vec<String> = seal.tag.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(
            hex.concat(),
            "53b0868a96c38d86d04aec06cfc697cca7b91955442e1a930e5e8551e8b24396"
        );
    }
}

//! The digest that ties a model to the scene or data it was trained on.

const CRC_64: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

/// CRC-64/XZ: tells versions of a file apart. It does not protect against forgery.
#[must_use]
pub fn digest(bytes: &[u8]) -> u64 {
    CRC_64.checksum(bytes)
}

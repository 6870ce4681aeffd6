//! Bytes closed by the length and the CRC that a reader asks for, as someone does who means harm.

use taxel_core::AlignedBytes;
use taxel_core::blob::FORMAT_VERSION;
use taxel_core::checksum::CRC_32;

/// Bytes of a blob before its body: magic, version and length.
pub const PREFIX_BYTES: usize = 9;

/// A blob with this `body`, and the prefix and CRC that belong to it.
pub fn blob(body: &[u8]) -> AlignedBytes {
    let length = PREFIX_BYTES + body.len() + 4;
    let mut bytes = Vec::with_capacity(length);
    bytes.extend(b"TAXL");
    bytes.push(FORMAT_VERSION);
    bytes.extend((length as u32).to_le_bytes());
    bytes.extend(body);
    bytes.extend(CRC_32.checksum(&bytes).to_le_bytes());
    AlignedBytes::copy_of(&bytes)
}

/// The body of a blob.
pub fn body(blob: &[u8]) -> &[u8] {
    &blob[PREFIX_BYTES..blob.len() - 4]
}

/// A packet with these bytes before its CRC.
pub fn packet(covered: &[u8]) -> Vec<u8> {
    let crc = CRC_32.checksum(covered).to_le_bytes();
    [covered, &crc].concat()
}

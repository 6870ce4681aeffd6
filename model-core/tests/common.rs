//! What several tests of the blob share.

use model_core::checksum::CRC_32;

/// The blob's specification.
const SPECIFICATION: &str = include_str!("../../docs/blob.md");

/// Hexadecimal bytes of the specification's table between two comments `<!-- MARK -->`: lines like `| 0 | 54 41 … | … |`.
pub fn worked_bytes(mark: &str) -> Vec<u8> {
    let mark = format!("<!-- {mark} -->");
    let table = SPECIFICATION.split(&mark).nth(1).expect("the marked table");
    let mut bytes = Vec::new();
    for line in table.lines().filter(|line| line.starts_with('|')) {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let (Some(offset), Some(hex)) = (cells.next(), cells.next()) else { continue };
        let Ok(offset) = offset.parse::<usize>() else { continue };
        assert_eq!(offset, bytes.len(), "offset of the line {line:?}");
        bytes.extend(hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()));
    }
    bytes
}

/// Writes the CRC that fits the bytes before it.
pub fn seal(bytes: &mut [u8]) {
    let (body, crc) = bytes.split_last_chunk_mut::<4>().unwrap();
    *crc = CRC_32.checksum(body).to_le_bytes();
}

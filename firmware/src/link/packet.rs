//! A packet: a message with version and number before it, and a CRC-32 behind it.

use serde::{Deserialize, Serialize};
use taxel_core::checksum::CRC_32;

/// Version of the protocol that this crate speaks. A device answers any other version only with
/// [`Refusal::Version`](super::message::Refusal::Version).
pub const PROTOCOL_VERSION: u8 = 12;

/// Number of a packet that answers no request.
pub const UNASKED: u16 = 0;

/// A message as it is sent: `version`, `number` and `body` as postcard fields, then the CRC-32 of
/// these bytes, little-endian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Packet<T> {
    /// Number that the host chooses for each request, and that its answer repeats; otherwise [`UNASKED`].
    pub number: u16,
    /// The message.
    pub body: T,
}

/// Why bytes are no packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacketError {
    /// The CRC-32 does not match: the bytes were damaged.
    Damaged,
    /// The packet is whole, but of another version of the protocol.
    OtherVersion {
        /// The number of the packet.
        number: u16,
        /// The version of the protocol.
        version: u8,
    },
    /// The packet is whole, but has no message of this protocol.
    NotAMessage {
        /// The number of the packet.
        number: u16,
    },
}

/// Encodes the packet of `body` in `buffer` and returns its bytes; `None` if it does not fit.
pub fn encode<'b, T: Serialize>(number: u16, body: &T, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let covered = postcard::to_slice(&(PROTOCOL_VERSION, number, body), buffer).ok()?.len();
    let (bytes, rest) = buffer.split_at_mut_checked(covered)?;
    let crc = CRC_32.checksum(bytes).to_le_bytes();
    rest.first_chunk_mut::<4>().map(|place| *place = crc)?;
    buffer.get(..covered + crc.len())
}

/// Decodes a packet, whose body borrows from `bytes`. The CRC is checked before anything else.
///
/// # Errors
/// Every variant of [`PacketError`].
pub fn decode<'b, T: Deserialize<'b>>(bytes: &'b [u8]) -> Result<Packet<T>, PacketError> {
    let (covered, stored) = bytes.split_last_chunk::<4>().ok_or(PacketError::Damaged)?;
    if CRC_32.checksum(covered) != u32::from_le_bytes(*stored) {
        return Err(PacketError::Damaged);
    }
    let ((version, number), rest) =
        postcard::take_from_bytes::<(u8, u16)>(covered).map_err(|_| PacketError::Damaged)?;
    if version != PROTOCOL_VERSION {
        return Err(PacketError::OtherVersion { number, version });
    }
    match postcard::take_from_bytes(rest) {
        Ok((body, [])) => Ok(Packet { number, body }),
        _ => Err(PacketError::NotAMessage { number }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_and_every_missing_byte_is_damage() {
        let mut buffer = [0; 64];
        let bytes = encode(7, &(1_u32, 2.5_f32), &mut buffer).unwrap().to_vec();
        assert_eq!(decode::<(u32, f32)>(&bytes), Ok(Packet { number: 7, body: (1, 2.5) }));
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(decode::<(u32, f32)>(&damaged), Err(PacketError::Damaged), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert_eq!(decode::<(u32, f32)>(&bytes[..length]), Err(PacketError::Damaged));
        }
    }

    #[test]
    fn another_version_and_trailing_bytes_differ_from_damage() {
        let whole = |covered: &[u8]| [covered, &CRC_32.checksum(covered).to_le_bytes()].concat();
        for version in [PROTOCOL_VERSION - 1, PROTOCOL_VERSION + 1] {
            let other = Err(PacketError::OtherVersion { number: 9, version });
            assert_eq!(decode::<u8>(&whole(&[version, 9, 1])), other);
        }
        let left_over = whole(&[PROTOCOL_VERSION, 9, 1, 1]);
        assert_eq!(decode::<u8>(&left_over), Err(PacketError::NotAMessage { number: 9 }));
    }

    #[test]
    fn a_packet_that_does_not_fit_is_not_written() {
        let mut buffer = [0; 8];
        assert_eq!(encode(1, &[0_u8; 2], &mut buffer).map(<[u8]>::len), Some(8));
        assert_eq!(encode(1, &[0_u8; 3], &mut buffer), None);
    }
}

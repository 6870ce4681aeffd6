//! The model in force, checked again and again in the background: flash and RAM lose bits.

use taxel_core::checksum::{CRC_32, Crc32Digest};

/// Bytes that are checked in a turn of the loop: some 25 µs on a Cortex-M4 at 180 MHz whose flash waits.
pub const PIECE: usize = 256;

/// What a turn's check found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Checked {
    /// Nothing yet.
    Piece,
    /// Every copy has been checked once more, and is sound.
    All,
    /// The copy with this number is damaged.
    Damaged(usize),
}

/// How far the check of a blob's copies is.
pub struct Recheck {
    digest: Crc32Digest,
    /// Number of the copy that is being checked, and bytes of it that were.
    copy: usize,
    done: usize,
}

impl Recheck {
    /// Begins with the first copy.
    pub fn new() -> Self {
        Self { digest: CRC_32.digest(), copy: 0, done: 0 }
    }

    /// Checks the next piece of the `copies` of a blob that ends with the CRC-32 `crc_32`.
    pub fn step(&mut self, copies: &[&[u8]], crc_32: u32) -> Checked {
        let Some(copy) = copies.get(self.copy) else {
            *self = Self::new();
            return Checked::All;
        };
        let Some((covered, stored)) = copy.split_last_chunk::<4>() else {
            return self.next(false);
        };
        let rest = covered.get(self.done..).unwrap_or_default();
        let piece = rest.get(..PIECE).unwrap_or(rest);
        self.digest.update(piece);
        self.done += piece.len();
        if piece.len() < rest.len() {
            return Checked::Piece;
        }
        let found = self.digest.clone().finalize();
        self.next(found == crc_32 && *stored == crc_32.to_le_bytes())
    }

    /// Goes on with the next copy.
    fn next(&mut self, is_sound: bool) -> Checked {
        let copy = self.copy;
        *self = Self { copy: copy + 1, ..Self::new() };
        if is_sound { Checked::Piece } else { Checked::Damaged(copy) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blob(bytes: usize) -> (Vec<u8>, u32) {
        let mut blob: Vec<u8> = (0..bytes).map(|i| (i * i % 253) as u8).collect();
        let crc_32 = CRC_32.checksum(&blob);
        blob.extend(crc_32.to_le_bytes());
        (blob, crc_32)
    }

    #[test]
    fn a_pass_looks_at_every_byte_of_every_copy_in_bounded_pieces() {
        for bytes in [0, 1, PIECE - 1, PIECE, PIECE + 1, 5 * PIECE + 3] {
            let (blob, crc_32) = blob(bytes);
            let mut recheck = Recheck::new();
            let turns = 2 * bytes.div_ceil(PIECE).max(1) + 1;
            for _ in 0..3 {
                for _ in 1..turns {
                    assert_eq!(recheck.step(&[&blob, &blob], crc_32), Checked::Piece);
                }
                assert_eq!(recheck.step(&[&blob, &blob], crc_32), Checked::All, "{bytes}");
            }
        }
    }

    #[test]
    fn every_flipped_bit_of_every_copy_is_found_in_one_pass() {
        let (blob, crc_32) = blob(2 * PIECE + 7);
        for bit in 0..8 * blob.len() {
            let mut damaged = blob.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            for (number, copies) in [[&damaged, &blob], [&blob, &damaged]].iter().enumerate() {
                let copies = copies.map(Vec::as_slice);
                let mut recheck = Recheck::new();
                let found = (0..7).map(|_| recheck.step(&copies, crc_32));
                let found: Vec<_> = found.filter(|found| *found != Checked::Piece).collect();
                assert_eq!(found.first(), Some(&Checked::Damaged(number)), "bit {bit}");
            }
        }
    }
}

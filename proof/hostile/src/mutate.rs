//! Mutants of bytes, from a seed.

use crate::draws::Draws;

/// Numbers at the edges of what a word, a float or a length can be.
const WORDS: [u32; 20] = [
    0,
    1,
    0xFF,
    0x100,
    0x7FFF,
    0x8000,
    0xFFFF,
    0x0001_0000,
    0x7FFF_FFFF,
    0x8000_0000,
    0xFFFF_FFFF, // whole numbers
    0x0000_0001,
    0x0080_0000,
    0x3F80_0000,
    0xBF80_0000,
    0x7F7F_FFFF,
    0xFF7F_FFFF, // floats, up to the largest
    0x7F80_0000,
    0x7FC0_0000,
    0x5F00_0000, // infinity, NaN, 2^63
];

/// A mutant of `bytes` that depends on `seed` alone; parts of `other` may be spliced in. It has at most `most` bytes.
pub fn mutate(bytes: &[u8], other: &[u8], seed: u64, most: usize) -> Vec<u8> {
    let mut draws = Draws::new(seed);
    let mut mutant = bytes.to_vec();
    for _ in 0..=draws.below(4) {
        change(&mut mutant, other, &mut draws);
    }
    mutant.truncate(most);
    mutant
}

fn change(bytes: &mut Vec<u8>, other: &[u8], draws: &mut Draws) {
    let (length, at) = (bytes.len(), draws.below(bytes.len()));
    if length == 0 {
        return bytes.extend_from_slice(other);
    }
    let run = (1 + draws.below(16)).min(length - at);
    match draws.below(12) {
        0 => bytes[at] ^= 1 << draws.below(8),
        1 => bytes[at] = draws.bits() as u8,
        2 => bytes[at] = bytes[at].wrapping_add(draws.one_of(&[1, 255, 16, 240])),
        3 => drop(bytes.drain(at..at + run)),
        4 => bytes.insert(at, draws.bits() as u8),
        5 => {
            let copy = bytes[at..at + run].to_vec();
            let to = draws.below(length);
            bytes.splice(to..to, copy);
        }
        6 | 7 => {
            // A word at its place, as blobs have them.
            let word = draws.one_of(&WORDS).to_le_bytes();
            let at = at / 4 * 4;
            bytes[at..length.min(at + 4)].iter_mut().zip(word).for_each(|(b, w)| *b = w);
        }
        8 => {
            let (near, far) = (draws.below(length), at);
            bytes.swap(near, far);
        }
        9 => {
            // A digit, for texts.
            let digits = bytes.iter().enumerate().filter(|(_, byte)| byte.is_ascii_digit());
            let digits: Vec<usize> = digits.map(|(place, _)| place).collect();
            let place = digits.get(draws.below(digits.len())).copied().unwrap_or(at);
            bytes[place] = draws.one_of(b"0123456789.-e,");
        }
        10 => bytes.truncate(at),
        _ => {
            let from = draws.below(other.len());
            let part = &other[from..other.len().min(from + 1 + draws.below(64))];
            if draws.below(2) == 0 {
                bytes.splice(at..at, part.iter().copied());
            } else {
                bytes[at..].iter_mut().zip(part).for_each(|(byte, from)| *byte = *from);
            }
        }
    }
}

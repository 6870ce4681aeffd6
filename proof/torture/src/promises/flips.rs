//! Flipped bits of blobs: none is ever accepted.
//!
//! The CRC-32 of a blob has a Hamming distance of 3 up to 2^32 − 1 bits, and of 4 up to 91 607 bits (11 KiB). So it
//! finds one and two flipped bits in every blob, and three in small ones.

use mock_board::{blob, blob_of_features, blob_with_confidence};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_core::AlignedBytes;
use taxel_core::blob::Model;

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::{Tools, tested_model};

pub const ONE: Promise = Promise {
    name: "flip-one",
    text: "a blob with any one bit flipped is refused",
    share: 2,
    check: one,
};

pub const TWO: Promise = Promise {
    name: "flip-two",
    text: "a blob with any two bits flipped is refused",
    share: 4,
    check: two,
};

/// Flips of one case.
const FLIPS: u64 = 512;
/// Cases of two flips in the short form: all pairs of the smallest blob's bits among them.
const PAIRS: u64 = 1504;

/// Files with blobs of every number format, with and without projection, expansion and confidence.
const FILES: [&str; 5] = [
    "array-f32-components.bin",
    "array-fixed16-components.bin",
    "array-fixed16-confidence.bin",
    "array-fixed16-no-tail.bin",
    "hand-made.bin",
];

/// Blobs whose bits are flipped, the smallest first.
fn subjects() -> Result<Vec<AlignedBytes>, String> {
    let small = [blob(1, 1), blob(2, 5), blob_of_features(1), blob_with_confidence(true)];
    let mut all = small.to_vec();
    for file in FILES {
        all.push(tested_model(file)?);
    }
    all.sort_by_key(|blob| blob.len());
    match all.iter().find(|blob| Model::decode(blob).is_err()) {
        Some(blob) => Err(format!("a blob of {} bytes is no sound subject", blob.len())),
        None => Ok(all),
    }
}

/// Flips `bits`, looks whether the blob is refused, and flips them back.
fn refused(blob: &mut AlignedBytes, bits: &[usize]) -> Result<(), String> {
    let flip = |blob: &mut AlignedBytes| bits.iter().for_each(|b| blob[b / 8] ^= 1 << (b % 8));
    flip(blob);
    let is_refused = Model::decode(blob).is_err();
    flip(blob);
    if is_refused {
        return Ok(());
    }
    Err(format!("a blob of {} bytes is accepted with bits {bits:?} flipped", blob.len()))
}

fn one(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let subjects = subjects()?;
    let bits: Vec<u64> = subjects.iter().map(|blob| blob.len() as u64 * 8).collect();
    let all: u64 = bits.iter().sum();
    let cases = all.div_ceil(FLIPS);
    let mut found = effort.worst((cases / 8, cases), (0.0, "accepted"), |seed| {
        // An odd step visits every block of flips once.
        let block = seed.wrapping_mul(7919) % cases;
        let mut subject = usize::MAX;
        let mut copy = subjects[0].clone();
        for flip in block * FLIPS..all.min((block + 1) * FLIPS) {
            let (mut place, mut bit) = (0, flip);
            while bit >= bits[place] {
                bit -= bits[place];
                place += 1;
            }
            if place != subject {
                (subject, copy) = (place, subjects[place].clone());
            }
            refused(&mut copy, &[bit as usize])?;
        }
        Ok(0.0)
    });
    found.cases *= FLIPS;
    if found.note.is_empty() {
        found.note = format!("{} blobs with {all} bits in all", subjects.len());
    }
    Ok(found)
}

fn two(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let subjects = subjects()?;
    let smallest = &subjects[0];
    let bits = smallest.len() * 8;
    let found = effort.worst((PAIRS, 1 << 40), (0.0, "accepted"), |seed| {
        // All partners of one bit of the smallest blob.
        let mut copy = smallest.clone();
        let first = (seed % bits as u64) as usize;
        let is_first_round = seed.wrapping_sub(effort.seed()) < bits as u64;
        for second in (first + 1..bits).filter(|_| is_first_round) {
            refused(&mut copy, &[first, second])?;
        }
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut below = |end: usize| (random.next_u64() % end as u64) as usize;
        for _ in 0..RANDOM {
            let mut copy = subjects[below(subjects.len())].clone();
            let first = below(copy.len() * 8);
            let second = (first + 1 + below(copy.len() * 8 - 1)) % (copy.len() * 8);
            refused(&mut copy, &[first, second])?;
        }
        Ok(0.0)
    });
    let cases = found.cases;
    let pairs = cases.min(bits as u64) * (bits as u64 - 1) / 2;
    let note =
        format!("{pairs} pairs of the smallest blob's {bits} bits, else drawn from all blobs");
    let note = if found.note.is_empty() { note } else { found.note };
    Ok(Found { cases: pairs + cases * RANDOM as u64, note, ..found })
}

/// Pairs drawn from all blobs in one case.
const RANDOM: usize = 20;

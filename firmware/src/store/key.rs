//! The device's key, in flash of its own that is not erased once a key is set.
//!
//! A key is kept in two copies. The place of a copy holds, in the order in which they are written: a word of zeros, the
//! key, its CRC-32, and two marks. The words tell what a cut has left, however often a weak bit changes its mind:
//!
//! - The key is written only behind a whole word of zeros. So no place is taken twice.
//! - A copy counts from its first mark on. The second is begun only when the first is whole.
//! - Without the second, the first may be weak and read as erased at another start. So each start makes firm what it has
//!   read: it writes another copy, or overwrites the unfinished one with zeros, the mark first.

use model_core::checksum::CRC_32;

use super::{FlashError, Slot};
use crate::seal::{KEY_BYTES, Key};

/// Bytes of a place, and where its parts begin: the word of zeros, the key, its CRC-32, and the marks.
const PLACE: usize = 48;
const ZEROS: usize = 0;
const KEY: usize = 4;
const CRC: usize = KEY + KEY_BYTES;
const FIRST_MARK: usize = CRC + 4;
const SECOND_MARK: usize = FIRST_MARK + 4;

/// Mark of a copy that is whole.
const MARK: [u8; 4] = *b"KEY1";

/// Number of copies of a key.
const COPIES: usize = 2;

/// Number of bits of a key that may have decayed for its owner to set it again.
const DECAYED_BITS: u32 = 8;

/// Key of a device.
#[derive(Clone, Copy)]
pub enum DeviceKey {
    /// None was ever set: any sound model may come into force.
    None,
    /// Only models with a seal made by this key may.
    Set(Key),
    /// One was set and all its copies have decayed: no model may.
    Damaged,
}

/// What a place holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Copy {
    /// A key that does not count, since its first mark reads as erased or is overwritten.
    Unfinished,
    /// A key that counts, although its first mark may be weak.
    Doubtful,
    /// A key that counts for good.
    Firm,
    /// A key that counted, and has decayed.
    Decayed,
}

impl DeviceKey {
    /// Finds the key in its `area` of flash.
    pub fn find(area: &[u8]) -> Self {
        let first = |wanted| {
            let mut copies = places(area).iter().filter_map(read);
            copies.find(|(copy, _)| *copy == wanted).map(|(_, key)| key)
        };
        match first(Copy::Firm).or_else(|| first(Copy::Doubtful)) {
            Some(key) => Self::Set(*key),
            None if first(Copy::Decayed).is_some() => Self::Damaged,
            None => Self::None,
        }
    }

    /// Makes firm what [`DeviceKey::find`] has found in `area`, so that it holds at every further start: a key has two
    /// sound copies then. Returns whether anything had to be written.
    ///
    /// # Errors
    /// [`FlashError`] if the flash could not be written, or has no place for another copy.
    pub fn settle<S: Slot>(&self, area: &mut S) -> Result<bool, FlashError> {
        match self {
            Self::None => drop_unfinished(area),
            Self::Set(key) => complete(area, key),
            Self::Damaged => Ok(false),
        }
    }

    /// Sets `key` again in an `area` in which it has decayed. It must be the same but for `DECAYED_BITS` bits: whoever
    /// does not have it cannot come that near. Returns whether it is.
    ///
    /// # Errors
    /// As [`DeviceKey::set`].
    pub fn mend<S: Slot>(area: &mut S, key: &Key) -> Result<bool, FlashError> {
        let distance =
            |found: &Key| found.iter().zip(key).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
        let is_near = |(copy, found)| copy == Copy::Decayed && distance(found) <= DECAYED_BITS;
        let is_same = places(area.bytes()).iter().filter_map(read).any(is_near);
        if is_same { complete(area, key).map(|_| true) } else { Ok(false) }
    }

    /// Sets `key` in an `area` in which none is set.
    ///
    /// # Errors
    /// [`FlashError`] if the flash could not be written. [`DeviceKey::find`] tells whether the key is set.
    pub fn set<S: Slot>(area: &mut S, key: &Key) -> Result<(), FlashError> {
        // Even an area that looks erased: power may have gone amid the erase, and left bits that change by themselves.
        area.erase()?;
        complete(area, key).map(|_| ())
    }
}

fn places(area: &[u8]) -> &[[u8; PLACE]] {
    area.as_chunks().0
}

/// Whether nothing was written to a place, or its word of zeros alone: that is weak then, and can be written again.
fn is_free(place: &[u8; PLACE]) -> bool {
    place.iter().all(|byte| *byte == 0xFF)
}

/// What a place holds, and the key in it.
#[inline(never)] // it has several callers
fn read(place: &[u8; PLACE]) -> Option<(Copy, &Key)> {
    let (zeros, rest) = place.split_first_chunk::<4>()?;
    if *zeros == [0xFF; 4] {
        return None; // as most places, and looked at in no time
    }
    let (key, rest) = rest.split_first_chunk::<KEY_BYTES>()?;
    let [crc, first, second] = rest.as_chunks::<4>().0 else { return None };
    let is_sound = *crc == CRC_32.checksum(key).to_le_bytes();
    let copy = match (is_sound, is_begun(*first), is_begun(*second)) {
        (true, _, true) => Copy::Firm,
        (true, true, false) => Copy::Doubtful,
        (true, false, false) => Copy::Unfinished,
        (false, ..) if [*first, *second].contains(&MARK) => Copy::Decayed,
        (false, ..) => return None,
    };
    Some((copy, key))
}

/// Whether a word is neither erased nor, as a mark, overwritten.
fn is_begun(word: [u8; 4]) -> bool {
    word != [0xFF; 4] && word != [0; 4]
}

/// Writes copies of `key` until there are two firm ones; returns whether there were fewer.
fn complete<S: Slot>(area: &mut S, key: &Key) -> Result<bool, FlashError> {
    let is_right = |copy: &(Copy, &Key)| *copy == (Copy::Firm, key);
    let there = places(area.bytes()).iter().filter_map(read).filter(is_right).count();
    let crc = CRC_32.checksum(key).to_le_bytes();
    for _ in there..COPIES {
        let free = places(area.bytes()).iter().position(is_free).ok_or(FlashError)?;
        let parts: [(usize, &[u8]); 5] =
            [(ZEROS, &[0; 4]), (KEY, key), (CRC, &crc), (FIRST_MARK, &MARK), (SECOND_MARK, &MARK)];
        write(area, free, &parts)?;
    }
    Ok(there < COPIES)
}

/// Overwrites unfinished copies with zeros, so that none counts at another start; returns whether there were any.
///
/// The mark goes first, and each start does it again until the key is gone: the mark is zeros for good then. A copy that
/// seems unsound may have a weak CRC-32.
fn drop_unfinished<S: Slot>(area: &mut S) -> Result<bool, FlashError> {
    let mut any = false;
    for number in 0..places(area.bytes()).len() {
        let place = places(area.bytes()).get(number);
        if place.is_some_and(has_key) {
            write(area, number, &[(FIRST_MARK, &[0; 4]), (KEY, &[0; FIRST_MARK - KEY])])?;
            any = true;
        }
    }
    Ok(any)
}

/// Whether a place was begun, and has anything of a key or its CRC-32.
fn has_key(place: &[u8; PLACE]) -> bool {
    let key = place.get(KEY..FIRST_MARK).unwrap_or_default();
    place.starts_with(&[0; KEY]) && key.iter().any(|byte| *byte != 0)
}

/// Writes some parts of a place, each from its offset on, one after the other.
#[inline(never)] // it has two callers
fn write<S: Slot>(area: &mut S, number: usize, parts: &[(usize, &[u8])]) -> Result<(), FlashError> {
    parts.iter().try_for_each(|(offset, bytes)| area.write(number * PLACE + offset, bytes))
}

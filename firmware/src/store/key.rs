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
        let free = places(area.bytes()).iter().filter(|place| is_free(place)).count();
        if free < COPIES {
            area.erase()?; // it holds something else
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Flash whose power fails in a word, which is weak from then on.
    #[derive(Clone)]
    struct Area {
        words: Vec<u32>,
        weak: Vec<u32>,
        words_left: usize,
    }

    /// How weak bits read at a start: as 1, as 0, or some so and some so.
    const READINGS: [u32; 3] = [u32::MAX, 0, 0x6A6A_6A6A];

    impl Area {
        fn with(words: Vec<u32>) -> Self {
            Self { weak: vec![0; words.len()], words, words_left: usize::MAX }
        }

        fn erased() -> Self {
            Self::with(vec![u32::MAX; 120])
        }

        /// What a start finds that reads weak bits as `reading` and makes it firm, with power for so many words.
        fn start(&mut self, reading: u32, words: usize) -> DeviceKey {
            for (word, weak) in self.words.iter_mut().zip(&self.weak) {
                *word = (*word & !weak) | (reading & weak);
            }
            self.words_left = words;
            let found = DeviceKey::find(self.bytes());
            let settled = found.settle(self);
            assert!(settled.is_ok() || words < usize::MAX);
            found
        }

        fn provide(&mut self, key: &Key, words: usize) {
            self.words_left = words;
            assert!(DeviceKey::set(self, key).is_ok() || words < usize::MAX);
        }

        fn flip(&mut self, bit: usize) {
            self.words[bit / 32] ^= 1 << (bit % 32);
        }
    }

    impl Slot for Area {
        fn bytes(&self) -> &[u8] {
            bytemuck::cast_slice(&self.words)
        }

        fn erase(&mut self) -> Result<(), FlashError> {
            *self = Self { words_left: self.words_left, ..Self::erased() };
            Ok(())
        }

        fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
            for (place, bytes) in (offset / 4..).zip(bytes.as_chunks::<4>().0) {
                let new = u32::from_le_bytes(*bytes);
                let (word, weak) = (&mut self.words[place], &mut self.weak[place]);
                assert!(*word == u32::MAX || new == 0, "not erased");
                if self.words_left == 0 {
                    *weak |= *word & !new;
                    return Err(FlashError);
                }
                self.words_left -= 1;
                *word &= new;
                *weak &= new;
            }
            Ok(())
        }
    }

    const OURS: Key = [0xA5; KEY_BYTES];
    const OTHER: Key = [0x3C; KEY_BYTES];
    /// Words of both copies.
    const WORDS: usize = COPIES * PLACE / 4;

    fn is_set(found: &DeviceKey, key: &Key) -> bool {
        matches!(found, DeviceKey::Set(found) if found == key)
    }

    fn is_none(found: &DeviceKey) -> bool {
        matches!(found, DeviceKey::None)
    }

    #[test]
    fn whatever_the_area_held_before_a_key_can_be_set() {
        let old_code = (0..120_u32).map(|i| i.wrapping_mul(0x9E37_79B9)).collect();
        for words in [vec![u32::MAX; 120], vec![0; 120], old_code] {
            let mut area = Area::with(words);
            assert!(is_none(&DeviceKey::find(area.bytes())));
            area.provide(&OURS, usize::MAX);
            assert!(is_set(&DeviceKey::find(area.bytes()), &OURS));
        }
    }

    #[test]
    fn old_code_is_never_taken_for_a_decayed_key() {
        let mut word = 1_u32;
        let mut any = || {
            word ^= word << 13;
            word ^= word >> 17;
            word ^= word << 5;
            word
        };
        for sector in 0..2000 {
            let mut area = Area::with((0..4096).map(|_| any()).collect());
            assert!(is_none(&area.start(0, 0)), "{sector}");
        }
        // Not even where all its words are marks but for a bit.
        let near = u32::from_le_bytes(MARK) ^ 1 << 9;
        assert!(is_none(&DeviceKey::find(Area::with(vec![near; 120]).bytes())));
    }

    /// At every word, with every reading of weak bits at every start, and a second cut at every word of the first start.
    #[test]
    fn a_cut_leaves_no_key_or_the_new_one_and_the_same_at_every_further_start() {
        let mut firm = [0, 0];
        for (first, one, second, two) in (0..WORDS).flat_map(|first| {
            let rest = move |one| (0..=WORDS).map(move |second| (first, one, second));
            let all = READINGS.into_iter().flat_map(rest);
            all.flat_map(|(f, o, s)| READINGS.into_iter().map(move |two| (f, o, s, two)))
        }) {
            let case = (first, one, second, two);
            let mut area = Area::erased();
            area.provide(&OURS, first);
            area.start(one, second);
            let found = area.start(two, usize::MAX);
            assert!(is_none(&found) || is_set(&found, &OURS), "{case:x?}");
            for third in READINGS {
                let again = area.start(third, usize::MAX);
                assert!(is_none(&again) == is_none(&found), "{case:x?}, {third:x}");
                if let DeviceKey::Set(key) = again {
                    assert!(key == OURS, "{case:x?}, {third:x}");
                }
            }
            firm[usize::from(is_none(&found))] += 1;
            // Another key is taken where there is none, and for good.
            let last = if is_none(&found) { OTHER } else { OURS };
            if is_none(&found) {
                area.provide(&OTHER, usize::MAX);
            }
            for third in READINGS {
                assert!(is_set(&area.start(third, usize::MAX), &last), "{case:x?}, {third:x}");
            }
        }
        assert!(firm.iter().all(|cases| *cases > 100), "{firm:?}");
    }

    #[test]
    fn no_word_of_a_place_is_taken_for_erased_by_another_key() {
        for (first, one, two) in (0..WORDS).flat_map(|first| {
            READINGS
                .into_iter()
                .flat_map(move |one| READINGS.into_iter().map(move |two| (first, one, two)))
        }) {
            let mut area = Area::erased();
            area.provide(&OURS, first);
            if is_none(&area.start(one, usize::MAX)) {
                area.provide(&OTHER, usize::MAX);
                assert!(is_set(&area.start(two, 0), &OTHER), "{first} {one:x} {two:x}");
                let firm = places(area.bytes()).iter().filter_map(read);
                let firm = firm.filter(|copy| *copy == (Copy::Firm, &OTHER)).count();
                assert_eq!(firm, COPIES, "{first} {one:x} {two:x}");
            }
        }
    }

    #[test]
    fn no_flipped_bit_turns_the_key_off_or_takes_it_away_and_a_start_makes_it_good() {
        let mut area = Area::erased();
        area.provide(&OURS, usize::MAX);
        for bit in 0..32 * area.words.len() {
            let mut area = area.clone();
            area.flip(bit);
            assert!(is_set(&area.start(0, usize::MAX), &OURS), "{bit}");
            let second = 8 * PLACE + bit % (8 * PLACE);
            area.flip(second);
            assert!(is_set(&area.start(0, usize::MAX), &OURS), "{bit}, then {second}");
        }
    }

    #[test]
    fn with_both_copies_decayed_the_owner_alone_can_set_the_key_again() {
        let mut area = Area::erased();
        area.provide(&OURS, usize::MAX);
        for (place, bits) in [(0, 8), (PLACE, 9)] {
            (0..bits).for_each(|bit| area.flip(8 * (place + KEY) + 31 * bit));
        }
        assert!(matches!(area.start(0, usize::MAX), DeviceKey::Damaged));
        let mut wrong = OURS;
        wrong[20] ^= 1; // a ninth bit beside the eight
        assert_eq!(DeviceKey::mend(&mut area, &OTHER), Ok(false));
        assert_eq!(DeviceKey::mend(&mut area, &wrong), Ok(false));
        assert!(matches!(area.start(0, usize::MAX), DeviceKey::Damaged));
        assert_eq!(DeviceKey::mend(&mut area, &OURS), Ok(true));
        assert!(is_set(&area.start(0, usize::MAX), &OURS));
    }
}

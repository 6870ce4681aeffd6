//! The device's key, in flash of its own that is not erased once a key is set.
//!
//! A place holds a key, its CRC-32 and a mark, which is written last. The first place whose mark is set counts, so that
//! power that fails meanwhile leaves a device without a key, which can be given one.

use model_core::checksum::CRC_32;

use super::{FlashError, Slot};
use crate::seal::{KEY_BYTES, Key};

/// Bytes of a place, and those of them before the mark.
const PLACE: usize = 40;
const COVERED: usize = KEY_BYTES + 4;

/// Mark of a key that is set.
const MARK: [u8; 4] = *b"KEY1";

/// Number of bits of a mark that may have decayed. Erased flash and zeros differ in 14 or more.
const DECAYED_BITS: u32 = 4;

/// Key of a device.
#[derive(Clone, Copy)]
pub enum DeviceKey {
    /// None was ever set: any sound model may come into force.
    None,
    /// Only models with a seal made by this key may.
    Set(Key),
    /// One was set and has decayed: no model may.
    Damaged,
}

impl DeviceKey {
    /// Finds the key in its `area` of flash.
    #[must_use]
    pub fn find(area: &[u8]) -> Self {
        let is_set = |place: &&[u8]| {
            let mark = place.iter().skip(COVERED).zip(&MARK);
            mark.map(|(found, mark)| (found ^ mark).count_ones()).sum::<u32>() <= DECAYED_BITS
        };
        let Some(place) = area.chunks_exact(PLACE).find(is_set) else { return Self::None };
        let Some((key, rest)) = place.split_first_chunk::<KEY_BYTES>() else { return Self::None };
        let crc = CRC_32.checksum(key).to_le_bytes();
        if rest.starts_with(&crc) { Self::Set(*key) } else { Self::Damaged }
    }

    /// Sets `key` in an `area` in which none is set.
    ///
    /// # Errors
    /// [`FlashError`] if the flash could not be written; no key is set then, or this one.
    pub fn set<S: Slot>(area: &mut S, key: &Key) -> Result<(), FlashError> {
        let is_erased = |place: &[u8]| place.iter().all(|byte| *byte == 0xFF);
        let free = area.bytes().chunks_exact(PLACE).position(is_erased);
        if free.is_none() {
            area.erase()?; // it holds something else
        }
        let start = PLACE * free.unwrap_or(0);
        area.write(start, key)?;
        area.write(start + KEY_BYTES, &CRC_32.checksum(key).to_le_bytes())?;
        area.write(start + COVERED, &MARK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flash whose power fails after so many words.
    struct Area {
        bytes: Vec<u8>,
        words_left: usize,
    }

    impl Slot for Area {
        fn bytes(&self) -> &[u8] {
            &self.bytes
        }

        fn erase(&mut self) -> Result<(), FlashError> {
            self.bytes.fill(0xFF);
            Ok(())
        }

        fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
            for (place, word) in (offset..).step_by(4).zip(bytes.chunks(4)) {
                let there = &mut self.bytes[place..place + 4];
                assert!(there.iter().all(|byte| *byte == 0xFF), "not erased");
                if self.words_left == 0 {
                    there.iter_mut().zip(word).for_each(|(there, byte)| *there = byte | 0x0F);
                    return Err(FlashError);
                }
                self.words_left -= 1;
                there.copy_from_slice(word);
            }
            Ok(())
        }
    }

    const KEY: Key = [0xA5; KEY_BYTES];

    fn is_key(area: &Area) -> bool {
        matches!(DeviceKey::find(&area.bytes), DeviceKey::Set(key) if key == KEY)
    }

    #[test]
    fn whatever_the_area_held_before_a_key_can_be_set() {
        let old_code: Vec<u8> = (0..=255).cycle().take(400).collect();
        for bytes in [vec![0xFF; 400], vec![0; 400], old_code] {
            let mut area = Area { bytes, words_left: 100 };
            assert!(matches!(DeviceKey::find(&area.bytes), DeviceKey::None));
            DeviceKey::set(&mut area, &KEY).unwrap();
            assert!(is_key(&area));
        }
    }

    #[test]
    fn power_that_fails_at_any_word_leaves_no_key_and_it_can_be_set_again() {
        for words_left in 0..PLACE / 4 {
            let mut area = Area { bytes: vec![0xFF; 400], words_left };
            assert_eq!(DeviceKey::set(&mut area, &KEY), Err(FlashError));
            assert!(matches!(DeviceKey::find(&area.bytes), DeviceKey::None), "{words_left}");
            area.words_left = 100;
            DeviceKey::set(&mut area, &KEY).unwrap();
            assert!(is_key(&area), "{words_left}");
        }
    }

    #[test]
    fn no_flipped_bit_turns_the_key_off() {
        let mut area = Area { bytes: vec![0xFF; 400], words_left: 100 };
        DeviceKey::set(&mut area, &KEY).unwrap();
        for bit in 0..8 * PLACE {
            area.bytes[bit / 8] ^= 1 << (bit % 8);
            let is_damaged = matches!(DeviceKey::find(&area.bytes), DeviceKey::Damaged);
            assert!(is_damaged == (bit < 8 * COVERED) && (is_damaged || is_key(&area)), "{bit}");
            area.bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

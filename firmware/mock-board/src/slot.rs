//! Model slots in flash.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::store::{FlashError, Slot};

use crate::power::{Power, operate};

/// A slot of NOR flash. It writes whole words, only where it is erased, and can lose its power in the middle of
/// any operation.
pub struct MockSlot {
    words: Vec<u32>,
    /// Power of both slots.
    power: Rc<RefCell<Power>>,
    pub erases: usize,
    /// Number of writes that were begun, of any number of words.
    pub writes: usize,
}

impl MockSlot {
    /// Length of a slot in bytes.
    pub const BYTES: usize = 2048;

    /// A pair of erased slots, with one power supply.
    pub fn pair() -> [Self; 2] {
        let power = Rc::new(RefCell::new(Power::default()));
        [0, 1].map(|_| Self {
            words: vec![u32::MAX; Self::BYTES / 4],
            power: power.clone(),
            erases: 0,
            writes: 0,
        })
    }

    /// A pair of slots with `blob` in the first, as if flashed together with the firmware.
    ///
    /// # Panics
    /// The blob is longer than a slot.
    pub fn pair_with(blob: &[u8]) -> [Self; 2] {
        let mut slots = Self::pair();
        bytemuck::cast_slice_mut(&mut slots[0].words)[..blob.len()].copy_from_slice(blob);
        slots
    }

    /// Cuts the power of both slots after so many `operations` on words.
    pub fn cut_power_after(&self, operations: usize) {
        *self.power.borrow_mut() = Power::cut_after(operations);
    }

    /// Switches the power on; returns whether it had been cut.
    pub fn power_on(&self) -> bool {
        self.power.borrow_mut().on()
    }

    /// Flips `bits` of word `place`, as an old cell does.
    ///
    /// # Panics
    /// `place` is outside the slot.
    pub fn decay(&mut self, place: usize, bits: u32) {
        self.words[place] ^= bits;
    }
}

impl Slot for MockSlot {
    const ERASE_INTERVAL_S: u32 = 0;

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erases += 1;
        for word in &mut self.words {
            if operate(&self.power).is_err() {
                // A word that is half erased has meaningless bits.
                *word ^= 0x5555_5555;
                return Err(FlashError);
            }
            *word = u32::MAX;
        }
        Ok(())
    }

    /// # Panics
    /// A word is not whole, not erased, or outside the slot.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.writes += 1;
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        for (place, word) in bytes.as_chunks::<4>().0.iter().enumerate() {
            let place = offset / 4 + place;
            assert_eq!(self.words[place], u32::MAX, "word {place} is not erased");
            let word = u32::from_le_bytes(*word);
            if operate(&self.power).is_err() {
                self.words[place] = word | 0x0F0F_0F0F; // half written
                return Err(FlashError);
            }
            self.words[place] = word;
        }
        Ok(())
    }
}

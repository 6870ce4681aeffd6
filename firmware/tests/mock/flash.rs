//! The one mock flash: NOR cells of which programming can only clear bits, and an erase sets all. Power may be lost in any
//! erase and any word, and bits stay weak.

use std::cell::RefCell;
use std::rc::Rc;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::store::{FlashError, Journal, PAGE_BYTES, Slot};

/// Power of a device.
pub struct Supply {
    /// Number of operations until it is cut; `None` if it is not.
    left: Option<u64>,
    pub gone: bool,
    /// Number of operations and of erases since [`Supply::on`].
    pub operations: u64,
    pub erases: u64,
    random: Xoshiro256PlusPlus,
}

/// How far an operation comes.
enum Course {
    Whole,
    Torn,
    Nowhere,
}

impl Supply {
    /// Power whose cuts draw from `seed`.
    pub fn new(seed: u64) -> Rc<RefCell<Self>> {
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        Rc::new(RefCell::new(Self { left: None, gone: false, operations: 0, erases: 0, random }))
    }

    /// Switches the power on; it will be cut in the operation after so many, if given.
    pub fn on(&mut self, cut_after: Option<u64>) {
        (self.left, self.gone) = (cut_after, false);
        (self.operations, self.erases) = (0, 0);
    }

    fn operate(&mut self) -> Course {
        if self.gone {
            return Course::Nowhere;
        }
        self.operations += 1;
        match &mut self.left {
            Some(0) => {
                self.gone = true;
                // Just before the operation, or in the middle.
                if self.random.next_u32().is_multiple_of(8) {
                    Course::Nowhere
                } else {
                    Course::Torn
                }
            }
            Some(left) => {
                *left -= 1;
                Course::Whole
            }
            None => Course::Whole,
        }
    }

    /// Bits of which one in 2 to the power of `halvings` is set.
    fn sparse(&mut self, halvings: u32) -> u32 {
        (0..halvings).fold(u32::MAX, |bits, _| bits & self.random.next_u32())
    }

    fn below(&mut self, end: u32) -> u32 {
        self.random.next_u32() % end
    }
}

/// Flash that is erased as a whole: a model slot, or a page of the journal. A clone is another chip with the same
/// content, on the same power.
#[derive(Clone)]
pub struct Flash {
    words: Vec<u32>,
    /// Bits that read as 0 or 1, anew after each start.
    weak: Vec<u32>,
    has_weak: bool,
    supply: Rc<RefCell<Supply>>,
    /// Mean time in s between erases that it endures; 0 for ever.
    pub erase_interval_s: u32,
    /// Number of erases that were begun.
    pub erases: usize,
    /// Number of words whose programming was begun.
    pub words_written: usize,
}

impl Flash {
    /// Length in bytes of a model slot.
    pub const SLOT_BYTES: usize = 2048;

    /// Erased flash of so many `bytes`.
    pub fn erased(bytes: usize, supply: &Rc<RefCell<Supply>>) -> Self {
        Self {
            words: vec![u32::MAX; bytes / 4],
            weak: vec![0; bytes / 4],
            has_weak: false,
            supply: supply.clone(),
            erase_interval_s: 0,
            erases: 0,
            words_written: 0,
        }
    }

    /// A pair of erased flashes of so many `bytes`, with one power supply.
    fn pair(bytes: usize) -> [Self; 2] {
        let supply = Supply::new(bytes as u64);
        [0, 1].map(|_| Self::erased(bytes, &supply))
    }

    /// A pair of erased model slots.
    pub fn slots() -> [Self; 2] {
        Self::pair(Self::SLOT_BYTES)
    }

    /// A pair of model slots with `blob` in the first, as if flashed together with the firmware.
    pub fn slots_with(blob: &[u8]) -> [Self; 2] {
        let mut slots = Self::slots();
        slots[0].flash(0, blob);
        slots
    }

    /// An empty journal.
    pub fn journal() -> Journal<Self> {
        Journal::new(Self::pair(PAGE_BYTES))
    }

    /// A journal whose pages hold these bytes.
    pub fn journal_of(pages: [&[u8]; 2]) -> Journal<Self> {
        let mut journal = Self::journal();
        journal.pages().iter_mut().zip(pages).for_each(|(page, bytes)| page.flash(0, bytes));
        journal
    }

    /// Its power.
    pub fn supply(&self) -> Rc<RefCell<Supply>> {
        self.supply.clone()
    }

    /// Puts `bytes` at `offset`, as a programmer does: without regard to what was there.
    pub fn flash(&mut self, offset: usize, bytes: &[u8]) {
        let all: &mut [u8] = bytemuck::cast_slice_mut(&mut self.words);
        all[offset..offset + bytes.len()].copy_from_slice(bytes);
    }

    /// Flips `bits` of word `place`, as an old cell does.
    pub fn decay(&mut self, place: usize, bits: u32) {
        self.words[place] ^= bits;
    }

    /// Lets weak bits settle, as they do at a start: each by itself, or those of a word alike, the old one or the new.
    pub fn settle(&mut self) {
        if self.has_weak {
            let mut supply = self.supply.borrow_mut();
            let are_alike = supply.below(2) == 0;
            for (word, weak) in self.words.iter_mut().zip(&self.weak) {
                let any = supply.random.next_u32();
                let bits = match any % 4 {
                    0 if are_alike => 0,
                    1 if are_alike => u32::MAX,
                    _ => any,
                };
                *word = (*word & !weak) | (bits & weak);
            }
        }
    }

    /// Leaves of an erase what a cut leaves: some bits are set, few or nearly all, and of the others some are weak.
    fn tear(&mut self, supply: &mut Supply) {
        let halvings = [1, 5, 9, 14][supply.below(4) as usize];
        let (is_early, has_weak) = (supply.below(2) == 0, supply.below(2) == 0);
        self.has_weak |= has_weak;
        for (word, weak) in self.words.iter_mut().zip(&mut self.weak) {
            let some = supply.sparse(halvings);
            if has_weak {
                *weak = (*weak | !*word) & some;
                *word |= if is_early { 0 } else { u32::MAX };
            } else {
                *word |= if is_early { some } else { !some };
            }
        }
    }
}

impl Slot for Flash {
    fn erase_interval_s(&self) -> u32 {
        self.erase_interval_s
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erases += 1;
        let supply = self.supply.clone();
        let mut supply = supply.borrow_mut();
        supply.erases += 1;
        match supply.operate() {
            Course::Nowhere => return Err(FlashError),
            Course::Torn => {
                self.tear(&mut supply);
                return Err(FlashError);
            }
            Course::Whole => {}
        }
        self.words.fill(u32::MAX);
        self.weak.fill(0);
        self.has_weak = false;
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        for (place, bytes) in (offset / 4..).zip(bytes.as_chunks::<4>().0) {
            self.words_written += 1;
            let wanted = u32::from_le_bytes(*bytes);
            let mut supply = self.supply.borrow_mut();
            let (word, weak) = (&mut self.words[place], &mut self.weak[place]);
            assert!(*word == u32::MAX || wanted == 0, "word {place} is not erased");
            match supply.operate() {
                Course::Nowhere => return Err(FlashError),
                Course::Torn if supply.below(2) == 0 => {
                    // All bits that change, half of them, or one: the others are as they should be.
                    let change = *word & !wanted;
                    let one = 1 << supply.below(32);
                    let some = [u32::MAX, supply.random.next_u32(), one];
                    *weak |= change & some[supply.below(3) as usize];
                    *word = wanted;
                    self.has_weak = true;
                    return Err(FlashError);
                }
                Course::Torn => {
                    *word &= wanted | supply.random.next_u32(); // some of the zeros
                    return Err(FlashError);
                }
                Course::Whole => {}
            }
            *word &= wanted;
            *weak &= wanted;
            if *word != wanted {
                return Err(FlashError);
            }
        }
        Ok(())
    }
}

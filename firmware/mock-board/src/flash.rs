//! The one mock flash: NOR cells of which programming can only clear bits, and an erase sets all. It is as real parts
//! are at their worst. Power may be lost in any erase and any word, bits stay weak, words wear out, and time passes.

use std::cell::RefCell;
use std::rc::Rc;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::store::{FlashError, Journal, PAGE_BYTES, Slot};

/// What an erase leaves of a slot when the power is cut meanwhile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Torn {
    /// Any bits are set, over the whole slot.
    AnyBits,
    /// All words are programmed to zeros first.
    ZerosFirst,
    /// A bit in a hundred is set.
    FewBits,
    /// All bits are set but one in a hundred.
    NearlyAll,
    /// Bits that read as 0 or 1 anew after each start. So do bits of torn words.
    Weak,
    /// Any of these at each cut. Weak bits may be few, in a slot that else reads as erased or as before; at a start they
    /// may all read alike.
    Mixed,
}

impl Torn {
    /// Number of kinds.
    pub const COUNT: usize = 6;

    /// Every kind.
    pub const ALL: [Self; Self::COUNT] =
        [Self::AnyBits, Self::ZerosFirst, Self::FewBits, Self::NearlyAll, Self::Weak, Self::Mixed];

    /// The kind of case number `seed`: they take turns.
    pub fn new(seed: u64) -> Self {
        Self::ALL[(seed % Self::COUNT as u64) as usize]
    }

    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::AnyBits => "any bits",
            Self::ZerosFirst => "zeros first",
            Self::FewBits => "few bits",
            Self::NearlyAll => "nearly all",
            Self::Weak => "weak bits",
            Self::Mixed => "mixed",
        }
    }
}

/// Power of a device.
pub struct Supply {
    /// Number of operations until it is cut; `None` if it is not.
    left: Option<u64>,
    pub gone: bool,
    /// Number of operations since [`Supply::on`].
    pub operations: u64,
    /// Number of erases since [`Supply::on`].
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
                // Just before the operation, just after it, or in the middle.
                match self.random.next_u32() % 8 {
                    0 => Course::Nowhere,
                    _ => Course::Torn,
                }
            }
            Some(left) => {
                *left -= 1;
                Course::Whole
            }
            None => Course::Whole,
        }
    }

    /// Bits of which one in a hundred is set.
    fn few(&mut self) -> u32 {
        self.sparse(7)
    }

    /// Bits of which one in 2 to the power of `halvings` is set.
    fn sparse(&mut self, halvings: u32) -> u32 {
        (0..halvings).fold(u32::MAX, |bits, _| bits & self.random.next_u32())
    }

    fn below(&mut self, end: u32) -> u32 {
        self.random.next_u32() % end
    }
}

/// A word that has worn out.
#[derive(Debug, Clone, Copy)]
pub struct Worn {
    pub place: usize,
    /// Bits that no erase sets.
    pub zeros: u32,
    /// Bits that no programming clears.
    pub ones: u32,
}

/// Lets so many µs pass.
pub type Wait = Rc<dyn Fn(u32)>;

/// What the cells of a flash hold.
#[derive(Clone)]
pub struct Cells {
    words: Vec<u32>,
    /// Bits that read as 0 or 1, anew after each start.
    weak: Vec<u32>,
    has_weak: bool,
}

/// Flash that is erased as a whole: a model slot, or a page of the journal. A clone is another chip with the same
/// content, on the same power.
#[derive(Clone)]
pub struct Flash {
    cells: Cells,
    supply: Rc<RefCell<Supply>>,
    torn: Torn,
    /// Words that have worn out.
    pub worn: Vec<Worn>,
    /// Whether all weak bits of a word read alike at every other start: the word is the old or the new one.
    pub swings: bool,
    /// Whether erases fail at their end.
    pub fails_to_erase: bool,
    /// Times in µs that an erase and a word take, and who lets them pass.
    pub slow: Option<(u32, u32, Wait)>,
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

    /// Erased flash of so many `words`.
    pub fn erased(words: usize, supply: &Rc<RefCell<Supply>>, torn: Torn) -> Self {
        let cells = Cells { words: vec![u32::MAX; words], weak: vec![0; words], has_weak: false };
        Self {
            cells,
            supply: supply.clone(),
            torn,
            worn: Vec::new(),
            swings: false,
            fails_to_erase: false,
            slow: None,
            erase_interval_s: 0,
            erases: 0,
            words_written: 0,
        }
    }

    /// A pair of erased flashes of so many `bytes`, with one power supply.
    pub fn pair(bytes: usize) -> [Self; 2] {
        let supply = Supply::new(bytes as u64);
        [0, 1].map(|_| Self::erased(bytes / 4, &supply, Torn::AnyBits))
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

    /// Cuts the power after so many `operations`: erases, and words that are programmed.
    pub fn cut_power_after(&self, operations: u64) {
        self.supply.borrow_mut().on(Some(operations));
    }

    /// Switches the power on; returns whether it had been cut.
    pub fn power_on(&self) -> bool {
        let mut supply = self.supply.borrow_mut();
        let gone = supply.gone;
        supply.on(None);
        gone
    }

    /// What it holds, to be put back by [`Flash::restore`].
    pub fn cells(&self) -> Cells {
        self.cells.clone()
    }

    /// Puts back what it held.
    pub fn restore(&mut self, cells: &Cells) {
        self.cells.clone_from(cells);
    }

    /// Puts `bytes` at `offset`, as a programmer does: without regard to what was there.
    pub fn flash(&mut self, offset: usize, bytes: &[u8]) {
        let all: &mut [u8] = bytemuck::cast_slice_mut(&mut self.cells.words);
        all[offset..offset + bytes.len()].copy_from_slice(bytes);
    }

    /// Flips `bits` of word `place`, as an old cell does.
    pub fn decay(&mut self, place: usize, bits: u32) {
        self.cells.words[place] ^= bits;
    }

    fn wait(&self, erases: u32, words: u32) {
        if let Some((erase_us, word_us, wait)) = &self.slow {
            wait(erases * erase_us + words * word_us);
        }
    }

    /// Lets weak bits settle one way or the other, as they do at a start.
    pub fn settle(&mut self) {
        if self.cells.has_weak {
            let mut supply = self.supply.borrow_mut();
            let at_once = if self.torn == Torn::Mixed { supply.below(4) } else { 0 };
            for (word, weak) in self.cells.words.iter_mut().zip(&self.cells.weak) {
                let any = supply.random.next_u32();
                let bits = match (at_once, any % 4) {
                    (1, _) => 0,
                    (2, _) => u32::MAX,
                    (3, _) => *word,
                    (_, 0) if self.swings => 0,
                    (_, 1) if self.swings => u32::MAX,
                    _ => any,
                };
                *word = (*word & !weak) | (bits & weak);
            }
        }
    }

    fn tear(&mut self, supply: &mut Supply) {
        let Cells { words, weak, has_weak } = &mut self.cells;
        let is_early = supply.random.next_u32().is_multiple_of(2);
        let sparse = [1, 5, 9, 14][supply.below(4) as usize];
        let torn = match self.torn {
            Torn::Mixed => Torn::new(supply.random.next_u64()),
            torn => torn,
        };
        for (word, weak) in words.iter_mut().zip(weak) {
            let any = supply.random.next_u32();
            match torn {
                Torn::AnyBits => *word |= any,
                Torn::ZerosFirst if is_early => *word &= any,
                Torn::ZerosFirst => *word = any,
                Torn::FewBits => *word |= supply.few(),
                Torn::NearlyAll => *word |= !supply.few(),
                Torn::Weak => {
                    *weak = (*weak | !*word) & any;
                    *has_weak = true;
                }
                Torn::Mixed => {
                    *weak = (*weak | !*word) & supply.sparse(sparse);
                    *word |= if is_early { 0 } else { u32::MAX };
                    *has_weak = true;
                }
            }
        }
    }
}

impl Slot for Flash {
    fn erase_interval_s(&self) -> u32 {
        self.erase_interval_s
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.cells.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erases += 1;
        self.wait(1, 0);
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
        self.cells.words.fill(u32::MAX);
        self.cells.weak.fill(0);
        self.cells.has_weak = false;
        for worn in &self.worn {
            self.cells.words[worn.place] &= !worn.zeros;
        }
        if self.fails_to_erase { Err(FlashError) } else { Ok(()) }
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        self.wait(0, bytes.len() as u32 / 4);
        for (place, bytes) in (offset / 4..).zip(bytes.as_chunks::<4>().0) {
            self.words_written += 1;
            let wanted = u32::from_le_bytes(*bytes);
            let mut supply = self.supply.borrow_mut();
            let Cells { words, weak, has_weak } = &mut self.cells;
            let (word, weak) = (&mut words[place], &mut weak[place]);
            let mut worn = self.worn.iter().filter(|worn| worn.place == place).peekable();
            let may_write = *word == u32::MAX || wanted == 0 || worn.peek().is_some();
            assert!(may_write, "word {place} is not erased");
            match supply.operate() {
                Course::Nowhere => return Err(FlashError),
                Course::Torn
                    if self.torn == Torn::Weak
                        || self.torn == Torn::Mixed && supply.below(2) == 0 =>
                {
                    // All bits that change, half of them, or one: the others are as they should be.
                    let change = *word & !wanted;
                    let one = 1 << (supply.random.next_u32() % 32);
                    let some = [u32::MAX, supply.random.next_u32(), one];
                    *weak |= change & some[(supply.random.next_u32() % 3) as usize];
                    *word = wanted;
                    *has_weak = true;
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
            for worn in worn {
                *word |= worn.ones;
            }
            if *word != wanted {
                return Err(FlashError);
            }
        }
        Ok(())
    }
}

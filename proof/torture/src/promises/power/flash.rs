//! Flash that real parts resemble at their worst: erases and words that are torn, bits that stay weak, words that are
//! worn.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::store::{FlashError, Slot};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

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
    pub fn of(seed: u64) -> Self {
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

/// What the cells of a slot hold.
#[derive(Clone)]
pub struct Cells {
    words: Vec<u32>,
    /// Bits that read as 0 or 1, anew after each start.
    weak: Vec<u32>,
    has_weak: bool,
}

/// A slot of flash.
#[derive(Clone)]
pub struct Flash {
    cells: Cells,
    supply: Rc<RefCell<Supply>>,
    torn: Torn,
    /// Words that have worn out.
    pub worn: Vec<Worn>,
    /// Whether all weak bits of a word read alike at every other start: the word is the old or the new one.
    pub swings: bool,
}

impl Flash {
    /// An erased slot of so many `words`.
    pub fn erased(words: usize, supply: &Rc<RefCell<Supply>>, torn: Torn) -> Self {
        let cells = Cells { words: vec![u32::MAX; words], weak: vec![0; words], has_weak: false };
        Self { cells, supply: supply.clone(), torn, worn: Vec::new(), swings: false }
    }

    /// What the slot holds, to be put back by [`Flash::restore`].
    pub fn cells(&self) -> Cells {
        self.cells.clone()
    }

    /// Puts back what the slot held.
    pub fn restore(&mut self, cells: &Cells) {
        self.cells.clone_from(cells);
    }

    /// Puts `bytes` at the start of the slot, as a programmer does.
    pub fn flash(&mut self, bytes: &[u8]) {
        bytemuck::cast_slice_mut(&mut self.cells.words)[..bytes.len()].copy_from_slice(bytes);
    }

    /// Flips `bits` of word `place`, as an old cell does.
    pub fn decay(&mut self, place: usize, bits: u32) {
        self.cells.words[place] ^= bits;
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
            Torn::Mixed => Torn::of(supply.random.next_u64()),
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
    const ERASE_INTERVAL_S: u32 = 0;

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.cells.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
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
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        let supply = self.supply.clone();
        for (place, bytes) in (offset / 4..).zip(bytes.as_chunks::<4>().0) {
            let wanted = u32::from_le_bytes(*bytes);
            let mut supply = supply.borrow_mut();
            let Cells { words, weak, has_weak } = &mut self.cells;
            let (word, weak) = (&mut words[place], &mut weak[place]);
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
            for worn in self.worn.iter().filter(|worn| worn.place == place) {
                *word |= worn.ones;
            }
            if *word != wanted {
                return Err(FlashError);
            }
        }
        Ok(())
    }
}

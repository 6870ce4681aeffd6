//! Pages of settings in flash that behaves as an STM32F4's does, and can lose its power in the middle of any word.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::link::message::Setting;
use firmware::settings::{KeepError, Keeper, PAGE_BYTES, SettingPages};
use firmware::store::{FlashError, Slot};

use crate::power::{Power, operate};

/// A page that programming can only clear bits of.
pub struct MockPage {
    words: Vec<u32>,
    /// Power of both pages.
    power: Rc<RefCell<Power>>,
    /// Bits of a word that are left as they were when the power is cut while it is programmed or erased.
    untouched: u32,
    pub erases: usize,
    /// Number of words whose programming was begun.
    pub words_written: usize,
}

impl MockPage {
    fn pair() -> [Self; 2] {
        let power = Rc::new(RefCell::new(Power::default()));
        [0, 1].map(|_| Self {
            words: vec![u32::MAX; PAGE_BYTES / 4],
            power: power.clone(),
            untouched: 0x0F0F_0F0F,
            erases: 0,
            words_written: 0,
        })
    }

    /// All bytes of the page, to be changed without regard to what flash can do.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.words)
    }
}

impl Slot for MockPage {
    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erases += 1;
        for word in &mut self.words {
            if operate(&self.power).is_err() {
                *word |= !self.untouched;
                return Err(FlashError);
            }
            *word = u32::MAX;
        }
        Ok(())
    }

    /// # Panics
    /// A word is not whole.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        let place = self.words.get_mut(offset / 4..(offset + bytes.len()) / 4).ok_or(FlashError)?;
        for (there, bytes) in place.iter_mut().zip(bytes.as_chunks::<4>().0) {
            let word = u32::from_le_bytes(*bytes);
            self.words_written += 1;
            if operate(&self.power).is_err() {
                *there &= word | self.untouched;
                return Err(FlashError);
            }
            *there &= word;
            if *there != word {
                return Err(FlashError); // it was not erased
            }
        }
        Ok(())
    }
}

/// Settings that several boards share, one after the other: a board before a restart and after it.
pub struct SharedSettings<S = MockPage>(
    /// The pages.
    pub Rc<RefCell<SettingPages<S>>>,
);

impl<S> Clone for SharedSettings<S> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl Default for SharedSettings {
    fn default() -> Self {
        Self::in_pages(MockPage::pair())
    }
}

impl<S: Slot> SharedSettings<S> {
    /// Settings in these pages.
    pub fn in_pages(pages: [S; 2]) -> Self {
        Self(Rc::new(RefCell::new(SettingPages::new(pages))))
    }

    /// The bytes that are kept for `setting`.
    pub fn read_owned(&mut self, setting: Setting) -> Option<Vec<u8>> {
        self.read(setting, &mut [0; 1024]).map(<[u8]>::to_vec)
    }

    /// Keeps `bytes` for `setting`; returns whether something was written.
    pub fn keep_bytes(&mut self, setting: Setting, bytes: &[u8]) -> Result<bool, KeepError> {
        self.keep(setting, &[bytes])
    }
}

impl SharedSettings {
    /// Pages that hold these bytes.
    ///
    /// # Panics
    /// The bytes are not as many as a page has.
    pub fn holding(pages: [&[u8]; 2]) -> Self {
        let settings = Self::default();
        for (page, bytes) in settings.0.borrow_mut().pages().iter_mut().zip(pages) {
            page.bytes_mut().copy_from_slice(bytes);
        }
        settings
    }

    /// What both pages hold.
    pub fn bytes(&self) -> [Vec<u8>; 2] {
        self.0.borrow_mut().pages().each_ref().map(|page| page.bytes().to_vec())
    }

    /// Cuts the power after so many `operations` on words. The word that is cut keeps its bits in `untouched`.
    pub fn cut_power_after(&self, operations: usize, untouched: u32) {
        for page in self.0.borrow_mut().pages() {
            page.untouched = untouched;
            *page.power.borrow_mut() = Power::cut_after(operations);
        }
    }

    /// Switches the power on; returns whether it had been cut.
    pub fn power_on(&self) -> bool {
        self.0.borrow_mut().pages()[0].power.borrow_mut().on()
    }

    /// Number of erases of both pages.
    pub fn erases(&self) -> usize {
        self.0.borrow_mut().pages().iter().map(|page| page.erases).sum()
    }

    /// Number of words of both pages whose programming was begun.
    pub fn words_written(&self) -> usize {
        self.0.borrow_mut().pages().iter().map(|page| page.words_written).sum()
    }
}

impl<S: Slot> Keeper for SharedSettings<S> {
    fn make_firm(&mut self) -> Result<(), KeepError> {
        self.0.borrow_mut().make_firm()
    }

    fn read<'b>(&mut self, setting: Setting, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        self.0.borrow_mut().read(setting, buffer)
    }

    fn keep(&mut self, setting: Setting, parts: &[&[u8]]) -> Result<bool, KeepError> {
        self.0.borrow_mut().keep(setting, parts)
    }
}

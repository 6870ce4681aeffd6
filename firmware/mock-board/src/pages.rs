//! Settings in flash, shared with whoever restarts the board.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::link::message::Setting;
use firmware::settings::{KeepError, Keeper, SettingPages};
use firmware::store::Slot;

use crate::flash::Flash;

/// Settings that several boards share, one after the other: a board before a restart and after it.
#[derive(Clone)]
pub struct SharedSettings(
    /// The pages.
    pub Rc<RefCell<SettingPages<Flash>>>,
);

impl Default for SharedSettings {
    fn default() -> Self {
        Self::in_pages(Flash::pages())
    }
}

impl SharedSettings {
    /// Settings in these pages.
    pub fn in_pages(pages: [Flash; 2]) -> Self {
        Self(Rc::new(RefCell::new(SettingPages::new(pages))))
    }

    /// Pages that hold these bytes.
    pub fn holding(pages: [&[u8]; 2]) -> Self {
        let settings = Self::default();
        for (page, bytes) in settings.0.borrow_mut().pages().iter_mut().zip(pages) {
            page.flash(0, bytes);
        }
        settings
    }

    /// The bytes that are kept for `setting`.
    pub fn read_owned(&mut self, setting: Setting) -> Option<Vec<u8>> {
        self.read(setting, &mut [0; 1024]).map(<[u8]>::to_vec)
    }

    /// Keeps `bytes` for `setting`; returns whether something was written.
    pub fn keep_bytes(&mut self, setting: Setting, bytes: &[u8]) -> Result<bool, KeepError> {
        self.keep(setting, &[bytes])
    }

    /// What both pages hold.
    pub fn bytes(&self) -> [Vec<u8>; 2] {
        self.0.borrow_mut().pages().each_ref().map(|page| page.bytes().to_vec())
    }

    /// Cuts the power after so many `operations` on the flash.
    pub fn cut_power_after(&self, operations: u64) {
        self.0.borrow_mut().pages()[0].cut_power_after(operations);
    }

    /// Switches the power on; returns whether it had been cut.
    pub fn power_on(&self) -> bool {
        self.0.borrow_mut().pages()[0].power_on()
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

impl Keeper for SharedSettings {
    fn recover(&mut self) -> Result<(), KeepError> {
        self.0.borrow_mut().recover()
    }

    fn read<'b>(&mut self, setting: Setting, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        self.0.borrow_mut().read(setting, buffer)
    }

    fn keep(&mut self, setting: Setting, parts: &[&[u8]]) -> Result<bool, KeepError> {
        self.0.borrow_mut().keep(setting, parts)
    }
}

//! Cuts while a setting is kept.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::link::message::Setting;
use firmware::settings::{Keeper, PAGE_BYTES};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::Cuts;
use crate::flash::{Cells, Flash, Supply, Torn};
use crate::pages::SharedSettings;

/// Behind one in so many cuts, settings are kept for long, up to the next exchanges.
const LATER: u64 = 64;

/// Longest distance between second cuts that are tried.
const STRIDE: u64 = 16;

/// Cuts the power at one operation while a setting is kept, and at some of the operations behind it. The setting must be
/// the old or the new one, the same at each start, and the others as they were.
///
/// # Errors
/// What is wrong, and where.
pub fn cut_settings(seed: u64) -> Result<Cuts, String> {
    let mut case = Case::new(seed)?;
    let quarter = case.run()?;
    Ok(Cuts { count: case.cuts, quarter })
}

/// What each setting holds.
type Contents = [Option<Vec<u8>>; 3];

struct Case {
    random: Xoshiro256PlusPlus,
    supply: Rc<RefCell<Supply>>,
    settings: SharedSettings,
    /// What is kept before the cut.
    old: Contents,
    cuts: u64,
}

impl Case {
    /// Pages after some settings were kept, up to several exchanges of the pages. In half of the cases the next one leads
    /// to an exchange.
    fn new(seed: u64) -> Result<Self, String> {
        let supply = Supply::new(seed);
        let torn = Torn::new(seed);
        let page = || Flash::erased(PAGE_BYTES / 4, &supply, torn);
        let settings = SharedSettings::in_pages([page(), page()]);
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut case = Self { random, supply, settings, old: [None, None, None], cuts: 0 };
        let times = case.below(60);
        case.keep_some(times)?;
        if seed / Torn::COUNT as u64 % 2 == 1 {
            case.fill_page();
        }
        Ok(case)
    }

    /// Keeps settings `times` times, each of them at every start from then on.
    fn keep_some(&mut self, times: u64) -> Result<(), String> {
        for number in 0..times {
            let setting = self.setting();
            let bytes = self.content(setting, number);
            self.keep(setting, &bytes, None);
            let place = format!("write {number} without a cut");
            self.expect(setting, &[Some(&bytes)], &place)?;
            self.old[setting as usize] = Some(bytes);
        }
        Ok(())
    }

    /// Keeps configurations until the next setting, whichever it is, leads to an exchange.
    fn fill_page(&mut self) {
        for number in 0.. {
            let before = self.cells();
            let bytes = self.content(Setting::Configuration, number);
            self.keep(Setting::Configuration, &bytes, None);
            if self.supply.borrow().erases > 0 && number > 0 {
                self.restore(&before);
                break;
            }
            self.old[Setting::Configuration as usize] = Some(bytes);
        }
    }

    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end
    }

    fn setting(&mut self) -> Setting {
        Setting::ALL[self.below(3) as usize]
    }

    /// Content for `setting` of a length that it may have, different for each `number`.
    fn content(&mut self, setting: Setting, number: u64) -> Vec<u8> {
        let length = [40, 187, 585][setting as usize];
        let mut bytes = vec![0; length];
        self.random.fill_bytes(&mut bytes);
        bytes[0] = number as u8;
        bytes
    }

    /// Makes all cuts; returns the quarter of the work that the first one is in.
    fn run(&mut self) -> Result<usize, String> {
        let setting = self.setting();
        let old = self.old[setting as usize].clone();
        let new = self.content(setting, 200);
        let before = self.cells();
        self.keep(setting, &new, None);
        let operations = self.supply.borrow().operations;
        // The last operations of an exchange decide which page is in use.
        let last = operations.min(16);
        let first = if self.below(2) == 0 {
            operations - last + self.below(last)
        } else {
            self.below(operations)
        };
        self.restore(&before);
        self.keep(setting, &new, Some(first));
        self.cuts += 1;
        let place = format!("{setting:?}, operation {first} of {operations}");
        let after = self.cells();
        self.expect(setting, &[old.as_ref(), Some(&new)], &place)?;
        let next = self.content(setting, 201);
        let mut second = self.below(STRIDE);
        loop {
            self.restore(&after);
            if !self.keep(setting, &next, Some(second)) {
                return Ok((4 * first / operations) as usize);
            }
            self.cuts += 1;
            let mut place = format!("{place}, then operation {second}");
            if self.below(2) == 0 {
                let end = if self.below(2) == 0 { operations } else { 20 };
                let third = self.below(end);
                self.cuts += u64::from(self.keep(setting, &next, Some(third)));
                place = format!("{place}, then operation {third}");
            }
            self.expect(setting, &[old.as_ref(), Some(&new), Some(&next)], &place)?;
            self.keep(setting, &next, None);
            self.expect(setting, &[Some(&next)], &format!("{place}, mended"))?;
            if self.below(LATER) == 0 {
                let old = self.old.clone();
                self.old[setting as usize] = Some(next.clone());
                self.keep_some(40).map_err(|why| format!("{place}, later: {why}"))?;
                self.old = old;
            }
            second += 1 + self.below(STRIDE);
        }
    }

    /// Keeps `bytes` as far as the power lasts; returns whether it was cut.
    fn keep(&mut self, setting: Setting, bytes: &[u8], cut_after: Option<u64>) -> bool {
        self.settle();
        self.supply.borrow_mut().on(cut_after);
        let kept = self.settings.keep_bytes(setting, bytes);
        let gone = self.supply.borrow().gone;
        assert!(kept.is_ok() || gone, "{setting:?}: {kept:?}");
        gone
    }

    /// Lets weak bits settle, as at a start.
    fn settle(&mut self) {
        self.settings.0.borrow_mut().pages().iter_mut().for_each(Flash::settle);
        self.supply.borrow_mut().on(None);
    }

    fn read(&mut self, setting: Setting) -> Option<Vec<u8>> {
        self.settings.read_owned(setting)
    }

    /// At three starts `setting` must hold the same of `allowed`, and the other settings what they held.
    fn expect(
        &mut self,
        setting: Setting,
        allowed: &[Option<&Vec<u8>>],
        place: &str,
    ) -> Result<(), String> {
        let mut first = None;
        for start in 1..=3 {
            self.settle();
            self.settings.recover().map_err(|error| format!("{place}, start: {error:?}"))?;
            for other in Setting::ALL {
                let found = self.read(other);
                let is_right = if other == setting {
                    let first = first.get_or_insert_with(|| found.clone());
                    allowed.contains(&found.as_ref()) && *first == found
                } else {
                    found == self.old[other as usize]
                };
                if !is_right {
                    let length = found.map_or(0, |bytes| bytes.len());
                    return Err(format!(
                        "{place}: {other:?} holds other {length} B at start {start}"
                    ));
                }
            }
        }
        Ok(())
    }

    fn cells(&self) -> [Cells; 2] {
        self.settings.0.borrow_mut().pages().each_ref().map(Flash::cells)
    }

    fn restore(&mut self, cells: &[Cells; 2]) {
        let mut settings = self.settings.0.borrow_mut();
        settings.pages().iter_mut().zip(cells).for_each(|(page, cells)| page.restore(cells));
    }
}

//! Cuts of the power in whatever changes flash: uploads, undos, settings that are kept.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::store::{ConfirmedModels, Kind, PAGE_BYTES};

use super::{Cuts, SLOT_WORDS};
use crate::device::Device;
use crate::flash::{Flash, Supply, Torn};
use crate::host::{model_crc, undo};
use crate::models::{blob, crc_of};

/// What changes flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Job {
    /// An upload, from its begin to its confirmation.
    Upload,
    /// An undo of the last one.
    Undo,
    /// A setting that is kept, or forgotten.
    Setting,
}

impl Job {
    /// All jobs.
    pub const ALL: [Self; 3] = [Self::Upload, Self::Undo, Self::Setting];
}

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 3;

/// Most operations between two second cuts.
const STRIDE: u64 = 8;

/// First cuts of each device.
const FIRST_CUTS: usize = 4;

/// Behind one in so many cuts, the device is used for long, up to the next exchanges of pages.
const LATER: u64 = 64;

/// Kinds of settings, and the lengths that they have for a small sensor.
const SETTINGS: [(Kind, usize); 3] =
    [(Kind::Configuration, 40), (Kind::Constants, 187), (Kind::Baseline, 585)];

/// Cuts the power at one operation of the `job`, at operations of the start behind it, and of what a host does next. The
/// device must be as before, or as after the job, the same at each start.
///
/// # Errors
/// What is wrong, and where.
pub fn cut(job: Job, seed: u64) -> Result<Cuts, String> {
    let mut case = Case::new(seed);
    case.run(job)?;
    Ok(Cuts { count: case.cuts, quarters: case.quarters })
}

/// What a device shows of what its flash holds.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Shown {
    model: Option<u32>,
    settings: [Option<Vec<u8>>; 3],
}

/// What a host asks for: a model of this seed, an undo, or a setting with its bytes.
enum Wish {
    Model(usize),
    Undo,
    Setting(usize, Vec<u8>),
}

/// One first cut, and second cuts behind it.
struct Case {
    random: Xoshiro256PlusPlus,
    torn: Torn,
    device: Device,
    cuts: u64,
    /// Number of first cuts in each quarter of the job.
    quarters: [u64; 4],
}

impl Case {
    /// A device with a flashed model, and empty pages.
    fn new(seed: u64) -> Self {
        let (supply, torn) = (Supply::new(seed), Torn::new(seed));
        let slots = [0, 1].map(|_| Flash::erased(SLOT_WORDS, &supply, torn));
        let mut device = Device::new(slots);
        *device.journal.pages() = [0, 1].map(|_| Flash::erased(PAGE_BYTES / 4, &supply, torn));
        device.slots[0].flash(0, &blob(1, 2));
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut case = Self { random, torn, device, cuts: 0, quarters: [0; 4] };
        let swings = case.below(2) == 0;
        case.device.journal.pages().iter_mut().for_each(|page| page.swings = swings);
        case
    }

    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end
    }

    /// Makes all cuts.
    fn run(&mut self, job: Job) -> Result<(), String> {
        let old = self.prepare(job)?;
        let before = self.device.snapshot();
        let wish = self.wish(job, 2);
        let new = self.wanted(&wish, &old);
        self.certainly(&wish, &old)?;
        self.device.restore(&before);
        self.fulfil(&wish);
        let operations = self.device.supply.borrow().operations;
        if operations == 0 {
            return Ok(()); // nothing is kept that was to be forgotten
        }
        for _ in 0..FIRST_CUTS {
            // The last operations decide what counts.
            let last = operations.min(16);
            let first = match self.below(2) {
                0 => operations - last + self.below(last),
                _ => self.below(operations),
            };
            self.quarters[(4 * first / operations) as usize] += 1;
            self.device.restore(&before);
            let place = format!("{job:?}, operation {first} of {operations}, {}", self.torn.name());
            self.cut_twice(job, (&wish, first), [&old, &new], &place)?;
        }
        Ok(())
    }

    /// Cuts the power in an operation of a job, and at operations of the start behind it, and of what a host does next.
    fn cut_twice(
        &mut self,
        job: Job,
        (wish, first): (&Wish, u64),
        allowed: [&Shown; 2],
        place: &str,
    ) -> Result<(), String> {
        self.device.cut(first);
        self.fulfil(wish);
        self.cuts += 1;
        self.cut_recovery(&allowed, place)?;
        let found = self.expect(&allowed, place)?;
        let after = self.device.snapshot();
        let next = if self.below(2) == 0 { job } else { Job::ALL[self.below(3) as usize] };
        let mut second = self.below(STRIDE);
        loop {
            self.device.restore(&after);
            let wish = self.wish(next, 3);
            let wanted = self.wanted(&wish, &found);
            self.device.cut(second);
            self.fulfil(&wish);
            if !self.device.is_cut() {
                return Ok(());
            }
            self.cuts += 1;
            let place = format!("{place}, then operation {second} of {next:?}");
            let found = self.expect(&[&found, &wanted], &place)?;
            if self.below(4) == 0 {
                self.mend(found).map_err(|why| format!("{place}, mended: {why}"))?;
            }
            second += 1 + self.below(STRIDE);
        }
    }

    /// Uses the device for a while: uploads, and settings up to some exchanges of pages. In half of the cases a page is
    /// nearly full then. Returns what it shows.
    fn prepare(&mut self, job: Job) -> Result<Shown, String> {
        let mut shown = self.show();
        let uploads = if job == Job::Undo { 1 + self.below(2) } else { self.below(4) };
        for upload in 0..uploads {
            shown = self.certainly(&Wish::Model(4 + upload as usize), &shown)?;
        }
        if job != Job::Undo && self.below(4) == 0 {
            // The other slot is bad.
            self.device.slots[usize::from(uploads.is_multiple_of(2))].decay(20, 4);
        }
        let times = self.below(40);
        shown = self.keep_some(times, shown)?;
        if self.below(2) == 0 {
            self.fill_page();
            shown = self.show();
        }
        Ok(shown)
    }

    /// Keeps settings so many times, each of them at every start from then on.
    fn keep_some(&mut self, times: u64, mut shown: Shown) -> Result<Shown, String> {
        for _ in 0..times {
            let wish = self.wish(Job::Setting, 0);
            let wanted = self.wanted(&wish, &shown);
            if !self.fulfil(&wish) || self.show() != wanted {
                return Err(format!("not kept: {}", wanted.brief()));
            }
            shown = wanted;
        }
        Ok(shown)
    }

    /// Keeps configurations until one more, or a few, would lead to an exchange of pages.
    fn fill_page(&mut self) {
        let mut snapshots = Vec::new();
        loop {
            snapshots.push(self.device.snapshot());
            let wish = Wish::Setting(0, self.bytes(SETTINGS[0].1));
            self.fulfil(&wish);
            if self.device.supply.borrow().erases > 0 && snapshots.len() > 1 {
                break;
            }
        }
        let back = 1 + self.below(3) as usize;
        self.device.restore(&snapshots[snapshots.len().saturating_sub(back)]);
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        self.random.fill_bytes(&mut bytes);
        bytes
    }

    /// Something to ask for; a model is one of this `seed`.
    fn wish(&mut self, job: Job, seed: usize) -> Wish {
        match job {
            Job::Upload => Wish::Model(seed),
            Job::Undo => Wish::Undo,
            Job::Setting => {
                let setting = self.below(3) as usize;
                let length = if self.below(8) == 0 { 0 } else { SETTINGS[setting].1 };
                Wish::Setting(setting, self.bytes(length))
            }
        }
    }

    /// What a device that shows `found` shows once a wish has come true.
    fn wanted(&self, wish: &Wish, found: &Shown) -> Shown {
        let mut wanted = found.clone();
        match wish {
            Wish::Model(seed) => wanted.model = Some(crc_of(&blob(*seed, 2))),
            Wish::Undo => {
                let confirmed = ConfirmedModels::read(&self.device.journal, &self.device.slots);
                let previous =
                    confirmed.crcs.iter().flatten().find(|crc| found.model != Some(**crc));
                wanted.model = previous.copied().or(found.model);
            }
            Wish::Setting(setting, bytes) => {
                wanted.settings[*setting] = (!bytes.is_empty()).then(|| bytes.clone());
            }
        }
        wanted
    }

    /// Asks for something, as far as the power lasts; returns whether it came true.
    fn fulfil(&mut self, wish: &Wish) -> bool {
        match wish {
            Wish::Model(seed) => self.device.install(&blob(*seed, 2)).is_ok(),
            Wish::Undo => self.device.session(|session, board| {
                model_crc(session, board).is_some_and(|left| undo(session, board, left).0.is_ok())
            }),
            Wish::Setting(setting, bytes) => self.device.keep(SETTINGS[*setting].0, bytes).is_ok(),
        }
    }

    /// What the device shows after a restart.
    fn show(&mut self) -> Shown {
        let model = self.device.restart();
        let journal = &self.device.journal;
        let settings = SETTINGS.map(|(kind, _)| journal.read(kind).map(<[u8]>::to_vec));
        Shown { model, settings }
    }

    /// Checks that the device shows one of these, the same at each start; returns it.
    fn expect(&mut self, allowed: &[&Shown], place: &str) -> Result<Shown, String> {
        let first = self.show();
        for start in 1..=STARTS {
            let found = self.show();
            if found != first || !allowed.contains(&&found) {
                let allowed = allowed.iter().map(|shown| shown.brief()).collect::<Vec<_>>();
                let (first, found) = (first.brief(), found.brief());
                return Err(format!("{place}, start {start}: {first}, {found}, not {allowed:?}"));
            }
        }
        Ok(first)
    }

    /// Asks a device that shows `found` for something that must come true; returns what it shows then.
    fn certainly(&mut self, wish: &Wish, found: &Shown) -> Result<Shown, String> {
        let wanted = self.wanted(wish, found);
        if !self.fulfil(wish) {
            return Err(format!("refused: {}", wanted.brief()));
        }
        self.expect(&[&wanted], "without a cut")
    }

    /// Cuts the start behind the first cut at its own operations, and puts back what the flash held before.
    fn cut_recovery(&mut self, allowed: &[&Shown], place: &str) -> Result<(), String> {
        let before = self.device.snapshot();
        let mut operation = 0;
        loop {
            self.device.restore(&before);
            self.device.cut(operation).session(|_, _| ());
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            self.expect(allowed, &format!("{place}, then operation {operation} of the start"))?;
            operation += if operation < 16 { 1 } else { 1 + self.below(STRIDE) };
        }
        self.device.restore(&before);
        Ok(())
    }

    /// Asks for all kinds of things, which must come true for good; now and then for many.
    fn mend(&mut self, mut shown: Shown) -> Result<(), String> {
        for job in [Job::Upload, Job::Setting] {
            let wish = self.wish(job, 9);
            shown = self.certainly(&wish, &shown)?;
        }
        if self.below(LATER) == 0 {
            self.keep_some(60, shown)?;
        }
        Ok(())
    }
}

impl Shown {
    /// A few words.
    fn brief(&self) -> String {
        let heads = self.settings.each_ref().map(|bytes| bytes.as_ref().map(|bytes| bytes[0]));
        format!("model {:08x?}, settings {heads:?}", self.model)
    }
}

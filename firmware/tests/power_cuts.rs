//! Power that is cut at any operation of the flash, and again while the device recovers, or does what a host asks of it
//! next. Always it is as before or as after, the same at each start: the old model or the new one, never none, and so with
//! settings that are kept. One case for each seed.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::store::{ConfirmedModels, Kind, PAGE_BYTES};

use crate::mock::*;

/// Cases of each job, unless `TAXEL_CASES` says otherwise.
const CASES: u64 = 5;

/// First cuts of each device.
const FIRST_CUTS: usize = 4;

/// Most operations between two second cuts.
const STRIDE: u64 = 8;

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 3;

/// Kinds of settings, and the lengths that they have for a small sensor.
const SETTINGS: [(Kind, usize); 3] =
    [(Kind::Configuration, 40), (Kind::Constants, 187), (Kind::Baseline, 585)];

/// What changes flash.
#[derive(Debug, Clone, Copy)]
enum Job {
    Upload,
    Undo,
    Setting,
}

const JOBS: [Job; 3] = [Job::Upload, Job::Undo, Job::Setting];

/// What a host asks for: a model of this seed, an undo, or a setting with its bytes.
enum Wish {
    Model(usize),
    Undo,
    Setting(usize, Vec<u8>),
}

/// What a device shows of what its flash holds.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Shown {
    model: Option<u32>,
    settings: [Option<Vec<u8>>; 3],
}

#[test]
fn power_lost_at_any_time_leaves_a_device_as_before_or_as_after() {
    let cases = std::env::var("TAXEL_CASES").map_or(CASES, |cases| cases.parse().unwrap());
    for job in JOBS {
        let cuts: u64 = (0..cases).map(|seed| Case::new(seed).run(job)).sum();
        assert!(cuts > 80 * cases, "{job:?}: {cuts}");
    }
}

/// One device, cut again and again.
struct Case {
    seed: u64,
    random: Xoshiro256PlusPlus,
    device: Device,
    cuts: u64,
}

impl Case {
    /// A device with a flashed model, and empty pages.
    fn new(seed: u64) -> Self {
        let supply = Supply::new(seed);
        let mut device = Device::new([0, 1].map(|_| Flash::erased(768, &supply)));
        *device.journal.pages() = [0, 1].map(|_| Flash::erased(PAGE_BYTES, &supply));
        device.slots[0].flash(0, &blob(1, 2));
        Self { seed, random: Xoshiro256PlusPlus::seed_from_u64(seed), device, cuts: 0 }
    }

    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end
    }

    /// Makes all cuts, and returns their number.
    fn run(mut self, job: Job) -> u64 {
        let old = self.prepare(job);
        let before = self.device.snapshot();
        let wish = self.wish(job, 2);
        let new = self.wanted(&wish, &old);
        self.fulfil(&wish);
        let operations = self.device.supply.borrow().operations;
        if operations == 0 {
            return 0; // nothing is kept that was to be forgotten
        }
        for _ in 0..FIRST_CUTS {
            // The last operations decide what counts.
            let last = operations.min(16);
            let first = match self.below(2) {
                0 => operations - last + self.below(last),
                _ => self.below(operations),
            };
            self.device.restore(&before);
            self.device.cut(first);
            self.fulfil(&wish);
            self.cuts += 1;
            let place = format!("seed {}, {job:?}, operation {first} of {operations}", self.seed);
            self.cut_recovery(&[&old, &new], &place);
            let found = self.expect(&[&old, &new], &place);
            self.cut_next(job, &found, &place);
        }
        self.cuts
    }

    /// Uses the device for a while: uploads, and settings up to some exchanges of pages. In half of the cases a page is
    /// nearly full then. Returns what it shows.
    fn prepare(&mut self, job: Job) -> Shown {
        let mut shown = self.show();
        let uploads = if matches!(job, Job::Undo) { 1 + self.below(2) } else { self.below(4) };
        let models = (0..uploads).map(|upload| Wish::Model(4 + upload as usize));
        for wish in models.collect::<Vec<_>>() {
            shown = self.certainly(&wish, &shown);
        }
        for _ in 0..self.below(40) {
            let wish = self.wish(Job::Setting, 0);
            shown = self.certainly(&wish, &shown);
        }
        if self.below(2) == 0 {
            self.fill_page();
        }
        self.show()
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
                let mut crcs = confirmed.crcs.into_iter().flatten();
                wanted.model = crcs.find(|crc| found.model != Some(*crc)).or(found.model);
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
            Wish::Undo => self
                .device
                .session(|host| host.model_crc().is_some_and(|left| host.undo(left).0.is_ok())),
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
    fn expect(&mut self, allowed: &[&Shown], place: &str) -> Shown {
        let first = self.show();
        for start in 1..=STARTS {
            let found = self.show();
            assert!(found == first && allowed.contains(&&found), "{place}, start {start}");
        }
        first
    }

    /// Asks a device that shows `found` for something that must come true; returns what it shows then.
    fn certainly(&mut self, wish: &Wish, found: &Shown) -> Shown {
        let wanted = self.wanted(wish, found);
        assert!(self.fulfil(wish), "seed {}: refused", self.seed);
        self.expect(&[&wanted], "without a cut")
    }

    /// Cuts the start behind the first cut at its own operations, and puts back what the flash held before.
    fn cut_recovery(&mut self, allowed: &[&Shown], place: &str) {
        let before = self.device.snapshot();
        let mut operation = 0;
        loop {
            self.device.restore(&before);
            self.device.cut(operation).session(|_| ());
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            self.expect(allowed, &format!("{place}, then operation {operation} of the start"));
            operation += if operation < 16 { 1 } else { 1 + self.below(STRIDE) };
        }
        self.device.restore(&before);
    }

    /// Cuts what a host asks next of a device that shows `found`, at many operations; now and then it is used on.
    fn cut_next(&mut self, job: Job, found: &Shown, place: &str) {
        let before = self.device.snapshot();
        let next = if self.below(2) == 0 { job } else { JOBS[self.below(3) as usize] };
        let mut operation = self.below(STRIDE);
        loop {
            self.device.restore(&before);
            let wish = self.wish(next, 3);
            let wanted = self.wanted(&wish, found);
            self.device.cut(operation);
            self.fulfil(&wish);
            if !self.device.is_cut() {
                return;
            }
            self.cuts += 1;
            let place = format!("{place}, then operation {operation} of {next:?}");
            let mut shown = self.expect(&[found, &wanted], &place);
            if self.below(4) == 0 {
                for job in [Job::Upload, Job::Setting] {
                    let wish = self.wish(job, 9);
                    shown = self.certainly(&wish, &shown);
                }
            }
            operation += 1 + self.below(STRIDE);
        }
    }
}

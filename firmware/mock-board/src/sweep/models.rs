//! Cuts while a model is uploaded, or left for the one before it.

use firmware::link::message::UploadState;
use firmware::seal::{KEY_BYTES, Key, Seal};
use model_core::AlignedBytes;

use super::{Cuts, device, first_cut};
use crate::device::{Answer, Device, confirmed};
use crate::flash::{Flash, Torn};
use crate::models::{blob, crc_of};

/// What changes the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Job {
    Upload,
    Undo,
}

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 3;

const KEY: Key = [0x42; KEY_BYTES];

/// Cuts the power at one operation of the job, at each operation of the start behind it, and at each of what a host does
/// next. The old or the new model must be in force, the same at each start. Half of all uploads go to a device with a
/// key, and are sealed.
///
/// # Errors
/// What is wrong, and where.
pub fn cut_model(job: Job, seed: u64) -> Result<Cuts, String> {
    let mut case = Case::new(job, seed);
    let quarter = case.run()?;
    Ok(Cuts { count: case.cuts, quarter })
}

/// One first cut, and all second cuts behind it.
struct Case {
    job: Job,
    seed: u64,
    torn: Torn,
    /// Uploads before the cut.
    uploads: u32,
    is_sealed: bool,
    device: Device,
    new: AlignedBytes,
    next: AlignedBytes,
    cuts: u64,
}

impl Case {
    fn new(job: Job, seed: u64) -> Self {
        let torn = Torn::new(seed);
        let mut device = device(seed, torn);
        let turn = seed / Torn::COUNT as u64;
        let uploads = match job {
            Job::Upload => turn % 4,
            Job::Undo => 1 + turn / 2 % 2,
        } as u32;
        // No undo leads to an older seal.
        let is_sealed = job == Job::Upload && turn / 4 % 2 == 1;
        if is_sealed {
            device.key = Flash::with_key(&KEY);
        }
        let (new, next) = (blob(2, 2), blob(7, 1));
        Self { job, seed, torn, uploads, is_sealed, device, new, next, cuts: 0 }
    }

    /// Installs `blob`, with a seal of this version if there is a key.
    fn install(&mut self, blob: &[u8], version: u32, cut_after: Option<u64>) -> Answer {
        self.device.cut_after = cut_after;
        self.device.install(blob, self.is_sealed.then(|| Seal::new(&KEY, version, blob)))
    }

    /// Makes all cuts; returns the quarter of the job that the first one is in.
    fn run(&mut self) -> Result<usize, String> {
        let old = self.prepare()?;
        let before = self.device.cells();
        let outcome = self.attempt(None);
        let operations = self.device.supply.borrow().operations;
        let Ok(UploadState::Confirmed { crc_32: new }) = outcome else {
            return Err(format!("without a cut: {outcome:?}"));
        };
        self.expect(&[Some(new)], "without a cut")?;
        let (first, quarter) = first_cut(self.seed, operations);
        self.device.restore(&before);
        let _ = self.attempt(Some(first));
        self.cuts += 1;
        let place = format!("operation {first} of {operations}, {}", self.torn.name());
        let allowed = [old, Some(new)];
        self.cut_recovery(&allowed, &place)?;
        let in_force = self.expect(&allowed, &place)?;
        let after = self.device.cells();
        for second in 0.. {
            self.device.restore(&after);
            // Half the hosts try the same again, the others something else.
            let again = self.seed.is_multiple_of(2) && in_force == old;
            let wanted = if again {
                let _ = self.attempt(Some(second));
                new
            } else {
                let next = self.next.clone();
                let _ = self.install(&next, 11, Some(second));
                crc_of(&next)
            };
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            let place = format!("{place}, then operation {second}");
            // Without a model in force, no record makes up for a doubtful one: it may be sound at a later start.
            let doubtful = if in_force.is_none() { Some(new) } else { in_force };
            self.expect(&[in_force, doubtful, Some(wanted)], &place)?;
            if second % 4 == self.seed % 4 {
                self.mend(&place)?;
            }
        }
        Ok(quarter)
    }

    /// Cuts the start behind the first cut at each of its own operations, and puts back what the slots held before.
    fn cut_recovery(&mut self, allowed: &[Option<u32>], place: &str) -> Result<(), String> {
        let before = self.device.cells();
        for operation in 0.. {
            self.device.restore(&before);
            self.device.cut(operation).session(|_, _| ());
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            self.expect(allowed, &format!("{place}, then operation {operation} of the start"))?;
        }
        self.device.restore(&before);
        Ok(())
    }

    /// Brings the old model into force; returns its CRC-32. One that was flashed has no seal: with a key, it is not in
    /// force.
    fn prepare(&mut self) -> Result<Option<u32>, String> {
        let (old, earlier) = (blob(1, 2), blob(5, 1));
        let uploads = self.uploads;
        let first = if uploads == 0 { &old } else { &earlier };
        self.device.slots[0].flash(0, first);
        for upload in 1..=uploads {
            let blob = if upload == uploads { &old } else { &earlier };
            let outcome = self.install(blob, upload, None);
            if outcome != confirmed(blob) {
                return Err(format!("upload {upload} before the cut: {outcome:?}"));
            }
        }
        if self.job != Job::Undo && self.seed / 5 % 2 == 1 {
            self.device.slots[usize::from(uploads.is_multiple_of(2))].decay(20, 4); // the other slot is bad
        }
        let in_force = (uploads > 0 || !self.is_sealed).then(|| crc_of(&old));
        self.expect(&[in_force], "before the cut")
    }

    /// Changes the model, as far as the power lasts.
    fn attempt(&mut self, cut_after: Option<u64>) -> Answer {
        if self.job == Job::Upload {
            let new = self.new.clone();
            return self.install(&new, 10, cut_after);
        }
        self.device.cut_after = cut_after;
        self.device.undo(crc_of(&blob(1, 2)))
    }

    /// Checks that one of these models comes into force, and stays at each start; returns it.
    fn expect(&mut self, allowed: &[Option<u32>], place: &str) -> Result<Option<u32>, String> {
        let mut first = self.device.restart();
        for start in 0..STARTS {
            let found = if start == 0 { first } else { self.device.restart() };
            first = first.or(found);
            if !allowed.contains(&found) {
                return Err(format!("{place}: in force is {found:08x?}, not of {allowed:08x?}"));
            }
            if found != first {
                return Err(format!("{place}: {first:08x?} at one start, then {found:08x?}"));
            }
        }
        Ok(first)
    }

    /// An upload without a cut comes into force, for good.
    fn mend(&mut self, place: &str) -> Result<(), String> {
        let mend = blob(9, 1);
        let outcome = self.install(&mend, 12, None);
        if outcome != confirmed(&mend) {
            return Err(format!("{place}: the next upload is {outcome:?}"));
        }
        self.expect(&[Some(crc_of(&mend))], &format!("{place}, mended")).map(drop)
    }
}

//! Cuts while a model is uploaded, or left for the one before it.

use firmware::link::message::UploadState;
use model_core::AlignedBytes;

use super::device;
use crate::device::{Answer, Device, confirmed};
use crate::flash::Torn;
use crate::models::{blob, crc_of};

/// What changes the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Job {
    Upload,
    Undo,
}

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 3;

/// Cuts the power at one operation of the job, at each operation of the start behind it, and at each of what a host does
/// next. The old or the new model must be in force, the same at each start. Returns the number of cuts.
///
/// # Errors
/// What is wrong, and where.
pub fn cut_model(job: Job, seed: u64) -> Result<u64, String> {
    let mut case = Case::new(job, seed);
    case.run()?;
    Ok(case.cuts)
}

/// One first cut, and all second cuts behind it.
struct Case {
    job: Job,
    seed: u64,
    torn: Torn,
    device: Device,
    new: AlignedBytes,
    next: AlignedBytes,
    cuts: u64,
}

impl Case {
    fn new(job: Job, seed: u64) -> Self {
        let torn = Torn::new(seed);
        let device = device(seed, torn);
        Self { job, seed, torn, device, new: blob(2, 2), next: blob(7, 1), cuts: 0 }
    }

    fn run(&mut self) -> Result<(), String> {
        let old = self.prepare()?;
        let before = self.device.cells();
        let outcome = self.attempt(None);
        let operations = self.device.supply.borrow().operations;
        let Ok(UploadState::Confirmed { crc_32: new }) = outcome else {
            return Err(format!("without a cut: {outcome:?}"));
        };
        self.expect(&[Some(new)], "without a cut")?;
        let first = (self.seed / (4 * Torn::COUNT as u64)).wrapping_mul(17) % operations;
        self.device.restore(&before);
        let _ = self.attempt(Some(first));
        self.cuts += 1;
        let place = format!("operation {first} of {operations}, {}", self.torn.name());
        let allowed = [Some(old), Some(new)];
        self.cut_recovery(&allowed, &place)?;
        let in_force = self.expect(&allowed, &place)?;
        let after = self.device.cells();
        for second in 0.. {
            self.device.restore(&after);
            // Half the hosts try the same again, the others something else.
            let again = self.seed.is_multiple_of(2) && in_force == Some(old);
            let wanted = if again {
                let _ = self.attempt(Some(second));
                new
            } else {
                let _ = self.device.cut(second).install(&self.next, None);
                crc_of(&self.next)
            };
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            let place = format!("{place}, then operation {second}");
            self.expect(&[in_force, Some(wanted)], &place)?;
            if second % 4 == self.seed % 4 {
                self.mend(&place)?;
            }
        }
        Ok(())
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

    /// Brings the old model into force; returns its CRC-32.
    fn prepare(&mut self) -> Result<u32, String> {
        let (old, earlier) = (blob(1, 2), blob(5, 1));
        let uploads = match (self.job, self.seed / Torn::COUNT as u64 % 4) {
            (Job::Undo, 0 | 1) | (_, 1) => 1,
            (Job::Undo, _) | (_, 2) => 2,
            (_, 3) => 3,
            _ => 0,
        };
        let first = if uploads == 0 { &old } else { &earlier };
        self.device.slots[0].flash(0, first);
        for upload in 1..=uploads {
            let blob = if upload == uploads { &old } else { &earlier };
            let outcome = self.device.install(blob, None);
            if outcome != confirmed(blob) {
                return Err(format!("upload {upload} before the cut: {outcome:?}"));
            }
        }
        if self.job != Job::Undo && self.seed / 40 % 2 == 1 {
            self.device.slots[usize::from(uploads % 2 == 0)].decay(20, 4); // the other slot is bad
        }
        self.expect(&[Some(crc_of(&old))], "before the cut")?;
        Ok(crc_of(&old))
    }

    /// Changes the model, as far as the power lasts.
    fn attempt(&mut self, cut_after: Option<u64>) -> Answer {
        self.device.cut_after = cut_after;
        match self.job {
            Job::Upload => self.device.install(&self.new, None),
            Job::Undo => self.device.undo(crc_of(&blob(1, 2))),
        }
    }

    /// Checks that one of these models comes into force, and the same at each start; returns it.
    fn expect(&mut self, allowed: &[Option<u32>], place: &str) -> Result<Option<u32>, String> {
        let first = self.device.restart();
        for start in 0..STARTS {
            let found = if start == 0 { first } else { self.device.restart() };
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
        let outcome = self.device.install(&mend, None);
        if outcome != confirmed(&mend) {
            return Err(format!("{place}: the next upload is {outcome:?}"));
        }
        self.expect(&[Some(crc_of(&mend))], &format!("{place}, mended")).map(drop)
    }
}

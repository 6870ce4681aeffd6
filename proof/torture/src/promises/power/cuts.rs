//! Cuts while a model is uploaded, recalibrated or left for the one before it.

use mock_board::{blob, crc_of};
use model_core::AlignedBytes;

use super::device::{Device, Outcome};
use super::flash::Torn;
use super::presses;
use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::Tally;
use crate::tools::Tools;

pub const UPLOAD: Promise = Promise {
    name: "cut-upload",
    text: "power cut in an upload: old or new model",
    share: 12,
    check: |effort, tools| check(Job::Upload, effort, tools),
};

pub const UNDO: Promise = Promise {
    name: "cut-undo",
    text: "power cut in an undo: one of the two models",
    share: 6,
    check: |effort, tools| check(Job::Undo, effort, tools),
};

pub const RECALIBRATION: Promise = Promise {
    name: "cut-recalibration",
    text: "power cut in a recalibration: old or new model",
    share: 6,
    check: |effort, tools| check(Job::Recalibration, effort, tools),
};

/// What changes the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Job {
    Upload,
    Undo,
    Recalibration,
}

/// Least and most cases; a case is one first cut, and all second cuts behind it.
const LEAST: u64 = 600;
const MOST: u64 = 1 << 40;

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 3;

fn check(job: Job, effort: &Effort, _: &Tools) -> Result<Found, String> {
    let cuts = Tally::new(Torn::ALL.map(Torn::name));
    let least = if job == Job::Recalibration { LEAST / 4 } else { LEAST };
    let mut found = effort.worst((least, MOST), (0.0, "losses"), |seed| {
        Case::new(job, seed).run(&cuts).map(|()| 0.0)
    });
    found.cases = cuts.sum();
    if found.note.is_empty() {
        found.note = cuts.text();
    }
    Ok(found)
}

/// One first cut, and all second cuts behind it.
struct Case {
    job: Job,
    seed: u64,
    torn: Torn,
    device: Device,
    new: AlignedBytes,
    next: AlignedBytes,
}

impl Case {
    fn new(job: Job, seed: u64) -> Self {
        let torn = Torn::of(seed);
        let device = Device::new(seed, torn);
        Self { job, seed, torn, device, new: blob(2, 2), next: blob(7, 1) }
    }

    fn run(mut self, cuts: &Tally<{ Torn::COUNT }>) -> Result<(), String> {
        let old = self.prepare()?;
        let before = self.device.cells();
        let outcome = self.attempt(None);
        let operations = self.device.supply.borrow().operations;
        let Outcome::InForce(new) = outcome else {
            return Err(format!("without a cut: {outcome:?}"));
        };
        self.expect(&[Some(new)], "without a cut")?;
        let first = (self.seed / (4 * Torn::COUNT as u64)).wrapping_mul(17) % operations;
        self.device.restore(&before);
        self.attempt(Some(first));
        cuts.add(self.kind(), 1);
        let place = format!("operation {first} of {operations}, {}", self.torn.name());
        let allowed = [Some(old), Some(new)];
        self.cut_recovery(&allowed, &place, cuts)?;
        let in_force = self.expect(&allowed, &place)?;
        let after = self.device.cells();
        for second in 0.. {
            self.device.restore(&after);
            // Half the hosts try the same again, the others something else.
            let again = self.seed.is_multiple_of(2) && in_force == Some(old);
            let (wanted, outcome) = if again {
                (new, self.attempt(Some(second)))
            } else {
                let next = self.next.clone();
                (crc_of(&next), self.device.upload(&next, usize::MAX, Some(second)))
            };
            if outcome != Outcome::Cut {
                break;
            }
            cuts.add(self.kind(), 1);
            let place = format!("{place}, then operation {second}");
            self.expect(&[in_force, Some(wanted)], &place)?;
            if second % 4 == self.seed % 4 {
                self.mend(&place)?;
            }
        }
        Ok(())
    }

    /// Cuts the start behind the first cut at each of its own operations, and puts back what the slots held before.
    fn cut_recovery(
        &mut self,
        allowed: &[Option<u32>],
        place: &str,
        cuts: &Tally<{ Torn::COUNT }>,
    ) -> Result<(), String> {
        let before = self.device.cells();
        for operation in 0.. {
            self.device.restore(&before);
            self.device.session(Some(operation), |_, _| ());
            if !self.device.supply.borrow().gone {
                break;
            }
            cuts.add(self.kind(), 1);
            self.expect(allowed, &format!("{place}, then operation {operation} of the start"))?;
        }
        self.device.restore(&before);
        Ok(())
    }

    fn kind(&self) -> usize {
        self.torn as usize
    }

    /// Brings the old model into force; returns its CRC-32.
    fn prepare(&mut self) -> Result<u32, String> {
        let old = if self.job == Job::Recalibration { presses::model() } else { blob(1, 2) };
        let earlier = blob(5, 1);
        let uploads = match (self.job, self.seed / Torn::COUNT as u64 % 4) {
            (Job::Undo, 0 | 1) | (_, 1) => 1,
            (Job::Undo, _) | (_, 2) => 2,
            (_, 3) => 3,
            _ => 0,
        };
        let first = if uploads == 0 { &old } else { &earlier };
        self.device.slots[0].flash(first);
        for upload in 1..=uploads {
            let blob = if upload == uploads { &old } else { &earlier };
            let outcome = self.device.upload(blob, usize::MAX, None);
            if outcome != Outcome::InForce(crc_of(blob)) {
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
    fn attempt(&mut self, cut_after: Option<u64>) -> Outcome {
        match self.job {
            Job::Upload => self.device.upload(&self.new, usize::MAX, cut_after),
            Job::Undo => self.device.undo(crc_of(&blob(1, 2)), cut_after),
            Job::Recalibration => presses::recalibrate(&mut self.device, cut_after),
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
        let outcome = self.device.upload(&mend, usize::MAX, None);
        if outcome != Outcome::InForce(crc_of(&mend)) {
            return Err(format!("{place}: the next upload is {outcome:?}"));
        }
        self.expect(&[Some(crc_of(&mend))], &format!("{place}, mended")).map(drop)
    }
}

//! Power that is cut at operations of the flash, and again while the device recovers: always it is as before, or as
//! after.

use mock_board::Torn;
use mock_board::sweep::{Job, cut};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::Tally;

pub const UPLOAD: Promise = Promise {
    name: "cut-upload",
    text: "power cut in an upload: old or new model",
    share: 8,
    check: |effort, _| Ok(sweep(effort, Job::Upload)),
};

pub const UNDO: Promise = Promise {
    name: "cut-undo",
    text: "power cut in an undo: one of the two models",
    share: 8,
    check: |effort, _| Ok(sweep(effort, Job::Undo)),
};

pub const SETTINGS: Promise = Promise {
    name: "cut-settings",
    text: "power cut while a setting is kept: old or new",
    share: 8,
    check: |effort, _| Ok(sweep(effort, Job::Setting)),
};

/// Most cases.
const MOST: u64 = 1 << 40;

/// Least number of devices.
const LEAST: u64 = 48;

/// Sweeps over cuts in a `job`.
fn sweep(effort: &Effort, job: Job) -> Found {
    let cuts = Tally::new(Torn::ALL.map(Torn::name));
    let mut found = effort.worst((LEAST, MOST), (0.0, "losses"), |seed| {
        cuts.add(Torn::new(seed) as usize, cut(job, seed)?.count);
        Ok(0.0)
    });
    found.cases = cuts.sum();
    if found.note.is_empty() {
        found.note = cuts.text();
    }
    found
}

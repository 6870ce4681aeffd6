//! Power that is cut at operations of the flash, and again while the device recovers: always it is as before, or as
//! after.

use mock_board::Torn;
use mock_board::sweep::{Job, abort_and_decay, cut, upload_to_worn};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::{Tally, outcomes};

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

pub const KEY: Promise = Promise {
    name: "cut-key",
    text: "power cut while a key is set: old or new one",
    share: 8,
    check: |effort, _| Ok(sweep(effort, Job::Key)),
};

pub const DECAY: Promise = Promise {
    name: "abort-decay",
    text: "slot in force decays: aborted uploads stay out",
    share: 2,
    check: |effort, _| {
        let names = ["the same model", "the one before it", "none"];
        Ok(outcomes(effort, ("in force after the decay: ", names), "losses", abort_and_decay))
    },
};

pub const WORN: Promise = Promise {
    name: "worn-words",
    text: "an upload to worn flash: in force, or refused",
    share: 2,
    check: |effort, _| {
        let names = ["in force", "refused", "cut"];
        Ok(outcomes(effort, ("uploads: ", names), "losses", upload_to_worn))
    },
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

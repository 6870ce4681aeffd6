//! Power that is cut at every operation of the flash, and again while the device recovers: always the old or the new
//! model is in force.

use mock_board::Torn;
use mock_board::sweep::{
    Cuts, Job, abort_and_decay, cut_key, cut_model, cut_settings, upload_to_worn,
};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::{Tally, outcomes};

pub const UPLOAD: Promise = Promise {
    name: "cut-upload",
    text: "power cut in an upload: old or new model",
    share: 12,
    check: |effort, _| Ok(sweep(effort, 600, |seed| cut_model(Job::Upload, seed))),
};

pub const UNDO: Promise = Promise {
    name: "cut-undo",
    text: "power cut in an undo: one of the two models",
    share: 6,
    check: |effort, _| Ok(sweep(effort, 600, |seed| cut_model(Job::Undo, seed))),
};

pub const SETTINGS: Promise = Promise {
    name: "cut-settings",
    text: "power cut while a setting is kept: old or new",
    share: 8,
    check: |effort, _| Ok(sweep(effort, 160, cut_settings)),
};

pub const PROVISION: Promise = Promise {
    name: "cut-provision",
    text: "power cut while a key is set: none or that one",
    share: 2,
    check: |effort, _| Ok(sweep(effort, 600, cut_key)),
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

/// Sweeps over at least so many cases.
fn sweep(effort: &Effort, least: u64, case: fn(u64) -> Result<Cuts, String>) -> Found {
    let cuts = Tally::new(Torn::ALL.map(Torn::name));
    let mut found = effort.worst((least, MOST), (0.0, "losses"), |seed| {
        cuts.add(Torn::new(seed) as usize, case(seed)?.count);
        Ok(0.0)
    });
    found.cases = cuts.sum();
    if found.note.is_empty() {
        found.note = cuts.text();
    }
    found
}

//! All promises, in the order of the table.

// Every test has the same type, whether it can fail to run or not.
#![allow(clippy::unnecessary_wraps)]

mod authenticity;
mod exponentials;
mod files;
mod flips;
mod interruptions;
mod load;
mod power;
mod ram;
mod hostile_bytes;
mod size_bombs;

use crate::promise::Promise;

/// Every promise. Exact tests stand first, then those that draw their cases.
pub const PROMISES: &[Promise] = &[
    exponentials::POLYNOMIAL,
    flips::ONE,
    flips::TWO,
    power::UPLOAD,
    power::UNDO,
    power::RECALIBRATION,
    power::SETTINGS,
    power::DECAY,
    power::WORN,
    authenticity::FORGED,
    ram::RAM,
    load::FRAMES,
    load::LINK,
    load::WATCHDOG,
    files::FAULTS,
    interruptions::JOBS,
    size_bombs::SIZE_BOMBS,
    hostile_bytes::HOSTILE_BYTES,
    hostile_bytes::RESIGNED_BLOBS,
];

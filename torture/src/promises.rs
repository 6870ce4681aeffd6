//! All promises, in the order of the table.

// Every test has the same type, whether it can fail to run or not.
#![allow(clippy::unnecessary_wraps)]

mod exponentials;
mod flips;
mod load;
mod power;
mod ram;

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
    ram::RAM,
    load::FRAMES,
    load::LINK,
    load::WATCHDOG,
];

//! All promises, in the order of the table.

// Every test has the same type, whether it can fail to run or not.
#![allow(clippy::unnecessary_wraps)]

mod exponentials;
mod inference;
mod training;
mod scale;
mod least_squares;
mod rls;
mod forward;

mod sensor;

mod flips;
mod power;
mod load;

mod hostile_bytes;

use crate::promise::Promise;

/// Every promise: numbers, sensor, device, hostile input.
pub const PROMISES: &[Promise] = &[
    exponentials::POLYNOMIAL,
    inference::F32,
    inference::FIXED16,
    training::EXTREMES,
    scale::SCALE,
    least_squares::RESIDUAL,
    rls::FORGETTING,
    rls::WITHOUT_FORGETTING,
    forward::TOUCHING,
    sensor::NAMED,
    sensor::SILENT,
    flips::ONE,
    flips::TWO,
    power::UPLOAD,
    power::UNDO,
    power::SETTINGS,
    load::FRAMES,
    load::LINK,
    load::WATCHDOG,
    hostile_bytes::HOSTILE_BYTES,
    hostile_bytes::RESIGNED_BLOBS,
];

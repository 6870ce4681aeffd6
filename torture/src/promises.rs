//! All promises, in the order of the table.

// Every test has the same type, whether it can fail to run or not.
#![allow(clippy::unnecessary_wraps)]

mod exponentials;
mod sensor;

use crate::promise::Promise;

/// Every promise. Exact tests stand first, then those that draw their cases.
pub const PROMISES: &[Promise] =
    &[exponentials::POLYNOMIAL, sensor::NAMED, sensor::NOTICED, sensor::SILENT, sensor::FILLED];

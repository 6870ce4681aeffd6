//! All promises, in the order of the table.

// Every test has the same type, whether it can fail to run or not.
#![allow(clippy::unnecessary_wraps)]

mod exponentials;
mod inference;
mod training;
pub mod scale;
mod least_squares;
pub mod rls;
mod forward;

use crate::promise::Promise;

/// Every promise. Exact tests stand first, then those that draw their cases.
pub const PROMISES: &[Promise] = &[
    exponentials::POLYNOMIAL,
    exponentials::LIBM,
    exponentials::MICROMATH,
    exponentials::EXP2,
    exponentials::MONOTONE,
    exponentials::ANY_NUMBER,
    inference::F32,
    inference::FIXED16,
    training::EXTREMES,
    scale::SCALE,
    least_squares::RESIDUAL,
    rls::FORGETTING,
    rls::WITHOUT_FORGETTING,
    forward::TOUCHING,
];

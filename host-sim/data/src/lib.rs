//! The ground floor of Taxel's host side: tables of measurements, data files, seeded random numbers.
//!
//! Modules stand from the ground up; each imports only what stands before it.

#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

pub mod error;
pub mod simd;
mod elementary;
pub mod random;
pub mod digest;
pub mod progress;
pub mod input;
pub mod output;
pub mod columns;
pub mod mat;
pub mod data_file;
pub mod csv_file;
pub mod join;
pub mod table;
pub mod dataset;
pub mod clock;
pub mod rest;
pub mod spectrum;

pub use elementary::{exp, ln, normal_share_below, sin_cos};
pub use error::{BadValue, Error, Result};

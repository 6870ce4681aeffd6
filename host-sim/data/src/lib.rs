//! The ground floor of Taxel's host side: tables of measurements, data files, seeded random numbers.
//!
//! Modules stand from the ground up; each imports only what stands before it.
//!
#![doc = include_str!("../README.md")]
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
mod values;
pub mod table;
pub mod dataset;
pub mod clock;
pub mod rest;

pub use clock::Clock;
pub use data_file::DataFile;
pub use dataset::{AtRest, Dataset};
pub use elementary::{exp, ln, normal_share_below, sin_cos};
pub use error::{BadValue, Error, Result, require};
pub use progress::{Progress, Silent};
pub use random::{Purpose, Random, Stream};
pub use rest::Rest;
pub use simd::{LANES, Lanes};
pub use table::Table;
pub use values::Values;

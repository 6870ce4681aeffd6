//! Experiments on tactile sensors, simulated or measured, and their evaluation. Usable without the program.
//!
//! Data flows one way. An [experiment] says what to simulate and train; [`taxel_simulate`] makes frames;
//! [`taxel_learn`] trains and decodes; [`evaluate`] judges. Modules stand from the ground up; each imports only what
//! stands before it.
//!
#![doc = include_str!("../README.md")]
#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

pub mod scenes;
pub mod error;
pub mod training_options;
pub mod metrics;
pub mod by_load;
pub mod measurements;
pub mod over_time;
pub mod verdict;
pub mod experiment;
pub mod moving;
pub mod device;
pub mod touches;
pub mod tracking;
pub mod training_set;
pub mod subject;
pub mod others;
pub mod evaluate;
pub mod sweep;
pub mod select;
pub mod worth;
pub mod table1;
pub mod run;
pub mod trade;

pub use error::{Error, Result};

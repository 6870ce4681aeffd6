//! Library of the program: what [`taxel_evaluate`] computes, and its pages.
//!
//! The `host-sim` binary is a thin shell over both.

#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

pub mod report;

pub use taxel_evaluate::{
    Error, Result, by_depth, error, evaluate, experiment, measurements, metrics, run, study,
    subject, training_set, verdict,
};

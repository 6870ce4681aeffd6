//! The host's half of Taxel: simulate, train, write the blob, evaluate, report.
//!
//! Data flows one way: [`scene`] → [`synth`] → [`dataset`] → [`train`] → [`model`] (the blob) →
//! [`evaluate`] → [`report`]. Only this crate opens files; the `host-sim` binary is a thin shell
//! over it. Inference is [`model_core`]'s, the same code that runs on the device.

pub mod columns;
pub mod data_file;
pub mod dataset;
pub mod digest;
pub mod error;
pub mod evaluate;
pub mod model;
pub mod output;
pub mod progress;
pub mod random;
pub mod run;
pub mod scene;
pub mod sensor;
pub mod synth;
pub mod train;

pub use error::{Error, Result};

//! Experiments on tactile sensors, simulated or measured, and their evaluation. Usable without the program.
//!
//! Data flows one way. An [experiment] says what to simulate and train; [`taxel_simulate`] makes frames;
//! [`taxel_learn`] trains and decodes; [`evaluate`] judges. Modules stand from the ground up; each imports only what
//! stands before it.
//!
//! ```
//! use taxel_evaluate::metrics;
//! use taxel_evaluate::experiment::Experiment;
//! use taxel_data::{progress::Silent, random::Stream};
//! use taxel_learn::Exponential;
//! use taxel_simulate::synthesise;
//!
//! let mut experiment = Experiment::load("press")?;
//! experiment.world.read_rows = vec![3]; // one row-wire: 18 readings, 18 outputs
//! experiment.training.frames = 2000;
//! experiment.training.refine = false; // stay with K-means, which is quick
//! let blob = experiment.train(&Silent)?;
//! let fresh = synthesise(&experiment.world, Stream::Test, 1000);
//! let errors = metrics::judge(&blob.prepare(Exponential::default()), &fresh, &experiment.measure());
//! assert!(errors.errors[2].rmse < 0.06, "{} mm", errors.errors[2].rmse);
//! # Ok::<(), taxel_evaluate::Error>(())
//! ```

#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

pub mod error;
pub mod metrics;
pub mod by_depth;
pub mod measurements;
pub mod over_time;
pub mod verdict;
pub mod experiment;
pub mod moving;
pub mod training_set;
pub mod subject;
pub mod others;
pub mod evaluate;
pub mod run;

pub use error::{Error, Result};

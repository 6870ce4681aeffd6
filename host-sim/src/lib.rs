//! Library of the program: experiments from scene files, their evaluation, and the report.
//!
//! Data flows one way. An [experiment] says what to simulate and train; [`taxel_simulate`] makes frames;
//! [`taxel_learn`] trains and decodes; [`evaluate`] judges; [`report`] draws. The `host-sim` binary is a
//! thin shell over this library. Modules stand from the ground up; each imports only what stands before
//! it.
//!
//! ```
//! use host_sim::metrics;
//! use host_sim::experiment::Experiment;
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
//! # Ok::<(), host_sim::Error>(())
//! ```

pub mod error;
pub mod metrics;
pub mod by_depth;
pub mod verdict;
pub mod experiment;
pub mod training_set;
pub mod measurements;
pub mod subject;
pub mod evaluate;
pub mod run;
pub mod report;

pub use error::{Error, Result};

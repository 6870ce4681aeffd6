//! The host's half of Taxel: simulate, train, write the blob, evaluate, report.
//!
//! Data flows one way: [`scene`] → [`synth`] → [`dataset`] → [`train`] → [`model`] (the blob) →
//! [`evaluate`] → [`report`]. Only this crate opens files; the `host-sim` binary is a thin shell
//! over it. Inference is [`model_core`]'s, the same code that runs on the device; the firmware's own
//! readout runs on [`virtual_hardware`].
//!
//! ```
//! use host_sim::infer::Kernel;
//! use host_sim::model::{LoadedModel, Origin, encode};
//! use host_sim::progress::Progress;
//! use host_sim::random::Stream;
//! use host_sim::scene::Scene;
//! use host_sim::synth::synthesise;
//! use host_sim::train::{Options, train};
//!
//! let mut scene = Scene::load("press")?;
//! scene.read_rows = vec![3]; // one row-wire: 18 readings, 18 outputs
//! let frames = synthesise(&scene, Stream::Training, 2000);
//! let trained = train(&frames, &Options::new(32, 0.8, true, scene.seed), &Progress::silent())?;
//! let blob = encode(&trained, &frames, &Origin::of_scene(&scene))?;
//!
//! let model = LoadedModel::from_bytes("press.bin".as_ref(), &blob)?;
//! let fresh = synthesise(&scene, Stream::Test, 1000);
//! let estimate = model.decode(Kernel::default(), &fresh.inputs);
//! let squares = fresh.outputs.values.iter().zip(&estimate.values).map(|(t, e)| (t - e).powi(2));
//! let rmse_mm = (squares.sum::<f64>() / estimate.values.len() as f64).sqrt();
//! assert!(rmse_mm < 0.05, "{rmse_mm} mm");
//! # Ok::<(), host_sim::Error>(())
//! ```

pub mod columns;
pub mod data_file;
pub mod dataset;
pub mod device;
pub mod digest;
mod elementary;
pub mod emulator;
pub mod error;
pub mod evaluate;
pub mod infer;
pub mod mailbox;
pub mod model;
pub mod number_format;
pub mod output;
pub mod progress;
pub mod random;
pub mod report;
pub mod run;
pub mod scene;
pub mod sensor;
pub mod simd;
pub mod spread;
pub mod synth;
pub mod train;
pub mod virtual_hardware;

pub use error::{Error, Result};

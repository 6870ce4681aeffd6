//! Decoders of tactile frames: trained, packed for a device, and run over tables.
//!
//! A program gives readings and outputs as a [`Dataset`](taxel_data::dataset::Dataset).
//! [`train`](train::train) makes networks of one of model-core's number formats, and [`pack`] makes the
//! weight blob that a device holds. A [`PreparedModel`] decodes like the device does, bit for bit.
//!
//! Modules stand from the ground up; each imports only what stands before it.
//!
//! ```
//! use taxel_data::{progress::Silent, random::Stream};
//! use taxel_learn::{Decoder, Exponential, Options, Origin, pack, train::train};
//! use taxel_simulate::{World, synthesise};
//!
//! let world = World { read_rows: vec![3], ..World::press() }; // one row-wire: 18 readings, 18 outputs
//! let frames = synthesise(&world, Stream::Training, 2000);
//! let trained = train(&frames, &Options { centres: 32, ..Options::default() }, &Silent)?;
//! let blob = pack(&trained, &frames, &Origin::of_data("row 4", 0, 1, &frames))?;
//! let fresh = synthesise(&world, Stream::Test, 1000);
//! let estimate = blob.prepare(Exponential::default()).decode_all(&fresh.inputs.values, 1);
//! let squared_mm2 = fresh.outputs.squared_errors(&estimate.values);
//! assert!((squared_mm2.iter().sum::<f64>() / estimate.values.len() as f64).sqrt() < 0.05);
//! # Ok::<(), taxel_learn::Error>(())
//! ```

pub mod error;
mod parallel;
pub mod decoder;
pub mod infer;
pub mod health;
pub mod relative;
pub mod outliers;
pub mod train;
pub mod packing;
pub mod export;
pub mod prepared;
pub mod filtered;
pub mod confidence;
pub mod fill;
pub mod recalibration;
pub mod faults;
pub mod decoders;
pub mod select;
pub mod cost;

pub use decoder::{Decoder, Estimates, FrameDecoder, Frames, Timing};
pub use filtered::Filtered;
pub use infer::Exponential;
pub use packing::{ModelBlob, Origin, pack};
pub use prepared::PreparedModel;
pub use taxel_data::error::{Error, Result};
pub use train::{Options, Trained};

/// The page's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/filter.md")]
struct FilterPage;

//! Decoders of tactile frames: trained, packed for a device, and run over tables.
//!
//! A program gives readings and outputs as a [`Dataset`](taxel_data::dataset::Dataset).
//! [`train`](train::train) makes networks of one of taxel-core's number formats, and [`pack`] makes the
//! weight blob that a device holds. A [`PreparedModel`] decodes like the device does, bit for bit.
//!
//! Modules stand from the ground up; each imports only what stands before it.
//!
#![doc = include_str!("../README.md")]

pub mod error;
mod parallel;
pub mod decoder;
pub mod infer;
pub mod health;
pub mod relative;
pub mod outliers;
pub mod rls;
pub mod train;
pub mod packing;
pub mod export;
pub mod prepared;
pub mod kinds;
pub mod filtered;
pub mod tracked;
pub mod reading_model;
pub mod recalibration;
pub mod faults;
pub mod decoders;
pub mod folds;
pub mod cost;

pub use decoder::{Decoder, Estimates, FrameDecoder, Frames, Timing};
pub use filtered::Filtered;
pub use packing::{ModelBlob, Origin, pack};
pub use prepared::PreparedModel;
pub use taxel_data::error::{Error, Result};
pub use tracked::Tracked;
pub use train::{Options, Trained};

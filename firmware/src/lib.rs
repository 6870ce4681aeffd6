//! What a board runs, as a library that is tested on the host.
//!
//! Keeps a model in force and decodes frames with it. [`store`] finds the model's blob in flash,
//! [`Tactile`] holds it, decodes with it, and exchanges it for another without ever being left with
//! none. [`readout`] scans the frames over embedded-hal, [`circuit`] turns counts into Ω, and
//! [`timing`] tells how long that takes. Nothing here allocates, panics or waits without bound; the
//! weights stay in flash.
//!
//! All arithmetic is [`model_core`]'s, so that board and host agree bit for bit.
#![cfg_attr(not(test), no_std)]

pub mod circuit;
pub mod readout;
pub mod store;
mod tactile;
pub mod timing;

pub use tactile::{PaperSensor, Tactile};

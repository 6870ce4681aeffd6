//! What a board runs, as a library that is tested on the host.
//!
//! One purpose so far: keep a model in force and decode frames with it. [`store`] finds the
//! model's blob in flash, [`Tactile`] holds it, decodes with it, and exchanges it for another
//! without ever being left with none. Nothing here allocates, waits or panics; the weights stay
//! in flash.
//!
//! All arithmetic is [`model_core`]'s, so that board and host agree bit for bit.
#![cfg_attr(not(test), no_std)]

pub mod store;
mod tactile;

pub use tactile::{PaperSensor, Tactile};

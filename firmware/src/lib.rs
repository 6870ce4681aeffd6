//! What a board runs, as a library that is tested on the host.
//!
//! [`readout`] scans frames over embedded-hal, with [`circuit`] to turn counts into Ω and [`timing`] to tell
//! how long that takes; [`Tactile`] decodes them with the model in force; [`store`] keeps models in
//! two slots of flash; [`link`] carries messages to and from the host; and [`App`](app::App) is the loop
//! that joins them. A board gives what [`platform`] asks for. Nothing here allocates, panics or waits
//! without bound; the weights stay in flash.
//!
//! All arithmetic is [`model_core`]'s, so that board and host agree bit for bit.
#![cfg_attr(not(test), no_std)]

// From the ground up: a module imports only what is declared before it.
mod log;
pub mod circuit;
pub mod readout;
pub mod link;
pub mod timing;
pub mod platform;
pub mod remote;
pub mod store;
mod tactile;
pub mod app;

pub use tactile::{PaperSensor, Tactile};

//! The program of a board, as a library that is tested on the host.
//!
//! [`readout`] scans frames over embedded-hal; [`circuit`] converts counts to Ω, and [`timing`] computes how long
//! a scan takes. [`store`] keeps models in two slots of flash, and in a journal what else survives a restart. [`link`] carries messages
//! to and from the host. [`App`](app::App) is the loop that joins them and decodes with the model in force. A board implements
//! [`platform`]; [`capacity`] says how large a sensor and a model it has room for. Nothing here allocates, panics or
//! waits without bound.
//!
//! All arithmetic is [`taxel_core`]'s, so that board and host agree bit for bit.
//!
#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), no_std)]

// From the ground up: a module imports only what is declared before it.
mod log;
pub mod circuit;
pub mod readout;
pub mod link;
pub mod capacity;
pub mod timing;
pub mod store;
pub mod platform;
pub mod app;

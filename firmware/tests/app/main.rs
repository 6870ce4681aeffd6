//! The application loop on a virtual board.

#[path = "../common/mod.rs"]
mod common;

mod requests;

mod baseline;
mod confidence;
mod configuration;
mod decoding;
mod model;
mod turns;

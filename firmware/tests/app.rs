//! The application loop on a virtual board.

mod background;
mod baseline;
mod confidence;
mod configuration;
mod decoding;
mod events;
mod filter;
mod model;
mod track;
mod turns;

//! Every integration test in one program: it is linked once.

mod common;
#[path = "../../proof/extremes.rs"]
mod table;

mod blob_format;
mod clamp;
mod confidence;
mod decoder;
mod extremes;
mod fill;
mod fixed;
mod projection;
mod touch;
mod sections;

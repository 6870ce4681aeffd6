//! Every integration test in one program: it is linked once.

mod common;
#[path = "../../proof/extremes.rs"]
mod table;

mod blob_format;
mod clamp;
mod decoder;
mod extremes;
mod fixed;
mod projection;
mod reading_model;
mod touch;
mod sections;

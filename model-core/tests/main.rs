//! Every integration test in one program: it is linked once.

mod common;

mod blob_format;
mod clamp;
mod confidence;
mod decoder;
mod fill;
mod fixed;
mod projection;
mod sections;

//! Every integration test in one program: it is linked once.

#[path = "../../../../proof/extremes.rs"]
mod table;

mod cost;
mod number_formats;
mod random_models;
mod extremes;

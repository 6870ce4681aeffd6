//! Every integration test in one program: it is linked once.

#[path = "../../../../proof/extremes.rs"]
mod table;

mod extremes;

//! Every integration test in one program: it is linked once.

mod cost;
mod blob;
mod number_formats;
mod relative;

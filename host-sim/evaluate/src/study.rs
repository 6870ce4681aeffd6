//! Studies: one question each, put to the test by computing.

pub mod widths;
pub mod map;

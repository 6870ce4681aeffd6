//! What each study computes.

pub mod equations;
pub mod directions;
pub mod widths;
pub mod map;
pub mod recursion;
pub mod drift;
pub mod rubber;
pub mod readout;
pub mod confidence;
pub mod rate;

//! Studies of one question each: what the command `study` computes.

mod level;
pub mod equations;
pub mod directions;
pub mod widths;
pub mod map;
pub mod recursion;

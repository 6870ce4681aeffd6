//! Sweeps: many scenes, or many settings of training on the same measurements, each a point that any machine may compute.
//!
//! A [`plan::Plan`] says which points there are. [`work`] computes some of them, [`store`] keeps each in a file of its own,
//! and [`merge`] reads all of them again. What comes out does not depend on who computed which point.

pub mod axis;
pub mod fields;
pub mod bounds;
pub mod file;
pub mod on_device;
pub mod plan;
pub mod layouts;
pub mod point;
pub mod judged;
pub mod judge;
pub mod store;
pub mod work;
pub mod shard;
pub mod effects;
pub mod front;
pub mod merge;

pub use merge::Merged;
pub use plan::{Plan, Point};
pub use shard::Shard;
pub use store::{Found, Record, Store};

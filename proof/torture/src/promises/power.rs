//! Power that is cut at every operation of the flash, and again while the device recovers: always the old or the new
//! model is in force.

mod flash;
mod device;

mod cuts;
mod decay;
mod provision;
mod settings;

pub use cuts::{UNDO, UPLOAD};
pub use decay::{DECAY, WORN};
pub use provision::PROVISION;
pub use settings::SETTINGS;

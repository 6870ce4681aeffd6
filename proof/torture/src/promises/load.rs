//! Load: the application's loop for very many frames of simulated time.

mod frames;
mod link;
mod watchdog;

pub use frames::FRAMES;
pub use link::LINK;
pub use watchdog::WATCHDOG;

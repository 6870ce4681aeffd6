//! What a device goes through when its power is cut at every operation of its flash, and again while it recovers, when its
//! flash decays, or when it is attacked: one case for each seed. Tests take a few seeds, torture takes many.

mod cuts;
mod decay;
#[cfg(target_os = "linux")]
mod recheck;
mod seal;

pub use cuts::{Job, cut};
pub use decay::{abort_and_decay, upload_to_worn};
#[cfg(target_os = "linux")]
pub use recheck::flip_model;
pub use seal::{KINDS, forge};

/// Cuts of one case.
#[derive(Debug, Clone, Copy)]
pub struct Cuts {
    pub count: u64,
    /// Number of first cuts in each quarter of the work.
    pub quarters: [u64; 4],
}

/// Words of a slot.
const SLOT_WORDS: usize = 192;

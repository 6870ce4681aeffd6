//! What a device goes through when its power is cut at every operation of its flash, and again while it recovers: one case
//! for each seed.

mod cuts;

pub use cuts::{Job, cut};

/// Cuts of one case.
#[derive(Debug, Clone, Copy)]
pub struct Cuts {
    pub count: u64,
    /// Number of first cuts in each quarter of the work.
    pub quarters: [u64; 4],
}

/// Words of a slot.
const SLOT_WORDS: usize = 192;

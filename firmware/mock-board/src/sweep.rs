//! What a device goes through when its power is cut at every operation of its flash, and again while it recovers, when its
//! flash decays, or when it is attacked: one case for each seed. Tests take a few seeds, torture takes many.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::device::Device;
use crate::flash::{Flash, Supply, Torn};

mod decay;
mod key;
mod models;
#[cfg(target_os = "linux")]
mod recheck;
mod seal;
mod settings;

pub use decay::{abort_and_decay, upload_to_worn};
pub use key::cut_key;
pub use models::{Job, cut_model};
#[cfg(target_os = "linux")]
pub use recheck::flip_model;
pub use seal::{KINDS, forge};
pub use settings::cut_settings;

/// Cuts of one case.
#[derive(Debug, Clone, Copy)]
pub struct Cuts {
    pub count: u64,
    /// Where in the work the power is cut first: 0 in its first quarter, 3 in its last one.
    pub quarter: usize,
}

/// Draws the operation, of so many, in which the power is cut first; and its quarter.
fn first_cut(seed: u64, operations: u64) -> (u64, usize) {
    let first = Xoshiro256PlusPlus::seed_from_u64(seed).next_u64() % operations;
    (first, (4 * first / operations) as usize)
}

/// Words of a slot.
const SLOT_WORDS: usize = 192;

/// A device with erased slots, and power whose cuts are of the kind `torn` and draw from `seed`.
fn device(seed: u64, torn: Torn) -> Device {
    let supply = Supply::new(seed);
    Device::new([0, 1].map(|_| Flash::erased(SLOT_WORDS, &supply, torn)))
}

//! What a device goes through when its power is cut at every operation of its flash, and again while it recovers, when its
//! flash decays, or when it is attacked: one case for each seed. Tests take a few seeds, torture takes many.

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

/// Words of a slot.
const SLOT_WORDS: usize = 192;

/// A device with erased slots, and power whose cuts are of the kind `torn` and draw from `seed`.
fn device(seed: u64, torn: Torn) -> Device {
    let supply = Supply::new(seed);
    Device::new([0, 1].map(|_| Flash::erased(SLOT_WORDS, &supply, torn)))
}

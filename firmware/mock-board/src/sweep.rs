//! What a device goes through when its power is cut at every operation of its flash, and again while it recovers, when its
//! flash decays, or when it is attacked: one case for each seed. Tests take a few seeds, torture takes many.

mod device;
pub mod presses;
mod models;
mod key;
mod settings;
mod decay;
#[cfg(target_os = "linux")]
mod recheck;
mod seal;

pub use decay::{abort_and_decay, upload_to_worn};
pub use device::{Device, Outcome, SLOT_WORDS, upload_step};
pub use key::cut_key;
pub use models::{Job, cut_model};
#[cfg(target_os = "linux")]
pub use recheck::flip_model;
pub use seal::{KINDS, forge};
pub use settings::cut_settings;

//! Settings that survive a restart: configuration, constants of the circuit, and baseline.
//!
//! [`Keeper`] is what the application needs of a memory. [`SettingPages`] is one in two pages of flash.

use crate::link::message::Setting;

mod pages;

pub use pages::{PAGE_BYTES, SettingPages};

/// Why a setting was not kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeepError {
    /// It is too large for the memory.
    TooLarge,
    /// The memory could not be erased or written.
    Failed,
}

/// Memory that keeps settings while the power is off.
///
/// It may be cut off from power at any moment: then the setting that is being kept is the old or the new one.
pub trait Keeper {
    /// Recovers from a cut of the power: every later start reads what this one reads. Must be called at each
    /// start, before anything is read. Writes nothing if there was no cut. May take a second.
    ///
    /// # Errors
    /// [`KeepError::Failed`]; what is kept can still be read.
    fn recover(&mut self) -> Result<(), KeepError>;

    /// Reads the bytes that are kept for `setting` into `buffer`; `None` if there are none, or more than it has room for.
    fn read<'b>(&mut self, setting: Setting, buffer: &'b mut [u8]) -> Option<&'b [u8]>;

    /// Keeps `parts`, joined, for `setting`; no parts at all forget it. Nothing is written if these bytes are kept
    /// already. Returns whether something was written. May take a second.
    ///
    /// # Errors
    /// Every variant of [`KeepError`]; what was kept before is still kept, or `parts` are.
    fn keep(&mut self, setting: Setting, parts: &[&[u8]]) -> Result<bool, KeepError>;
}

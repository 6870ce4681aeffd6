//! What survives a restart. Two model slots in flash: one holds the model in force, the other is spare. And a
//! [`Journal`], which tells all else.
//!
//! A slot holds a blob at its start, and nothing else. Which models were confirmed, and which of them is in force,
//! [`ConfirmedModels`] tells.

use taxel_core::blob::Model;

mod journal;
mod confirmed;

pub use confirmed::ConfirmedModels;
pub use journal::{Journal, KeepError, Kind, PAGE_BYTES};

/// Error of a flash that could not be erased or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashError;

/// A region of flash that is erased as a whole and read in place: a model slot, or a page of the journal.
///
/// There are two slots, and the borrow checker keeps them apart: a decoder borrows the slot of its model
/// while the other is written.
pub trait Slot {
    /// Mean time in s between erases that the medium endures for years; 0 if it does not wear. The first
    /// [`ERASES_AT_ONCE`] erases after the start need not wait.
    fn erase_interval_s(&self) -> u32 {
        600
    }

    /// All bytes of the slot, at an address that is a multiple of four.
    fn bytes(&self) -> &[u8];

    /// Sets every byte to 0xFF, the last word last. May take seconds.
    ///
    /// # Errors
    /// [`FlashError`]: the flash could not be erased.
    fn erase(&mut self) -> Result<(), FlashError>;

    /// Writes `bytes` from `offset` on, where the slot must be erased; zeros can be written over anything. Offset and
    /// length must be multiples of four.
    ///
    /// # Errors
    /// [`FlashError`]: the flash could not be written, or holds other bytes afterwards.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError>;
}

/// The blob at the start of `slot`, without the bytes behind it.
///
/// A flash slot is a whole number of erase units, and so larger than its blob; the rest is erased (0xFF) or left
/// from an older blob. Only the first bytes are checked. A slot that does not start with a blob, or is shorter
/// than it, is returned whole, so that the error of loading it names the cause.
///
/// ```
/// use taxel_firmware::store::blob_in_slot;
/// # let mut slot = [0xFF_u8; 64];
/// # slot[..5].copy_from_slice(b"TAXL\x03");
/// # slot[5..9].copy_from_slice(&40_u32.to_le_bytes());
/// // A slot of 64 bytes, whose blob says that it is 40 bytes long.
/// assert_eq!(blob_in_slot(&slot).len(), 40);
/// assert_eq!(blob_in_slot(&[0xFF; 64]).len(), 64); // erased: nothing to find
/// ```
pub fn blob_in_slot(slot: &[u8]) -> &[u8] {
    Model::declared_length(slot).and_then(|length| slot.get(..length)).unwrap_or(slot)
}

/// Number of erases after the start that need not wait for each other.
pub const ERASES_AT_ONCE: u32 = 100;

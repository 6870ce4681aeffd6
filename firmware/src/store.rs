//! Where models lie in flash: two slots, one in force and one to spare.
//!
//! A slot holds a blob at its start and, once the blob has been found sound, a record of 16 bytes at its
//! end. The record is written last and in one go: whatever is interrupted before leaves a slot that
//! is not chosen.

use model_core::blob::Model;
use model_core::checksum::CRC_32;

mod upload;

pub use upload::Upload;

/// The flash could not be erased or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashError;

/// A region of flash that is erased as a whole and read where it lies.
///
/// There are two, and the borrow checker keeps them apart: a sensor borrows the slot of its model
/// while the other is written.
pub trait Slot {
    /// All bytes of the slot, at an address that is a multiple of four.
    fn bytes(&self) -> &[u8];

    /// Makes every byte 0xFF. May take seconds.
    ///
    /// # Errors
    /// [`FlashError`].
    fn erase(&mut self) -> Result<(), FlashError>;

    /// Writes `bytes` from `offset` on, where the slot is erased. Both are multiples of four.
    ///
    /// # Errors
    /// [`FlashError`]: also if what is read back differs.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError>;
}

/// The blob at the start of `slot`, without what lies behind it.
///
/// A flash slot is a whole number of erase units and so larger than the blob that was written to
/// it; the rest is erased (0xFF) or left from an older blob. Nothing is checked but the opening
/// bytes: a slot that does not start with a blob, or ends before it does, is returned whole, so
/// that loading it tells the cause.
///
/// ```
/// use firmware::store::blob_in_slot;
/// # let mut slot = [0xFF_u8; 64];
/// # slot[..5].copy_from_slice(b"TAXL\x01");
/// # slot[5..9].copy_from_slice(&40_u32.to_le_bytes());
/// // A slot of 64 bytes, whose blob says that it is 40 bytes long.
/// assert_eq!(blob_in_slot(&slot).len(), 40);
/// assert_eq!(blob_in_slot(&[0xFF; 64]).len(), 64); // erased: nothing to find
/// ```
#[must_use]
pub fn blob_in_slot(slot: &[u8]) -> &[u8] {
    Model::declared_length(slot).and_then(|length| slot.get(..length)).unwrap_or(slot)
}

/// Bytes of the record at a slot's end.
pub const RECORD_BYTES: usize = 16;

/// Opens a record.
const RECORD_MAGIC: [u8; 4] = *b"SLOT";

/// Bytes of blob that a slot holds.
#[must_use]
pub fn capacity(slot: &[u8]) -> usize {
    slot.len().saturating_sub(RECORD_BYTES)
}

/// The record that commits a blob: magic, generation, the blob's CRC-32, and the CRC-32 of these
/// twelve bytes.
fn record(generation: u32, blob_crc: u32) -> [u8; RECORD_BYTES] {
    let mut record = [0; RECORD_BYTES];
    let fields = [RECORD_MAGIC, generation.to_le_bytes(), blob_crc.to_le_bytes()];
    let (covered, crc) = record.split_at_mut(RECORD_BYTES - 4);
    covered.copy_from_slice(fields.as_flattened());
    crc.copy_from_slice(&CRC_32.checksum(covered).to_le_bytes());
    record
}

/// How recent the model in `slot` number `index` is; `None` if there is none to be believed.
///
/// An uploaded model counts from 1. Slot 0 may also hold a model without a record, put there together
/// with the firmware: that is generation 0. Slot 1 is only ever uploaded to.
#[must_use]
pub fn generation(index: usize, slot: &[u8]) -> Option<u32> {
    let (_, found) = slot.split_last_chunk::<RECORD_BYTES>()?;
    let [_, generation, ..] = found.as_chunks::<4>().0 else { return None };
    let generation = u32::from_le_bytes(*generation);
    let (_, blob_crc) = blob_in_slot(slot).split_last_chunk::<4>()?;
    if *found == record(generation, u32::from_le_bytes(*blob_crc)) {
        Some(generation)
    } else {
        (index == 0).then_some(0)
    }
}

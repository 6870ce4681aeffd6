//! Where models lie in flash.

use model_core::blob::Model;

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

//! Model slots in flash: one holds the model in force, the other is spare.
//!
//! A slot holds a blob at its start and, once the blob has been found sound, a record of 16 bytes at its end. The
//! record's first word is written when an upload begins, and the others last and in one go: a slot whose upload was
//! interrupted or aborted is not chosen.
//!
//! With a key on the device, a seal stands behind the blob ([`DeviceKey`], [`Seal`]).
//!
//! To put the previous model in force again, another record with a higher generation is written before those of its
//! slot ([`reinstate`]). Every start makes firm which model is in force ([`missing_records`]).

use core::iter;

use model_core::blob::Model;
use model_core::checksum::CRC_32;

use crate::seal::Seal;

mod key;
mod firm;
mod upload;

pub use firm::missing_records;
pub use key::DeviceKey;
pub use upload::Upload;

/// Error of a flash that could not be erased or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashError;

/// A region of flash that is erased as a whole and read in place.
///
/// There are two, and the borrow checker keeps them apart: a decoder borrows the slot of its model
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

    /// Writes `bytes` from `offset` on, where the slot must be erased. Offset and length must be multiples of
    /// four.
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
/// use firmware::store::blob_in_slot;
/// # let mut slot = [0xFF_u8; 64];
/// # slot[..5].copy_from_slice(b"TAXL\x01");
/// # slot[5..9].copy_from_slice(&40_u32.to_le_bytes());
/// // A slot of 64 bytes, whose blob says that it is 40 bytes long.
/// assert_eq!(blob_in_slot(&slot).len(), 40);
/// assert_eq!(blob_in_slot(&[0xFF; 64]).len(), 64); // erased: nothing to find
/// ```
pub fn blob_in_slot(slot: &[u8]) -> &[u8] {
    Model::declared_length(slot).and_then(|length| slot.get(..length)).unwrap_or(slot)
}

/// Length in bytes of the record at a slot's end.
pub const RECORD_BYTES: usize = 16;

/// First word of a record. Without the others it tells that an upload has begun.
const RECORD_MAGIC: [u8; 4] = *b"SLOT";

/// Number of erases after the start that need not wait for each other.
pub const ERASES_AT_ONCE: u32 = 100;

/// Length in bytes of a seal behind a blob: mark, version, tag.
pub const SEAL_BYTES: usize = 40;

/// First word of a seal.
const SEAL_MARK: [u8; 4] = *b"SEAL";

/// Largest blob that a slot holds, in bytes; with a seal, [`SEAL_BYTES`] less. The first record stands behind it.
pub fn capacity(slot: &[u8]) -> usize {
    slot.len().saturating_sub(RECORD_BYTES)
}

/// Place of the seal in a slot: the first word behind its blob.
fn seal_place(slot: &[u8]) -> usize {
    blob_in_slot(slot).len().saturating_add(3) & !3
}

/// The seal behind the blob in `slot`, right or wrong.
pub fn seal_in_slot(slot: &[u8]) -> Option<Seal> {
    let rest = slot.get(seal_place(slot)..)?.strip_prefix(&SEAL_MARK)?;
    let (version, rest) = rest.split_first_chunk()?;
    Some(Seal { version: u32::from_le_bytes(*version), tag: *rest.first_chunk()? })
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

/// Number of records that a slot has room for behind its blob, at most: a pair for each time that its model comes into
/// force.
pub const MOST_RECORDS: usize = 16;

/// Places of the records in a slot, if its blob leaves room for them: the first is at the end.
fn record_places(slot: &[u8]) -> impl Iterator<Item = usize> {
    let seal = if seal_in_slot(slot).is_some() { SEAL_BYTES } else { 0 };
    let (length, content) = (slot.len(), seal_place(slot).saturating_add(seal));
    let places = (1..=MOST_RECORDS).map(move |number| length.checked_sub(number * RECORD_BYTES));
    places.map_while(move |place| place.filter(|place| *place >= content))
}

/// Places of the pairs of records in a slot: the first record of a pair stands behind the second one.
fn record_pairs(slot: &[u8]) -> impl Iterator<Item = [usize; 2]> {
    let mut places = record_places(slot);
    iter::from_fn(move || Some([places.next()?, places.next()?]))
}

fn record_at(slot: &[u8], place: usize) -> Option<&[u8; RECORD_BYTES]> {
    slot.get(place..)?.first_chunk()
}

/// A record that is whole but for its last word at most.
struct Record {
    generation: u32,
    /// Whether its last word fits at this start.
    is_sound: bool,
}

impl Record {
    /// The record of the blob in `slot` at this place.
    fn of(slot: &[u8], place: usize) -> Option<Self> {
        let found = record_at(slot, place)?;
        let [_, generation, ..] = found.as_chunks::<4>().0 else { return None };
        let generation = u32::from_le_bytes(*generation);
        let blob_crc = blob_in_slot(slot).last_chunk::<4>()?;
        let right = record(generation, u32::from_le_bytes(*blob_crc));
        let is_whole = found.get(..RECORD_BYTES - 4) == right.get(..RECORD_BYTES - 4);
        is_whole.then_some(Self { generation, is_sound: *found == right })
    }
}

/// Writes another pair of records for the model in `slot`, which must have been found sound: it comes into force again
/// as `generation`. Power that fails in the first record leaves the other slot's model in force.
///
/// # Errors
/// `None` if no place for a pair is left; [`FlashError`] if writing the first record fails.
pub fn reinstate<S: Slot>(slot: &mut S, generation: u32) -> Option<Result<(), FlashError>> {
    let bytes = slot.bytes();
    let is_empty = |place: &usize| record_at(bytes, *place) == Some(&[0xFF; RECORD_BYTES]);
    // The first record's place is erased in a slot that was flashed with the firmware, and stays so.
    let [first, second] = record_pairs(bytes).skip(1).find(|pair| pair.iter().all(is_empty))?;
    let (_, blob_crc) = blob_in_slot(bytes).split_last_chunk::<4>()?;
    let record = record(generation, u32::from_le_bytes(*blob_crc));
    let written = slot.write(first, &record);
    if written.is_ok() {
        // The first one counts without it: the next start writes another pair.
        let _ = slot.write(second, &record);
    }
    Some(written)
}

/// Generation of the model in `slot` number `index`: the larger, the more recent; `None` without a valid model.
///
/// Uploaded models count from 1. Slot 0 may also hold a model whose record is erased, flashed together with the
/// firmware: its generation is 0. Slot 1 holds only uploaded models.
pub fn generation(index: usize, slot: &[u8]) -> Option<u32> {
    let records = record_places(slot).filter_map(|place| Record::of(slot, place));
    let newest = records.filter(|found| found.is_sound).map(|found| found.generation).max();
    let flashed = || {
        let (_, first) = slot.split_last_chunk::<RECORD_BYTES>()?;
        (index == 0 && *first == [0xFF; RECORD_BYTES]).then_some(0)
    };
    newest.or_else(flashed)
}

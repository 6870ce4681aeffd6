//! Records at a slot's end, which tell the most recent model.
//!
//! Power that fails while a record's last word is written may leave a weak bit in it, which reads as 0 or 1 anew at every
//! start: the record is sound at one start, and not at another. Two rules keep the choice of one start for all that
//! follow:
//!
//! - Records are written in pairs, one after the other. Where the second one has begun, the first one is whole for
//!   good. The model in force has such a pair of its generation.
//! - Where the other slot has a record that is whole but for its last word, the model in force has a higher generation.

use core::iter;

use model_core::checksum::CRC_32;

use super::{FlashError, SEAL_BYTES, Slot, blob_in_slot, seal_in_slot, seal_place};

/// Length in bytes of the record at a slot's end.
pub const RECORD_BYTES: usize = 16;

/// First word of a record. Without the others it tells that an upload has begun.
pub(super) const RECORD_MAGIC: [u8; 4] = *b"SLOT";

/// The record that commits a blob: magic, generation, the blob's CRC-32, and the CRC-32 of these
/// twelve bytes.
pub(super) fn record(generation: u32, blob_crc: u32) -> [u8; RECORD_BYTES] {
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
pub(super) fn record_pairs(slot: &[u8]) -> impl Iterator<Item = [usize; 2]> {
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
    fn new(slot: &[u8], place: usize) -> Option<Self> {
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
    let records = record_places(slot).filter_map(|place| Record::new(slot, place));
    let newest = records.filter(|found| found.is_sound).map(|found| found.generation).max();
    let flashed = || {
        let (_, first) = slot.split_last_chunk::<RECORD_BYTES>()?;
        (index == 0 && *first == [0xFF; RECORD_BYTES]).then_some(0)
    };
    newest.or_else(flashed)
}

/// Generation of the records that the model in slot number `in_force` still needs, to be written by
/// [`reinstate`](super::reinstate); `None` if it needs none.
pub fn missing_records<S: Slot>(slots: &[S; 2], in_force: usize) -> Option<u32> {
    let [first, second] = slots;
    let (chosen, other) = if in_force == 0 { (first, second) } else { (second, first) };
    let (chosen, other) = (chosen.bytes(), other.bytes());
    let generation = generation(in_force, chosen)?;
    let records = record_places(other).filter_map(|place| Record::new(other, place));
    let doubtful = records.filter(|found| !found.is_sound).map(|found| found.generation).max();
    if let Some(doubtful) = doubtful.filter(|doubtful| *doubtful >= generation) {
        return doubtful.checked_add(1);
    }
    let is_firm = record_pairs(chosen).any(|[first, second]| {
        let is_newest = |found: Record| found.is_sound && found.generation == generation;
        Record::new(chosen, first).is_some_and(is_newest)
            && record_at(chosen, second) != Some(&[0xFF; RECORD_BYTES])
    });
    // A model that was flashed with the firmware has no record.
    (!is_firm && generation > 0).then_some(generation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_right_behind_its_blob_counts() {
        for (room, expected) in [(RECORD_BYTES, Some(7)), (RECORD_BYTES - 4, None)] {
            let mut slot = vec![0xFF; 40 + room];
            slot[..5].copy_from_slice(b"TAXL\x01");
            slot[5..9].copy_from_slice(&40_u32.to_le_bytes());
            let place = slot.len() - RECORD_BYTES;
            slot[place..].copy_from_slice(&record(7, u32::MAX));
            assert_eq!(generation(1, &slot), expected);
        }
    }
}

//! Making firm which model is in force, after power that failed while a record's last word was written.
//!
//! Such a word may hold a weak bit, which reads as 0 or 1 anew at every start: the record is sound at one start, and not
//! at another. Two rules keep the choice of one start for all that follow:
//!
//! - The model in force has two records of its generation.
//! - Where the other slot has a record that is whole but for its last word, the model in force has a higher generation.

use super::{RECORD_BYTES, Slot, blob_in_slot, generation, record, record_at, record_places};

/// Generation of the record that the model in slot number `in_force` still needs, to be written by
/// [`reinstate`](super::reinstate); `None` if its choice is firm.
#[must_use]
pub fn unsettled<S: Slot>(slots: &[S; 2], in_force: usize) -> Option<u32> {
    let [first, second] = slots;
    let (chosen, other) = if in_force == 0 { (first, second) } else { (second, first) };
    let generation = generation(in_force, chosen.bytes())?;
    let doubtful = records(other.bytes()).filter(|found| !found.is_sound);
    let newest_doubtful = doubtful.map(|found| found.generation).max();
    if let Some(doubtful) = newest_doubtful.filter(|doubtful| *doubtful >= generation) {
        return doubtful.checked_add(1);
    }
    let is_newest = |found: &Record| found.is_sound && found.generation == generation;
    (records(chosen.bytes()).filter(is_newest).count() == 1).then_some(generation)
}

/// A record that is whole but for its last word at most.
struct Record {
    generation: u32,
    /// Whether its last word fits at this start.
    is_sound: bool,
}

/// The records of the blob in `slot`.
fn records(slot: &[u8]) -> impl Iterator<Item = Record> {
    let blob_crc = blob_in_slot(slot).last_chunk::<4>();
    let places = record_places(slot).filter_map(|place| record_at(slot, place));
    places.filter_map(move |found| {
        let [_, generation, ..] = found.as_chunks::<4>().0 else { return None };
        let generation = u32::from_le_bytes(*generation);
        let right = record(generation, u32::from_le_bytes(*blob_crc?));
        let is_whole = found.get(..RECORD_BYTES - 4) == right.get(..RECORD_BYTES - 4);
        is_whole.then_some(Record { generation, is_sound: *found == right })
    })
}

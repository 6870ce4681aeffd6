//! Making firm which model is in force, after power that failed while a record's last word was written.
//!
//! Such a word may hold a weak bit, which reads as 0 or 1 anew at every start: the record is sound at one start, and not
//! at another. Two rules keep the choice of one start for all that follow:
//!
//! - Records are written in pairs, one after the other. Where the second one has begun, the first one is whole for
//!   good. The model in force has such a pair of its generation.
//! - Where the other slot has a record that is whole but for its last word, the model in force has a higher generation.

use super::{RECORD_BYTES, Record, Slot, generation, record_at, record_pairs, record_places};

/// Generation of the records that the model in slot number `in_force` still needs, to be written by
/// [`reinstate`](super::reinstate); `None` if its choice is firm.
pub fn missing_records<S: Slot>(slots: &[S; 2], in_force: usize) -> Option<u32> {
    let [first, second] = slots;
    let (chosen, other) = if in_force == 0 { (first, second) } else { (second, first) };
    let (chosen, other) = (chosen.bytes(), other.bytes());
    let generation = generation(in_force, chosen)?;
    let records = record_places(other).filter_map(|place| Record::of(other, place));
    let doubtful = records.filter(|found| !found.is_sound).map(|found| found.generation).max();
    if let Some(doubtful) = doubtful.filter(|doubtful| *doubtful >= generation) {
        return doubtful.checked_add(1);
    }
    let is_firm = record_pairs(chosen).any(|[first, second]| {
        let is_newest = |found: Record| found.is_sound && found.generation == generation;
        Record::of(chosen, first).is_some_and(is_newest)
            && record_at(chosen, second) != Some(&[0xFF; RECORD_BYTES])
    });
    // A model that was flashed with the firmware has no record.
    (!is_firm && generation > 0).then_some(generation)
}

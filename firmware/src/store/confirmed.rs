//! Which models were confirmed, and which of them is in force.

use super::journal::{Journal, KeepError, Kind};
use super::{Slot, blob_in_slot};

/// Models that were confirmed, and the one in force, as the journal keeps them.
///
/// A blob in a slot counts if its CRC-32 is the one here: an upload that was not confirmed never comes into force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfirmedModels {
    /// Number of times that a model came into force for good; 0 for one that was flashed with the firmware.
    pub generation: u32,
    /// Slot of the model in force.
    pub in_force: usize,
    /// CRC-32 of the model that was confirmed in each slot.
    pub crcs: [Option<u32>; 2],
}

impl ConfirmedModels {
    /// No model at all.
    pub const NONE: Self = Self { generation: 0, in_force: 0, crcs: [None; 2] };

    /// Reads the confirmed models. As long as no upload has begun, a model in slot 0 counts, flashed together with the
    /// firmware.
    pub fn read<P: Slot, S: Slot>(journal: &Journal<P>, slots: &[S; 2]) -> Self {
        match journal.read(Kind::Models) {
            Some(content) => Self::decode(content).unwrap_or(Self::NONE),
            None => Self { crcs: [crc_in_slot(slots[0].bytes()), None], ..Self::NONE },
        }
    }

    fn decode(content: &[u8]) -> Option<Self> {
        let [generation, flags, crcs @ ..] = content.as_chunks::<4>().0 else { return None };
        let [in_force, first, second] = [1, 2, 4].map(|bit| flags[0] & bit != 0);
        let crcs: &[[u8; 4]; 2] = crcs.try_into().ok()?;
        let [one, other] = crcs.map(u32::from_le_bytes);
        Some(Self {
            generation: u32::from_le_bytes(*generation),
            in_force: usize::from(in_force),
            crcs: [first.then_some(one), second.then_some(other)],
        })
    }

    /// Confirmed models after a change: the model in this `slot` is in force, and their CRCs are `crcs`.
    #[must_use]
    pub fn exchanged(&self, slot: usize, crcs: [Option<u32>; 2]) -> Self {
        Self { generation: self.generation.wrapping_add(1), in_force: slot, crcs }
    }

    /// Keeps the confirmed models: they hold from now on, and over restarts. Returns whether something was written.
    ///
    /// # Errors
    /// Every variant of [`KeepError`]; the old or the new ones are kept.
    pub fn keep<P: Slot>(&self, journal: &mut Journal<P>) -> Result<bool, KeepError> {
        let [first, second] = self.crcs;
        let flags = [self.in_force == 1, first.is_some(), second.is_some()];
        let flags = flags.iter().zip([1, 2, 4]).map(|(is_set, bit)| u32::from(*is_set) * bit).sum();
        let words = [self.generation, flags, first.unwrap_or(0), second.unwrap_or(0)];
        let bytes = words.map(u32::to_le_bytes);
        journal.keep(Kind::Models, &[bytes.as_flattened()])
    }

    /// Whether the model in `bytes`, the content of this `slot`, was confirmed.
    pub fn has(&self, slot: usize, bytes: &[u8]) -> bool {
        let confirmed = self.crcs.get(slot).copied().flatten();
        confirmed.is_some() && confirmed == crc_in_slot(bytes)
    }
}

/// CRC-32 at the end of the blob in a slot.
fn crc_in_slot(bytes: &[u8]) -> Option<u32> {
    blob_in_slot(bytes).last_chunk().map(|crc| u32::from_le_bytes(*crc))
}

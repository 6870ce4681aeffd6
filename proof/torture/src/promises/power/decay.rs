//! Slots that decay or wear out, after an upload that ended in any way.

use firmware::link::message::UploadStep;
use firmware::store::RECORD_BYTES;
use mock_board::{blob, crc_of};
use model_core::AlignedBytes;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::device::{Device, Outcome, SLOT_WORDS, upload_step};
use super::flash::{Torn, Worn};
use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::Tally;
use crate::tools::Tools;

pub const DECAY: Promise = Promise {
    name: "abort-decay",
    text: "the slot decays: no aborted upload takes over",
    share: 2,
    check: decay,
};

pub const WORN: Promise = Promise {
    name: "worn-words",
    text: "an upload to worn flash: in force, or refused",
    share: 2,
    check: worn,
};

const LEAST: u64 = 4000;
const MOST: u64 = 1 << 40;

/// A device with an uploaded or flashed model in force, and what its flash went through.
struct Case {
    random: Xoshiro256PlusPlus,
    device: Device,
    torn: Torn,
    old: AlignedBytes,
    new: AlignedBytes,
}

impl Case {
    fn new(seed: u64) -> Result<Self, String> {
        let torn = Torn::ALL[(seed % 4) as usize]; // all but weak bits
        let mut device = Device::new(seed, torn);
        let uploads = seed / 4 % 4;
        let (old, earlier) = (blob(1, 2), blob(5, 1));
        device.slots[0].flash(if uploads == 0 { &old } else { &earlier });
        for upload in 1..=uploads {
            let blob = if upload == uploads { &old } else { &earlier };
            let outcome = device.upload(blob, usize::MAX, None);
            if outcome != Outcome::InForce(crc_of(blob)) {
                return Err(format!("upload {upload}: {outcome:?}"));
            }
        }
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        Ok(Self { random, device, torn, old, new: blob(2, 2) })
    }

    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end
    }

    /// Ends an upload of the new model in one of many ways; returns which.
    fn end_upload(&mut self) -> &'static str {
        let new = self.new.clone();
        let whole = Device::steps_to_trial(&new);
        match self.below(4) {
            0 => {
                self.device.upload(&new, whole, None);
                "sent whole, then silence"
            }
            1 => {
                self.device.upload_then(&new, whole, |session, board| {
                    upload_step(session, board, UploadStep::Abort);
                });
                "sent whole, then aborted"
            }
            2 => {
                self.device.upload(&new, whole, None);
                let cut = self.below(3);
                self.device.upload(&blob(3, 1), 1, Some(cut));
                "sent whole, then cut in the next begin"
            }
            _ => {
                let cut = self.below(60);
                self.device.upload(&new, usize::MAX, Some(cut));
                "cut"
            }
        }
    }

    /// Flips one bit of the model in slot `slot`, or of the first record behind it; returns whether of the record.
    fn decay(&mut self, slot: usize, blob: &[u8]) -> bool {
        let (bits, record) = (blob.len() as u64 * 8, SLOT_WORDS * 4 - RECORD_BYTES);
        let is_uploaded = self.device.bytes(slot)[record..] != [0xFF; RECORD_BYTES];
        let all = if is_uploaded { bits + RECORD_BYTES as u64 * 8 } else { bits };
        let bit = self.below(all);
        let is_of_record = bit >= bits;
        let bit = if is_of_record { record as u64 * 8 + bit - bits } else { bit };
        self.device.slots[slot].decay((bit / 32) as usize, 1 << (bit % 32));
        is_of_record
    }
}

fn decay(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let starts = Tally::new(["the same model", "the one before it", "none"]);
    let mut found = effort.worst((LEAST, MOST), (0.0, "losses"), |seed| {
        let mut case = Case::new(seed)?;
        let how = case.end_upload();
        let (old, new) = (crc_of(&case.old), crc_of(&case.new));
        let before = case.device.restart();
        let in_force = if before == Some(new) { case.new.clone() } else { case.old.clone() };
        if before != Some(crc_of(&in_force)) {
            return Err(format!("{how}: in force is {before:08x?}"));
        }
        let slot = case.device.slot_of(&in_force).ok_or("the model in force is in no slot")?;
        // Behind a record that decays, there may be a second one.
        let may_stay = case.decay(slot, &in_force);
        let after = case.device.restart();
        let stays = after == before;
        let is_right = if before == Some(new) {
            how == "cut" && (after == Some(old) || stays && may_stay)
        } else {
            after != Some(new) && (!stays || may_stay)
        };
        if !is_right {
            let torn = case.torn.name();
            return Err(format!("{how}, {torn}: {before:08x?}, after the decay {after:08x?}"));
        }
        let outcome = if stays { 0 } else { 1 + usize::from(after.is_none()) };
        starts.add(outcome, 1);
        let outcome = case.device.upload(&blob(9, 1), usize::MAX, None);
        let mended = case.device.restart();
        if mended != Some(crc_of(&blob(9, 1))) {
            return Err(format!("{how}: the next upload is {outcome:?}, in force {mended:08x?}"));
        }
        Ok(0.0)
    });
    if found.note.is_empty() {
        found.note = format!("in force after the decay: {}", starts.text());
    }
    Ok(found)
}

fn worn(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let outcomes = Tally::new(["in force", "refused", "cut"]);
    let mut found = effort.worst((LEAST, MOST), (0.0, "losses"), |seed| {
        let mut case = Case::new(seed)?;
        let spare = 1 - case.device.slot_of(&case.old).ok_or("the old model is in no slot")?;
        // A bit or several that no erase sets, or that no programming clears; most where the upload writes.
        for _ in 0..=case.below(2) {
            let used = case.new.len() as u64 / 4 + 1;
            let place = match case.below(4) {
                0 => SLOT_WORDS as u64 - 1 - case.below(8),
                _ => case.below(used),
            };
            let bits = case.random.next_u32() & case.random.next_u32() & case.random.next_u32();
            let [zeros, ones] = if case.below(2) == 0 { [bits, 0] } else { [0, bits] };
            let worn = Worn { place: place as usize, zeros, ones };
            case.device.slots[spare].worn.push(worn);
        }
        let cut = (case.below(4) == 0).then(|| case.below(60));
        let new = case.new.clone();
        let outcome = case.device.upload(&new, usize::MAX, cut);
        let found = [0, 1, 2].map(|_| case.device.restart());
        let (old, new) = (Some(crc_of(&case.old)), Some(crc_of(&case.new)));
        let (index, is_right) = match outcome {
            Outcome::InForce(_) => (0, found == [new; 3]),
            Outcome::Cut => (2, found == [old; 3] || found == [new; 3]),
            _ => (1, found == [old; 3]),
        };
        outcomes.add(index, 1);
        if !is_right {
            return Err(format!("the upload is {outcome:?}, but in force is {found:08x?}"));
        }
        Ok(0.0)
    });
    if found.note.is_empty() {
        found.note = format!("uploads: {}", outcomes.text());
    }
    Ok(found)
}

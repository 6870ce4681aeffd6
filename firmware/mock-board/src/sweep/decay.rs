//! Slots that decay or wear out, after an upload that ended in any way.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_core::AlignedBytes;
use taxel_firmware::link::message::{Refusal, UploadStep};
use taxel_firmware::store::{PAGE_BYTES, Slot};

use super::SLOT_WORDS;
use crate::device::{Device, confirmed, confirmed_steps, trial_steps};
use crate::flash::{Flash, Supply, Torn, Worn};
use crate::host::upload_step;
use crate::models::{blob, crc_of};

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
        let supply = Supply::new(seed);
        let mut device = Device::new([0, 1].map(|_| Flash::erased(SLOT_WORDS, &supply, torn)));
        *device.journal.pages() = [0, 1].map(|_| Flash::erased(PAGE_BYTES / 4, &supply, torn));
        let uploads = seed / 4 % 4;
        let (old, earlier) = (blob(1, 2), blob(5, 1));
        device.slots[0].flash(0, if uploads == 0 { &old } else { &earlier });
        for upload in 1..=uploads {
            let blob = if upload == uploads { &old } else { &earlier };
            let outcome = device.install(blob);
            if outcome != confirmed(blob) {
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
        let mut whole = trial_steps(&new);
        whole.pop();
        match self.below(4) {
            0 => {
                let _ = self.device.upload(&whole);
                "sent whole, then silence"
            }
            1 => {
                self.device.session(|session, board| {
                    for step in whole.into_iter().chain([UploadStep::Abort]) {
                        let _ = upload_step(session, board, step);
                    }
                });
                "sent whole, then aborted"
            }
            2 => {
                let _ = self.device.upload(&whole);
                let cut = self.below(3);
                let _ = self.device.cut(cut).upload(&confirmed_steps(&blob(3, 1))[..1]);
                "sent whole, then cut in the next begin"
            }
            _ => {
                let cut = self.below(60);
                let _ = self.device.cut(cut).install(&new);
                "cut"
            }
        }
    }

    /// Number of the slot that holds this `blob`.
    fn slot_of(&self, blob: &[u8]) -> Result<usize, String> {
        let slot = self.device.slots.iter().position(|slot| slot.bytes().starts_with(blob));
        slot.ok_or_else(|| "the model in force is in no slot".to_owned())
    }

    /// Flips one bit of the model in slot `slot`, or of what the journal holds; returns whether of the journal.
    fn decay(&mut self, slot: usize, blob: &[u8]) -> bool {
        let is_of_journal = self.below(4) == 0;
        if is_of_journal {
            let page = self.below(2) as usize;
            let bytes = self.device.journal.pages()[page].bytes();
            let used = bytes.iter().rposition(|byte| *byte != 0xFF).map_or(1, |last| last + 1);
            let bit = self.below(8 * used as u64);
            self.device.journal.pages()[page].decay((bit / 32) as usize, 1 << (bit % 32));
        } else {
            let bit = self.below(blob.len() as u64 * 8);
            self.device.slots[slot].decay((bit / 32) as usize, 1 << (bit % 32));
        }
        is_of_journal
    }
}

/// Lets a bit of the slot in force or of the journal decay behind an upload that was not confirmed: that must never take
/// over. Returns
/// whether the same model is in force then (0), the one before it (1), or none (2).
///
/// # Errors
/// What is wrong.
pub fn abort_and_decay(seed: u64) -> Result<usize, String> {
    let mut case = Case::new(seed)?;
    let how = case.end_upload();
    let (old, new) = (crc_of(&case.old), crc_of(&case.new));
    let before = case.device.restart();
    let in_force = if before == Some(new) { case.new.clone() } else { case.old.clone() };
    if before != Some(crc_of(&in_force)) {
        return Err(format!("{how}: in force is {before:08x?}"));
    }
    let slot = case.slot_of(&in_force)?;
    // Behind an item that decays, an older one of its kind counts.
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
    let outcome = case.device.install(&blob(9, 1));
    let mended = case.device.restart();
    if mended != Some(crc_of(&blob(9, 1))) {
        return Err(format!("{how}: the next upload is {outcome:?}, in force {mended:08x?}"));
    }
    Ok(if stays { 0 } else { 1 + usize::from(after.is_none()) })
}

/// Uploads to a slot with worn words, for some devices with a worn journal too: the model comes into force whole (0), or is refused (1), or the power is cut (2).
///
/// # Errors
/// What is wrong.
pub fn upload_to_worn(seed: u64) -> Result<usize, String> {
    let mut case = Case::new(seed)?;
    let spare = 1 - case.slot_of(&case.old)?;
    if case.below(4) == 0 {
        // All words of the journal, of which most bits are sound.
        for page in 0..2 {
            for place in 0..PAGE_BYTES / 4 {
                let ones = 1 << case.below(32);
                case.device.journal.pages()[page].worn.push(Worn { place, zeros: 0, ones });
            }
        }
    }
    // A bit or several that no erase sets, or that no programming clears; most where the upload writes.
    for _ in 0..=case.below(2) {
        let used = case.new.len() as u64 / 4 + 1;
        let place = case.below(used);
        let bits = case.random.next_u32() & case.random.next_u32() & case.random.next_u32();
        let [zeros, ones] = if case.below(2) == 0 { [bits, 0] } else { [0, bits] };
        let worn = Worn { place: place as usize, zeros, ones };
        case.device.slots[spare].worn.push(worn);
    }
    let cut = (case.below(4) == 0).then(|| case.below(60));
    let new = case.new.clone();
    case.device.cut_after = cut;
    let outcome = case.device.install(&new);
    let is_cut = case.device.is_cut();
    let found = [0, 1, 2].map(|_| case.device.restart());
    let (old, new) = (Some(crc_of(&case.old)), Some(crc_of(&case.new)));
    let (index, is_right) = match outcome {
        _ if is_cut => (2, found == [old; 3] || found == [new; 3]),
        Ok(_) => (0, found == [new; 3]),
        // What could not be written down may count all the same, for good.
        Err(Refusal::Flash) => (1, found == [old; 3] || found == [new; 3]),
        Err(_) => (1, found == [old; 3]),
    };
    if is_right {
        Ok(index)
    } else {
        Err(format!("the upload is {outcome:?}, but in force is {found:08x?}"))
    }
}

//! Writes at every start the records that the choice of a model still needs ([`missing_records`]).

use super::model::{candidates, choose};
use super::models::Models;
use crate::log::{info, warning};
use crate::store::{Slot, missing_records, reinstate};

impl Models {
    /// Writes them. A trial is no choice yet.
    // Apart from its caller, whose stack is deep.
    #[inline(never)]
    pub(super) fn write_missing_records<S: Slot>(&mut self, slots: &mut [S; 2]) {
        let is_complete = (0..slots.len()).all(|slot| missing_records(slots, slot).is_none());
        if is_complete || self.trial.is_going_on() {
            return;
        }
        let allowed = |slot| self.authenticity.allows(slot);
        let candidates =
            candidates(slots, None).map(|candidate| candidate.filter(|it| allowed(it.slot)));
        let Some(chosen) = choose(self.capacity, slots, candidates) else { return };
        let Some(generation) = missing_records(slots, chosen.slot) else { return };
        let written = slots.get_mut(chosen.slot).and_then(|slot| reinstate(slot, generation));
        if written == Some(Ok(())) {
            info!("records of the model in force, generation {=u32}", generation);
        } else {
            warning!("no further records of the model in force: no place, or flash failed");
        }
    }
}

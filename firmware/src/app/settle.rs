//! Makes firm at every start which model is in force ([`unsettled`]).

use super::Core;
use super::model::{candidates, choose};
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::store::{Slot, reinstate, unsettled};

impl<P: Platform, F: FrameSource, const ROWS: usize> Core<'_, P, F, ROWS> {
    /// Writes what records the choice of a model still needs. A trial is no choice yet.
    // Apart from its caller, whose stack is deep.
    #[inline(never)]
    pub(super) fn settle<S: Slot>(&mut self, slots: &mut [S; 2]) {
        // A record with a higher generation, and a second one.
        for _ in 0..2 {
            let is_settled = (0..slots.len()).all(|slot| unsettled(slots, slot).is_none());
            if is_settled || self.trial.is_going_on() {
                return;
            }
            let trusted = |slot| self.guard.trusts(slot);
            let candidates =
                candidates(slots, None).map(|candidate| candidate.filter(|it| trusted(it.slot)));
            let Some(chosen) = choose(self.capacity, slots, candidates) else { return };
            let Some(generation) = unsettled(slots, chosen.slot) else { return };
            let written = slots.get_mut(chosen.slot).and_then(|slot| reinstate(slot, generation));
            if written != Some(Ok(())) {
                warning!("no second record of the model in force: no place, or the flash failed");
                return;
            }
            info!("another record of the model in force, generation {=u32}", generation);
        }
    }
}

//! Undo: the previous model comes into force again.

use super::link::Link;
use super::model::{self, InForce};
use super::models::Models;
use super::session_end::SessionEnd;
use crate::link::message::Refusal;
use crate::log::info;
use crate::platform::Platform;
use crate::store::{Slot, blob_in_slot};

impl Models {
    /// Puts the spare slot's model in force again, and leaves the one with the CRC-32 `left`; returns the CRC-32 of the
    /// one in force then.
    pub(super) fn undo<P: Platform, S: Slot, const ROWS: usize>(
        &mut self,
        left: u32,
        in_force: &InForce<'_, ROWS>,
        spare: &S,
        link: &mut Link<'_, P>,
        end: &mut Option<SessionEnd>,
    ) -> Result<u32, Refusal> {
        const NOTHING: Refusal = Refusal::NothingToUndo;
        let identity = in_force.identity.ok_or(NOTHING)?;
        let previous = model::check(self.capacity, blob_in_slot(spare.bytes()));
        let previous = previous.map_err(|_| NOTHING)?.crc();
        if identity.crc_32 != left {
            // The answer was lost, if the model that was to be left is the spare one.
            return if previous == left { Ok(identity.crc_32) } else { Err(NOTHING) };
        }
        let slot = in_force.spare_slot();
        if !self.confirmed.has(slot, spare.bytes()) {
            return Err(NOTHING);
        }
        if !self.end_trial() {
            link.may_write()?;
            let confirmed = self.confirmed.exchanged(slot, self.confirmed.crcs);
            let kept = confirmed.keep(link.platform().journal());
            link.count_write(kept)?;
            info!("model {=u32:08x} in force again", previous);
            self.upload.abort();
        }
        *end = Some(SessionEnd::NewModel);
        Ok(previous)
    }
}

//! A model on trial: in force without a record, so that every restart brings the previous one back, whether the watchdog
//! or the power caused it.

use super::Core;
use super::model::{self, candidates};
use crate::link::message::{ModelFault, Refusal, Report, UploadState};
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::store::{Slot, blob_in_slot};

/// Whether a model is on trial.
#[derive(Debug, Clone, Copy, Default)]
pub struct Trial {
    slot: Option<u8>,
    /// Number of the request to confirm it.
    confirms: Option<u16>,
}

impl Trial {
    /// Slot of the model on trial.
    pub fn slot(self) -> Option<usize> {
        self.slot.map(usize::from)
    }

    /// Whether there is one.
    pub fn is_going_on(self) -> bool {
        self.slot.is_some()
    }

    /// Puts the model in `slot` on trial.
    pub fn begin(&mut self, slot: u8) {
        self.slot = Some(slot);
    }

    /// Lets the next session confirm the model, and answer request `number`: the slot is not borrowed then.
    pub fn confirm(&mut self, number: u16) {
        self.confirms = Some(number);
    }
}

impl<P: Platform, F: FrameSource, const ROWS: usize> Core<'_, P, F, ROWS> {
    /// Ends the trial, if there is one; returns whether there was. Another session must begin.
    pub(super) fn end_trial(&mut self) -> bool {
        let ended = self.trial.is_going_on();
        if ended {
            info!("the trial ends without a confirmation");
            self.trial = Trial::default();
        }
        ended
    }

    /// Ends the trial unless its model `is_in_force`: it was found damaged.
    pub(super) fn end_trial_unless(&mut self, is_in_force: bool) {
        if !is_in_force && self.end_trial() {
            warning!("the model on trial is damaged");
        }
    }

    /// Confirms the model on trial, if that was asked for, and answers.
    pub(super) fn confirm<S: Slot>(&mut self, slots: &mut [S; 2]) {
        let Some(number) = self.trial.confirms.take() else { return };
        let report = match self.write_record(slots) {
            Ok(()) => Report::Upload(self.upload.state()),
            Err(refusal) => Report::Refused(refusal),
        };
        self.trial = Trial::default();
        self.line.send(number, &report, &mut self.statistics);
    }

    /// Writes the record that makes the model on trial the most recent. A failure ends the trial.
    fn write_record<S: Slot>(&mut self, slots: &mut [S; 2]) -> Result<(), Refusal> {
        let [tried, ..] = candidates(slots, self.trial.slot());
        let (Some(tried), UploadState::OnTrial { crc_32 }) = (tried, self.upload.state()) else {
            return Err(Refusal::NoUpload);
        };
        let slot = slots.get_mut(tried.slot).ok_or(Refusal::NoUpload)?;
        // The slot may be damaged while a copy is decoded from.
        let found = model::check(self.capacity, blob_in_slot(slot.bytes()));
        if found.map_err(Refusal::BadModel)?.crc() != crc_32 {
            return Err(Refusal::BadModel(ModelFault::Corrupt));
        }
        self.upload.commit(slot, tried.generation, crc_32)?;
        info!("model {=u32:08x} confirmed", crc_32);
        Ok(())
    }
}

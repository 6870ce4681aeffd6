//! Which model comes into force: uploads, trials and their confirmation.

use super::link::Link;
use super::model::{self, InForce};
use super::session_end::SessionEnd;
use super::trial::Trial;
use crate::capacity::Capacity;
use crate::link::message::{ModelFault, Refusal, Report, UploadState, UploadStep};
use crate::link::packet::UNASKED;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::store::{ConfirmedModels, FlashError, Slot, Upload};

/// What is known of the models besides the slots.
pub struct Models {
    pub capacity: Capacity,
    /// Which were confirmed when the session began.
    pub confirmed: ConfirmedModels,
    pub upload: Upload,
    pub trial: Trial,
}

impl Models {
    /// Prepares `spare`, the slot of this number, for a blob of `length` bytes. The watchdog is fed just before and after an
    /// erase, which may take half of its period.
    fn begin_upload<P: Platform, S: Slot>(
        &mut self,
        (slot, spare): (usize, &mut S),
        length: usize,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        let now_us = link.now_us();
        let platform = link.platform();
        let mut confirmed = ConfirmedModels { in_force: 1 - slot.min(1), ..self.confirmed };
        confirmed.crcs.iter_mut().skip(slot).take(1).for_each(|crc| *crc = None);
        let mut is_erased = false;
        let begun = self.upload.begin(spare, length, now_us, || {
            platform.feed_watchdog();
            confirmed.keep(platform.journal()).map_err(|_| FlashError)?;
            platform.feed_watchdog();
            is_erased = true;
            Ok(())
        });
        if is_erased {
            self.confirmed = confirmed;
            link.platform().feed_watchdog();
            let erases = &mut link.statistics.slot_erases;
            *erases = erases.saturating_add(1);
        }
        begun
    }

    /// Does a step of an upload to the `spare` slot.
    pub fn upload_step<P: Platform, S: Slot, const ROWS: usize>(
        &mut self,
        step: UploadStep<'_>,
        model: &InForce<'_, ROWS>,
        spare: &mut S,
        link: &mut Link<'_, P>,
        end: &mut Option<SessionEnd>,
    ) -> Result<(), Refusal> {
        match step {
            UploadStep::Begin { head } => {
                if self.trial.is_going_on() {
                    return Err(Refusal::OnTrial); // the spare slot has the previous model
                }
                let length = model::check_head(self.capacity, head).map_err(Refusal::BadModel)?;
                info!("upload of {=usize} bytes begins", length);
                self.begin_upload((model.spare_slot(), spare), length, link)
            }
            UploadStep::Chunk { bytes, .. } if bytes.len() > self.capacity.chunk_bytes() => {
                Err(Refusal::Unknown)
            }
            UploadStep::Chunk { offset, bytes } => self.upload.chunk(spare, offset, bytes),
            UploadStep::Abort => {
                if self.end_trial() {
                    *end = Some(SessionEnd::NewModel);
                }
                self.upload.abort();
                Ok(())
            }
            UploadStep::Try { trial_ms } => {
                self.trial.set_end(link.now_us(), trial_ms);
                if self.trial.is_going_on() {
                    return Ok(()); // the answer was lost, or the trial is to last longer
                }
                let blob = self.upload.complete(spare)?;
                let checked = model::check(self.capacity, blob).map(|model| model.crc());
                let crc_32 = checked.map_err(Refusal::BadModel).inspect_err(|_| {
                    warning!("uploaded model refused");
                    self.upload.abort();
                })?;
                info!("model {=u32:08x} on trial", crc_32);
                self.upload.begin_trial(crc_32);
                self.trial.begin(model.spare_slot());
                *end = Some(SessionEnd::NewModel);
                Ok(())
            }
            UploadStep::Confirm => match (self.trial.slot(), self.upload.state()) {
                (Some(slot), UploadState::OnTrial { crc_32 }) => {
                    *end = Some(SessionEnd::NewModel);
                    self.trial = Trial::default();
                    self.confirm((slot, crc_32), model, link)
                }
                // The answer was lost.
                (_, UploadState::Confirmed { .. }) => Ok(()),
                (_, UploadState::TrialOver { .. }) => Err(Refusal::TrialOver),
                _ => Err(Refusal::NoUpload),
            },
        }
    }

    /// Lets the model on trial, in this `slot`, stay in force for good. A failure ends the trial.
    fn confirm<P: Platform, const ROWS: usize>(
        &mut self,
        (slot, crc_32): (usize, u32),
        model: &InForce<'_, ROWS>,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        // The slot may be damaged while a copy is decoded from.
        if model.stored_crc(self.capacity) != Some(crc_32) {
            return Err(Refusal::BadModel(ModelFault::Corrupt));
        }
        let mut crcs = self.confirmed.crcs;
        crcs.iter_mut().skip(slot).take(1).for_each(|crc| *crc = Some(crc_32));
        let confirmed = self.confirmed.exchanged(slot, crcs);
        confirmed.keep(link.platform().journal()).map_err(|_| Refusal::Flash)?;
        info!("model {=u32:08x} confirmed", crc_32);
        self.upload.confirm(crc_32);
        Ok(())
    }

    /// Ends the trial, if there is one; returns whether there was. Another session must begin.
    pub fn end_trial(&mut self) -> bool {
        let ended = self.trial.is_going_on();
        if ended {
            info!("the trial ends without a confirmation");
            self.trial = Trial::default();
        }
        ended
    }

    /// Ends a trial whose time is over, and says so. Another session must begin then.
    pub fn end_late_trial<P: Platform>(&mut self, link: &mut Link<'_, P>) -> Option<SessionEnd> {
        if !self.trial.is_over(link.now_us()) {
            return None;
        }
        self.end_trial();
        self.upload.end_late_trial();
        link.send(UNASKED, &Report::Upload(self.upload.state()));
        Some(SessionEnd::NewModel)
    }

    /// Ends the trial unless its model `is_in_force`: it was found damaged.
    pub fn end_trial_unless(&mut self, is_in_force: bool) {
        if !is_in_force && self.end_trial() {
            warning!("the model on trial is damaged");
        }
    }
}

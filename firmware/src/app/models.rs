//! Which model comes into force: uploads, trials and the key.

use super::authenticity::Authenticity;
use super::link::Link;
use super::model::{self, InForce, candidates};
use super::session_end::SessionEnd;
use super::trial::Trial;
use crate::capacity::Capacity;
use crate::link::message::{KeyState, ModelFault, Refusal, Report, UploadState, UploadStep};
use crate::link::packet::UNASKED;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::seal::Key;
use crate::store::{Slot, Upload, blob_in_slot};

/// What is known of the models besides the slots.
pub struct Models {
    pub capacity: Capacity,
    pub upload: Upload,
    pub trial: Trial,
    pub authenticity: Authenticity,
}

impl Models {
    /// Prepares `spare` for a blob of `length` bytes. The watchdog is fed just before and after an erase, which may take
    /// half of its period.
    fn begin_upload<P: Platform, S: Slot>(
        &mut self,
        spare: &mut S,
        length: usize,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        let now_us = link.now_us();
        let mut is_erased = false;
        let platform = link.platform();
        let begun = self.upload.begin(spare, length, now_us, || {
            platform.feed_watchdog();
            is_erased = true;
        });
        if is_erased {
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
                if model.generation() == u32::MAX {
                    return Err(Refusal::LastGeneration);
                }
                let most = self.authenticity.capacity(spare.bytes());
                if length > most {
                    return Err(Refusal::TooLarge { slot_bytes: most as u32 });
                }
                info!("upload of {=usize} bytes begins", length);
                self.begin_upload(spare, length, link)
            }
            UploadStep::Chunk { offset, bytes } => self.upload.chunk(spare, offset, bytes),
            UploadStep::Abort => {
                if self.end_trial() {
                    *end = Some(SessionEnd::NewModel);
                }
                self.upload.abort();
                Ok(())
            }
            UploadStep::Try { seal, lease_ms } => {
                self.trial.lease(link.now_us(), lease_ms);
                if self.trial.is_going_on() {
                    return Ok(()); // the answer was lost, or the trial is to last longer
                }
                let blob = self.upload.complete(spare)?;
                let checked = model::check(self.capacity, blob).map_err(Refusal::BadModel);
                let checked = checked.and_then(|model| {
                    self.authenticity.check(blob, seal)?;
                    Ok(model.crc())
                });
                let crc_32 = checked.inspect_err(|_| {
                    warning!("uploaded model refused");
                    self.upload.abort();
                })?;
                if let Some(seal) = seal {
                    self.upload.seal(spare, &seal)?;
                }
                info!("model {=u32:08x} on trial", crc_32);
                self.upload.begin_trial(crc_32);
                // Without a model, slot 1 is the spare one.
                self.trial.begin(model.identity.map_or(1, |model| 1 - model.slot.min(1)));
                *end = Some(SessionEnd::NewModel);
                Ok(())
            }
            // Nothing is on trial. The answer was lost, if it was confirmed.
            UploadStep::Confirm => match self.upload.state() {
                UploadState::Confirmed { .. } => Ok(()),
                UploadState::TrialOver { .. } => Err(Refusal::TrialOver),
                _ => Err(Refusal::NoUpload),
            },
        }
    }

    /// Sets the device's key. Models without a seal are left at once, and not only at the next restart.
    pub fn provision<P: Platform>(
        &mut self,
        key: &Key,
        platform: &mut P,
        end: &mut Option<SessionEnd>,
    ) -> Result<(), Refusal> {
        if self.trial.is_going_on() {
            return Err(Refusal::OnTrial);
        }
        let had_none = self.authenticity.key_state() == KeyState::None;
        if had_none {
            platform.feed_watchdog(); // it may erase flash
        }
        self.authenticity.provision(platform.key_area(), key)?;
        if had_none {
            info!("the device has a key from now on");
            self.upload.forget();
            *end = Some(SessionEnd::NewModel);
        }
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

    /// Confirms the model on trial, if that was asked for, and answers.
    pub fn confirm<P: Platform, S: Slot>(&mut self, slots: &mut [S; 2], link: &mut Link<'_, P>) {
        let Some(number) = self.trial.confirms() else { return };
        let report = match self.write_record(slots) {
            Ok(()) => Report::Upload(self.upload.state()),
            Err(refusal) => Report::Refused(refusal),
        };
        self.trial = Trial::default();
        link.send(number, &report);
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

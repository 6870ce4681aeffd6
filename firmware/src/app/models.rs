//! Models: written to the spare slot, tried, confirmed, and undone.
//!
//! A model on trial is in force without being kept as that, so that every restart brings the previous one back, whether the
//! watchdog or the power caused it.

use super::link::Link;
use super::model::{self, InForce};
use super::session_end::SessionEnd;
use crate::capacity::Capacity;
use crate::link::message::{ModelFault, Refusal, Report, UploadState, UploadStep};
use crate::link::packet::UNASKED;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::store::{ConfirmedModels, ERASES_AT_ONCE, FlashError, Slot, blob_in_slot};

/// Longest trial in ms.
const MOST_TRIAL_MS: u32 = 1_800_000;

/// State of the models besides the slots.
pub struct Models {
    pub capacity: Capacity,
    /// Models that were confirmed when the session began.
    pub confirmed: ConfirmedModels,
    /// Progress of an upload, whose bytes are in the spare slot.
    upload: UploadState,
    /// Announced length of its blob in bytes.
    length: usize,
    /// Whether the spare slot was erased for an upload, and no chunk was written since.
    is_empty: bool,
    /// Time in µs until which the erases so far last, each for [`Slot::erase_interval_s`].
    worn_until_us: u64,
    trial: Option<Trial>,
}

/// A trial that is going on.
#[derive(Clone, Copy)]
struct Trial {
    /// Slot of its model.
    slot: usize,
    /// Time in µs since the start at which it ends.
    ends_us: u64,
}

impl Models {
    /// No upload is going on.
    pub const fn new(capacity: Capacity) -> Self {
        Self {
            capacity,
            confirmed: ConfirmedModels::NONE,
            upload: UploadState::Idle,
            length: 0,
            is_empty: false,
            worn_until_us: 0,
            trial: None,
        }
    }

    /// Slot of the model on trial, if there is one.
    pub fn slot_on_trial(&self) -> Option<usize> {
        self.trial.map(|trial| trial.slot)
    }

    /// Does a step of an upload to the `spare` slot; returns the upload's progress.
    pub fn upload_step<P: Platform, S: Slot, const ROWS: usize>(
        &mut self,
        step: UploadStep<'_>,
        model: &InForce<'_, ROWS>,
        spare: &mut S,
        link: &mut Link<'_, P>,
        end: &mut Option<SessionEnd>,
    ) -> Result<UploadState, Refusal> {
        match step {
            UploadStep::Begin { head } => self.begin(head, model.spare_slot(), spare, link)?,
            UploadStep::Chunk { bytes, .. } if bytes.len() > self.capacity.chunk_bytes() => {
                return Err(Refusal::Unknown);
            }
            UploadStep::Chunk { offset, bytes } => self.write(offset as usize, bytes, spare)?,
            UploadStep::Abort => {
                if self.end_trial() {
                    *end = Some(SessionEnd::NewModel);
                }
                self.upload = UploadState::Idle;
            }
            UploadStep::Try { trial_ms } => {
                let ends_us = link.now_us() + 1000 * u64::from(trial_ms.min(MOST_TRIAL_MS));
                if let Some(trial) = &mut self.trial {
                    trial.ends_us = ends_us; // the answer was lost, or the trial is to last longer
                } else {
                    self.begin_trial(Trial { slot: model.spare_slot(), ends_us }, spare)?;
                    *end = Some(SessionEnd::NewModel);
                }
            }
            UploadStep::Confirm => match (self.trial.take(), self.upload) {
                (Some(trial), UploadState::OnTrial { crc_32 }) => {
                    *end = Some(SessionEnd::NewModel); // a failure ends the trial too
                    self.confirm(trial.slot, crc_32, model, link)?;
                }
                // The answer was lost.
                (_, UploadState::Confirmed { .. }) => {}
                (_, UploadState::TrialOver { .. }) => return Err(Refusal::TrialOver),
                _ => return Err(Refusal::NoUpload),
            },
        }
        Ok(self.upload)
    }

    /// Prepares `spare`, the slot of this number, for a blob with this `head`. The slot is erased unless it still is from
    /// the last begin; the journal says before that no model of it counts any more. The watchdog is fed just before and
    /// after an erase, which may take half of its period.
    fn begin<P: Platform, S: Slot>(
        &mut self,
        head: &[u8],
        slot: usize,
        spare: &mut S,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        if self.trial.is_some() {
            return Err(Refusal::OnTrial); // the spare slot has the previous model
        }
        let length = model::check_head(self.capacity, head).map_err(Refusal::BadModel)?;
        info!("upload of {=usize} bytes begins", length);
        let slot_bytes = spare.bytes().len();
        if length > slot_bytes {
            return Err(Refusal::TooLarge { slot_bytes: slot_bytes as u32 });
        }
        if !self.is_empty {
            self.wear(link.now_us(), spare.erase_interval_s())?;
            let mut confirmed = ConfirmedModels { in_force: 1 - slot.min(1), ..self.confirmed };
            confirmed.crcs.iter_mut().skip(slot).take(1).for_each(|crc| *crc = None);
            let platform = link.platform();
            platform.feed_watchdog();
            let kept = confirmed.keep(platform.journal());
            self.check(kept.map(|_| ()).map_err(|_| FlashError))?;
            self.confirmed = confirmed;
            link.platform().feed_watchdog();
            let erased = spare.erase();
            link.platform().feed_watchdog();
            let erases = &mut link.statistics.slot_erases;
            *erases = erases.saturating_add(1);
            self.check(erased)?;
        }
        self.is_empty = true;
        (self.upload, self.length) = (UploadState::Receiving { received: 0 }, length);
        Ok(())
    }

    /// Takes note of an erase, unless there were too many: more than [`ERASES_AT_ONCE`] beyond one in each interval.
    fn wear(&mut self, now_us: u64, interval_s: u32) -> Result<(), Refusal> {
        let interval_us = u64::from(interval_s) * 1_000_000;
        let worn_until_us = self.worn_until_us.max(now_us) + interval_us;
        let allowed_us = now_us + u64::from(ERASES_AT_ONCE) * interval_us;
        if worn_until_us > allowed_us {
            return Err(Refusal::TooSoon { wait_us: worn_until_us - allowed_us });
        }
        self.worn_until_us = worn_until_us;
        Ok(())
    }

    /// Writes the next chunk to `spare`. Bytes that were received before are skipped.
    fn write<S: Slot>(
        &mut self,
        offset: usize,
        bytes: &[u8],
        spare: &mut S,
    ) -> Result<(), Refusal> {
        let received = self.received()?;
        let (here, end) = (received as usize, offset.saturating_add(bytes.len()));
        if end <= here {
            return Ok(());
        }
        let whole_words = end.is_multiple_of(4) || end == self.length;
        if offset != here || end > self.length || !whole_words {
            return Err(Refusal::OutOfPlace { received });
        }
        self.is_empty = false;
        let (words, last) = bytes.as_chunks::<4>();
        let mut written = spare.write(offset, words.as_flattened());
        if !last.is_empty() {
            let mut padded = [0xFF; 4];
            padded.iter_mut().zip(last).for_each(|(place, byte)| *place = *byte);
            let place = offset.saturating_add(bytes.len() - last.len());
            written = written.and_then(|()| spare.write(place, &padded));
        }
        self.check(written)?;
        self.upload = UploadState::Receiving { received: end as u32 };
        Ok(())
    }

    /// Number of bytes received of the upload.
    fn received(&self) -> Result<u32, Refusal> {
        match self.upload {
            UploadState::Receiving { received } => Ok(received),
            _ => Err(Refusal::NoUpload),
        }
    }

    /// Puts the model that was received in `spare` on trial, if it is sound.
    fn begin_trial<S: Slot>(&mut self, trial: Trial, spare: &S) -> Result<(), Refusal> {
        let received = self.received()?;
        let whole = (received as usize == self.length).then(|| spare.bytes().get(..self.length));
        let blob = whole.flatten().ok_or(Refusal::OutOfPlace { received })?;
        let checked = model::check(self.capacity, blob).map(|model| model.crc());
        let crc_32 = checked.map_err(Refusal::BadModel).inspect_err(|_| {
            warning!("uploaded model refused");
            self.upload = UploadState::Idle;
        })?;
        info!("model {=u32:08x} on trial", crc_32);
        (self.upload, self.trial) = (UploadState::OnTrial { crc_32 }, Some(trial));
        Ok(())
    }

    /// Lets the model on trial, in this `slot`, stay in force for good.
    fn confirm<P: Platform, const ROWS: usize>(
        &mut self,
        slot: usize,
        crc_32: u32,
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
        self.upload = UploadState::Confirmed { crc_32 };
        Ok(())
    }

    /// Ends the trial, if there is one; returns whether there was. Another session must begin.
    fn end_trial(&mut self) -> bool {
        let ended = self.trial.take().is_some();
        if ended {
            info!("the trial ends without a confirmation");
        }
        ended
    }

    /// Ends a trial whose time is over, and says so. Another session must begin then.
    pub fn end_late_trial<P: Platform>(&mut self, link: &mut Link<'_, P>) -> Option<SessionEnd> {
        let now_us = link.now_us(); // in every turn: the clock must be looked at before it wraps around
        self.trial.filter(|trial| now_us >= trial.ends_us)?;
        self.end_trial();
        if let UploadState::OnTrial { crc_32 } = self.upload {
            self.upload = UploadState::TrialOver { crc_32 };
        }
        link.send(UNASKED, &Report::Upload(self.upload));
        Some(SessionEnd::NewModel)
    }

    /// Ends the trial unless its model `is_in_force`: it was found damaged.
    pub fn end_trial_unless(&mut self, is_in_force: bool) {
        if !is_in_force && self.end_trial() {
            warning!("the model on trial is damaged");
        }
    }

    /// Puts the spare slot's model in force again, and leaves the one with the CRC-32 `left`; returns the CRC-32 of the
    /// one in force then.
    pub fn undo<P: Platform, S: Slot, const ROWS: usize>(
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
            self.upload = UploadState::Idle;
        }
        *end = Some(SessionEnd::NewModel);
        Ok(previous)
    }

    /// Converts an outcome of the flash; a failure ends the upload.
    fn check(&mut self, outcome: Result<(), FlashError>) -> Result<(), Refusal> {
        outcome.map_err(|FlashError| {
            self.upload = UploadState::Idle;
            Refusal::Flash
        })
    }
}

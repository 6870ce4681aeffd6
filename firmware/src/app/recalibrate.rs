//! Recalibration from reference presses: of the model in force, into the spare slot.
//!
//! What is learned lies in the memory that the copy of the weights leaves free, and ends with the session. If that is too
//! small, another session begins without a copy: the model is then decoded from its slot, to the same bits.

use core::mem;

use model_core::blob::{Floats, Model};
use model_core::checksum::CRC_32;
use model_core::recalibration::{Press, Recalibration, RecalibrationError};
use model_core::{Decoder, Frame};

use super::Core;
use super::buffers::cut;
use super::leave::Leave;
use super::model::{self, InForce};
use crate::link::message::{
    ModelFault, RecalibrationFault, RecalibrationReport, RecalibrationState, RecalibrationStep,
    Refusal, Report,
};
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::{Baseline, FrameSource};
use crate::store::{Slot, blob_in_slot, generation, reinstate};

/// Bytes of the new model that are written at a time.
const PIECE: usize = 256;

/// A recalibration of the model in force, if one has begun.
pub struct Recalibrating<'a> {
    memory: &'a mut [f32],
    going_on: bool,
    presses: u16,
}

impl<'a> Recalibrating<'a> {
    /// None, with the memory that is there for one.
    pub fn new(memory: &'a mut [u32]) -> Self {
        Self { memory: bytemuck::cast_slice_mut(memory), going_on: false, presses: 0 }
    }

    /// Begins a recalibration of `model`, where `scratch` floats of working space are there anyway.
    fn begin(&mut self, model: &Model<'_>, scratch: usize) -> Result<(), RecalibrationError> {
        self.going_on = false;
        let state = Recalibration::floats(model)?;
        let working = Recalibration::scratch_floats(model)?;
        let floats = if working > scratch { state.saturating_add(working) } else { state };
        if floats > self.memory.len() {
            return Err(RecalibrationError::NoRoom { floats });
        }
        Recalibration::start(model, self.memory)?;
        (self.going_on, self.presses) = (true, 0);
        Ok(())
    }

    /// The recalibration of `model` that is going on, and the memory that it leaves.
    fn resume(&mut self, model: &Model<'_>) -> Option<(Recalibration<'_>, &mut [f32])> {
        let floats = Recalibration::floats(model).ok().filter(|_| self.going_on)?;
        let (state, rest) = self.memory.split_at_mut_checked(floats)?;
        Some((Recalibration::resume(model, state).ok()?, rest))
    }
}

/// A reference press that is being read.
pub struct Pressing<'m> {
    mean: Baseline<'m>,
    /// Also the room for standard deviations, of a model that is not recalibrated.
    pub(super) stated: &'m mut [f32],
    /// Number of the request that waits for it, and of frames to be scanned; `None` if there is none.
    waiting: Option<(u16, u16)>,
}

impl<'m> Pressing<'m> {
    /// None, with memory for the mean of the longest frame, and for the outputs of all rows.
    pub fn new(mean: &'m mut [f32], stated: &'m mut [f32]) -> Self {
        Self { mean: Baseline::new(mean), stated, waiting: None }
    }
}

impl<P: Platform, F: FrameSource, const ROWS: usize> Core<'_, P, F, ROWS> {
    /// Carries out a step; returns the answer to it, or `None` if that comes later.
    pub(super) fn recalibrate<S: Slot>(
        &mut self,
        (number, step): (u16, RecalibrationStep<'_>),
        in_force: &InForce<'_, ROWS>,
        spare: &mut S,
        recalibrating: &mut Recalibrating<'_>,
        leave: &mut Option<Leave>,
    ) -> Result<Option<Report<'static>>, Refusal> {
        const NO_MODEL: Refusal = Refusal::Recalibration(RecalibrationFault::NoModel);
        let decoder = in_force.decoder.as_ref().ok_or(NO_MODEL)?;
        let crc_32 = decoder.model_crc();
        // The new model would go where the previous one is.
        if self.trial.is_going_on()
            && matches!(step, RecalibrationStep::Begin | RecalibrationStep::Commit)
        {
            return Err(Refusal::OnTrial);
        }
        let report = match step {
            RecalibrationStep::Begin => {
                self.give_up_press();
                // Without a sound slot, the copy is all that there is.
                let may_leave_copy = in_force.stored.is_some();
                match self.begin_recalibration(decoder, recalibrating) {
                    Err(Refusal::Recalibration(RecalibrationFault::NoRoom { .. }))
                        if may_leave_copy =>
                    {
                        self.begins = Some((number, crc_32));
                        *leave = Some(Leave::MakeRoom);
                        return Ok(None);
                    }
                    begun => begun?,
                }
            }
            RecalibrationStep::Press { before, frames, outputs } => {
                let press = (before, frames, outputs);
                if !self.press(number, press, decoder, recalibrating)? {
                    return Ok(None);
                }
                report(decoder.model(), recalibrating)
            }
            RecalibrationStep::Status => report(decoder.model(), recalibrating),
            RecalibrationStep::Abort => {
                self.give_up_press();
                recalibrating.going_on = false;
                if in_force.identity.is_some_and(|identity| !identity.in_ram) {
                    *leave = Some(Leave::MakeRoom); // for a copy of the weights
                }
                report(decoder.model(), recalibrating)
            }
            RecalibrationStep::Commit if self.recalibrated == Some(crc_32) => in_force_now(crc_32),
            RecalibrationStep::Commit => {
                self.give_up_press();
                let report = report(decoder.model(), recalibrating);
                let crc_32 = self.write_recalibrated(in_force, decoder, spare, recalibrating)?;
                self.recalibrated = Some(crc_32);
                *leave = Some(Leave::NewModel);
                RecalibrationReport { state: RecalibrationState::InForce { crc_32 }, ..report }
            }
            RecalibrationStep::Undo { crc_32: left } => {
                in_force_now(self.undo(left, in_force, crc_32, spare, leave)?)
            }
        };
        Ok(Some(Report::Recalibration(report)))
    }

    /// Begins a recalibration of the decoder's model, in the memory that there is.
    fn begin_recalibration(
        &mut self,
        decoder: &Decoder<'_, ROWS>,
        recalibrating: &mut Recalibrating<'_>,
    ) -> Result<RecalibrationReport, Refusal> {
        let begun = recalibrating.begin(decoder.model(), self.scratch.len());
        begun.map_err(|error| refusal(error, recalibrating.memory.len()))?;
        self.recalibrated = None;
        info!("recalibration begins");
        Ok(report(decoder.model(), recalibrating))
    }

    /// Begins the recalibration for which a session without a copy of the weights was asked for, and answers that request.
    pub(super) fn begin_in_place(
        &mut self,
        decoder: Option<&Decoder<'_, ROWS>>,
        recalibrating: &mut Recalibrating<'_>,
    ) {
        let Some((number, crc_32)) = self.begins.take() else { return };
        let begun = match decoder.filter(|decoder| decoder.model_crc() == crc_32) {
            Some(decoder) => self.begin_recalibration(decoder, recalibrating),
            None => Err(Refusal::BadModel(ModelFault::Corrupt)), // lost since it was asked for
        };
        let report = begun.map_or_else(Report::Refused, Report::Recalibration);
        self.line.send(number, &report, &mut self.statistics);
    }

    /// Takes a press; returns whether it is done, or its frames have to be scanned first.
    fn press(
        &mut self,
        number: u16,
        (before, frames, outputs): (u16, u16, Floats<'_>),
        decoder: &Decoder<'_, ROWS>,
        recalibrating: &mut Recalibrating<'_>,
    ) -> Result<bool, Refusal> {
        let presses = recalibrating.presses;
        let refuse = |fault| Err(Refusal::Recalibration(fault));
        if !recalibrating.going_on {
            return refuse(RecalibrationFault::NotBegun);
        }
        if before < presses {
            return Ok(true); // the answer was lost
        }
        if before > presses || presses == u16::MAX {
            return refuse(RecalibrationFault::OutOfPlace { presses });
        }
        if outputs.0.len() != 4 * self.outputs {
            return refuse(RecalibrationFault::Outputs { expected: self.outputs as u16 });
        }
        if (frames == 0) != (self.configuration.frame_period_us == 0) {
            return refuse(RecalibrationFault::Frames);
        }
        if self.pressing.waiting.is_some_and(|(waiting, _)| waiting == number) {
            return Ok(false); // the answer takes a while
        }
        self.give_up_press();
        self.pressing.mean.restart(self.wires.readings());
        let places = self.pressing.stated.iter_mut();
        places.zip(outputs.iter()).for_each(|(place, output)| *place = output);
        if frames == 0 {
            self.pressing.mean.add(self.frame);
            self.add_press(decoder, recalibrating)?;
            return Ok(true);
        }
        self.pressing.waiting = Some((number, frames));
        Ok(false)
    }

    /// Adds the frame to the press that is being read, and answers the request when the press is complete.
    pub(super) fn feed_press(
        &mut self,
        decoder: Option<&Decoder<'_, ROWS>>,
        recalibrating: &mut Recalibrating<'_>,
    ) {
        let Some((number, frames)) = self.pressing.waiting else { return };
        self.pressing.mean.add(self.frame);
        if self.pressing.mean.frames() < frames {
            return;
        }
        self.pressing.waiting = None;
        let Some(decoder) = decoder else { return };
        let report = match self.add_press(decoder, recalibrating) {
            Ok(()) => Report::Recalibration(report(decoder.model(), recalibrating)),
            Err(refusal) => Report::Refused(refusal),
        };
        self.line.send(number, &report, &mut self.statistics);
    }

    /// Refuses the request that waits for a press, if there is one.
    pub(super) fn give_up_press(&mut self) {
        if let Some((number, _)) = self.pressing.waiting.take() {
            let refusal = Refusal::Recalibration(RecalibrationFault::Frames);
            self.line.send(number, &Report::Refused(refusal), &mut self.statistics);
        }
    }

    /// Learns from the press that was read.
    fn add_press(
        &mut self,
        decoder: &Decoder<'_, ROWS>,
        recalibrating: &mut Recalibrating<'_>,
    ) -> Result<(), Refusal> {
        const UNUSABLE: Refusal = Refusal::Recalibration(RecalibrationFault::UnusablePress);
        let readings_ohm = self.pressing.mean.mean();
        let frame = Frame { readings_ohm, reciprocals: self.reciprocals, gate: None };
        // The frame's own estimate was sent before.
        let mut decoded = cut(&mut self.estimate, self.rows, self.outputs);
        decoder.decode_into(frame, self.scratch, &mut decoded).map_err(|_| UNUSABLE)?;
        let press = Press {
            readings_ohm,
            reciprocals: self.reciprocals,
            decoded: decoded.outputs,
            stated: self.pressing.stated.get(..self.outputs).unwrap_or_default(),
        };
        let floats = recalibrating.memory.len();
        let model = decoder.model();
        let (mut recalibration, rest) = recalibrating.resume(model).ok_or(UNUSABLE)?;
        let scratch = if rest.len() > self.scratch.len() { rest } else { &mut *self.scratch };
        let added = recalibration.add(model, &press, scratch);
        added.map_err(|error| refusal(error, floats))?;
        recalibrating.presses = recalibrating.presses.saturating_add(1);
        Ok(())
    }

    /// Writes the recalibrated model into the spare slot, checks it from end to end, and commits it; returns its
    /// CRC-32. Whatever fails leaves the old model in force.
    fn write_recalibrated<S: Slot>(
        &mut self,
        in_force: &InForce<'_, ROWS>,
        decoder: &Decoder<'_, ROWS>,
        spare: &mut S,
        recalibrating: &mut Recalibrating<'_>,
    ) -> Result<u32, Refusal> {
        const NOT_BEGUN: Refusal = Refusal::Recalibration(RecalibrationFault::NotBegun);
        if in_force.generation() == u32::MAX {
            return Err(Refusal::LastGeneration);
        }
        let (model, blob) = (decoder.model(), in_force.blob);
        let floats = recalibrating.memory.len();
        let (mut recalibration, _) = recalibrating.resume(model).ok_or(NOT_BEGUN)?;
        recalibration.finish(model).map_err(|error| refusal(error, floats))?;
        self.begin_upload(spare, blob.len())?;
        let covered = blob.len().saturating_sub(4);
        let (mut digest, mut source) = (CRC_32.digest(), CRC_32.digest());
        let mut piece = [0; PIECE];
        for (index, bytes) in blob.chunks(PIECE).enumerate() {
            let offset = index * PIECE;
            let Some(piece) = piece.get_mut(..bytes.len()) else { break };
            piece.copy_from_slice(bytes);
            recalibration.patch(model, blob, offset, piece);
            let covered = covered.saturating_sub(offset).min(piece.len());
            digest.update(piece.get(..covered).unwrap_or_default());
            source.update(bytes.get(..covered).unwrap_or_default());
            let crc = digest.clone().finalize().to_le_bytes();
            let first = (offset + covered).saturating_sub(blob.len().saturating_sub(4));
            for (place, byte) in piece.iter_mut().skip(covered).zip(crc.iter().skip(first)) {
                *place = *byte;
            }
            self.upload.chunk(spare, offset as u32, piece)?;
            self.line.platform().feed_watchdog(); // a slow flash takes seconds for all pieces
        }
        if source.finalize() != model.crc() {
            warning!("the model in force is damaged: it is not recalibrated");
            self.upload.abort();
            return Err(Refusal::BadModel(ModelFault::Corrupt));
        }
        let new = self.upload.complete(spare)?;
        let slot = in_force.identity.map_or(0, |identity| identity.slot.into());
        let seal = self.guard.seal(new, slot);
        match model::check(self.capacity, new).map(|model| model.crc()) {
            Ok(crc_32) => {
                if let Some(seal) = seal {
                    self.upload.seal(spare, &seal)?;
                }
                self.upload.commit(spare, in_force.generation().saturating_add(1), crc_32)?;
                info!("recalibrated model {=u32:08x} committed", crc_32);
                Ok(crc_32)
            }
            Err(fault) => {
                warning!("recalibrated model refused");
                self.upload.abort();
                Err(Refusal::BadModel(fault))
            }
        }
    }

    /// Puts the spare slot's model in force again, and leaves the one with the CRC-32 `left`; returns the CRC-32 of the
    /// one in force then.
    fn undo<S: Slot>(
        &mut self,
        left: u32,
        in_force: &InForce<'_, ROWS>,
        crc_32: u32,
        spare: &mut S,
        leave: &mut Option<Leave>,
    ) -> Result<u32, Refusal> {
        const NOTHING: Refusal = Refusal::Recalibration(RecalibrationFault::NothingToUndo);
        let identity = in_force.identity.ok_or(NOTHING)?;
        let previous = model::check(self.capacity, blob_in_slot(spare.bytes()));
        let previous = previous.map_err(|_| NOTHING)?.crc();
        if crc_32 != left {
            // The answer was lost, if the model that was to be left is the spare one.
            return if previous == left { Ok(crc_32) } else { Err(NOTHING) };
        }
        let slot = 1 - usize::from(identity.slot.min(1));
        generation(slot, spare.bytes()).ok_or(NOTHING)?;
        if self.end_trial() {
            *leave = Some(Leave::NewModel);
            return Ok(previous);
        }
        self.guard.check_undo(slot)?;
        let next = identity.generation.checked_add(1).ok_or(Refusal::LastGeneration)?;
        self.give_up_press();
        match reinstate(spare, next) {
            None => Err(NOTHING),
            Some(Err(_)) => Err(Refusal::Flash),
            Some(Ok(())) => {
                info!("model {=u32:08x} in force again", previous);
                self.upload.abort();
                *leave = Some(Leave::NewModel);
                Ok(previous)
            }
        }
    }
}

/// The report on what is going on.
fn report(model: &Model<'_>, recalibrating: &mut Recalibrating<'_>) -> RecalibrationReport {
    let presses = recalibrating.presses;
    let Some((mut recalibration, _)) = recalibrating.resume(model) else {
        return RecalibrationReport {
            state: RecalibrationState::Idle,
            presses: 0,
            networks: 0,
            excited: 0,
            error_before: 0.0,
            error_after: 0.0,
        };
    };
    let progress = recalibration.progress(model);
    RecalibrationReport {
        state: RecalibrationState::Collecting,
        presses,
        networks: progress.networks as u8,
        excited: progress.excited as u8,
        error_before: progress.error_before,
        error_after: progress.error_after,
    }
}

/// The report that the model with this CRC-32 is in force.
fn in_force_now(crc_32: u32) -> RecalibrationReport {
    RecalibrationReport {
        state: RecalibrationState::InForce { crc_32 },
        presses: 0,
        networks: 0,
        excited: 0,
        error_before: 0.0,
        error_after: 0.0,
    }
}

/// The link's word for an error, where there is memory for so many floats.
fn refusal(error: RecalibrationError, free_floats: usize) -> Refusal {
    let bytes = |floats: usize| floats.saturating_mul(mem::size_of::<f32>()) as u32;
    Refusal::Recalibration(match error {
        RecalibrationError::SharedNetworks => RecalibrationFault::SharedNetworks,
        RecalibrationError::Unsuitable => RecalibrationFault::Unsuitable,
        RecalibrationError::NoRoom { floats } => {
            RecalibrationFault::NoRoom { bytes: bytes(floats), free_bytes: bytes(free_floats) }
        }
        RecalibrationError::UnusablePress => RecalibrationFault::UnusablePress,
        RecalibrationError::NotExcited { unit } => {
            RecalibrationFault::NotExcited { row: unit as u8 }
        }
        RecalibrationError::NotBetter => RecalibrationFault::NotBetter,
    })
}

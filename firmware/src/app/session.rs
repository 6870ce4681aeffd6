//! A session: the application's loop while one model is in force.

use model_core::blob::Floats;
use model_core::gate::Rest;
use model_core::health::{Health, Limits};
use model_core::relative::reciprocal;
use model_core::{Decoder, Frame, Gate, RowStatus, RowWire};

use super::buffers::cut;
use super::model::{InForce, candidates, check_head, choose, copy_to, row_wires};
use super::recheck::{Checked, Recheck};
use super::session_end::SessionEnd;
use super::{App, Core};
use crate::link::message::{ConfidenceSent, EstimateReport, HealthReport, Report};
use crate::link::packet::UNASKED;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::{FrameSource, Selection};
use crate::store::{Slot, blob_in_slot, generation};

/// The application with the model in force, whose memory it borrows, and with the spare slot.
pub struct Session<'a, 'm, P, F, S, const ROWS: usize> {
    pub(super) app: &'a mut App<'m, P, F, ROWS>,
    pub(super) model: InForce<'a, ROWS>,
    pub(super) spare: &'a mut S,
    recheck: Recheck,
}

impl<'a, 'm, P: Platform, F: FrameSource, S: Slot, const ROWS: usize>
    Session<'a, 'm, P, F, S, ROWS>
{
    /// Starts a session with the most recent sound model in force. Its blob is copied to `weights` if it fits. Behind
    /// one that fits and is damaged, the model of the other slot is decoded from there.
    #[inline(never)] // so that its stack is free again when the loop begins
    pub fn start(
        app: &'a mut App<'m, P, F, ROWS>,
        slots: &'a mut [S; 2],
        weights: &'a mut [u32],
    ) -> Self {
        app.core.confirm(slots);
        app.core.authenticity.read_seals(slots);
        app.core.write_missing_records(slots);
        let capacity = app.core.capacity;
        let authenticity = &app.core.authenticity;
        let candidates = candidates(slots, app.core.trial.slot())
            .map(|candidate| candidate.filter(|found| authenticity.allows(found.slot)));
        let best = candidates.into_iter().flatten().next();
        // Only the copy is checked, so the best model is looked at once.
        let bytes = best.and_then(|best| slots.get(best.slot)).map_or(&[][..], S::bytes);
        let mut model = InForce::NONE;
        let copied =
            best.and_then(|best| model.load(capacity, copy_to(weights, bytes)?, best, true));
        let chosen = if copied.is_some() { best } else { choose(capacity, slots, candidates) };
        app.core.end_trial_unless(chosen.is_some_and(|chosen| chosen.on_trial));
        let slot = chosen.map(|chosen| chosen.slot);
        let [first, second] = slots;
        let (active, spare) = if slot == Some(1) { (&*second, first) } else { (&*first, second) };
        if let (None, Some(chosen)) = (copied, chosen) {
            // Without a model if that fails.
            let _ = model.load(capacity, active.bytes(), chosen, false);
        }
        if let Some(identity) = &mut model.identity {
            let seal = app.core.authenticity.seal_of(identity.slot.into());
            identity.version = seal.map(|seal| seal.version);
        }
        if let Some(model) = &model.identity {
            info!(
                "model {=u32:08x} in force, slot {=u8}, generation {=u32}, in RAM: {=bool}",
                model.crc_32, model.slot, model.generation, model.in_ram
            );
        } else {
            warning!("no model in either slot: readings only, until one is uploaded");
        }
        // Behind an uploaded model in slot 1, the spare slot is slot 0. For a line of the log, the blob's head will do.
        if slot == Some(1)
            && generation(0, spare.bytes()) == Some(0)
            && check_head(capacity, blob_in_slot(spare.bytes())).is_ok()
        {
            info!("slot 0 holds a model that was flashed, not uploaded: it is not used");
        }
        app.core.take_shape_of(model.decoder.as_ref());
        let is_copy = model.identity.is_some_and(|identity| identity.in_ram);
        model.stored = active.bytes().get(..model.blob.len()).filter(|_| is_copy);
        Self { app, model, spare, recheck: Recheck::new() }
    }

    /// Runs one turn of the loop: answers at most one request, and scans a frame if one is due.
    ///
    /// The watchdog is fed at the end, unless the last scan gave no reading at all. A sensor that stays silent
    /// thus leads to a restart, which sets up its bus again.
    pub fn step(&mut self) -> Option<SessionEnd> {
        self.app.core.line.begin_turn();
        let end = self.serve_link();
        let core = &mut self.app.core;
        let now_us = core.line.platform().now_us();
        core.time.at(now_us);
        core.end_leases(now_us);
        // A lease that has ended restarts the clock of frames.
        let now_us = core.line.platform().now_us();
        if let Some(missed) = core.clock.due(now_us, core.configuration.frame_period_us) {
            core.sensor_answers = core.scan(missed, self.model.decoder.as_ref());
        }
        if core.sensor_answers {
            core.line.platform().feed_watchdog();
        } else {
            core.statistics.bad_loops = core.statistics.bad_loops.saturating_add(1);
        }
        end.or_else(|| self.recheck())
    }

    /// Checks another piece of the model in force. A copy in RAM is decoded from even if the slot is damaged.
    fn recheck(&mut self) -> Option<SessionEnd> {
        let model = self.model.identity?;
        let stored = self.model.stored;
        let copies = [self.model.blob, stored.unwrap_or_default()];
        let copies = if stored.is_some() { &copies[..] } else { copies.get(..1)? };
        let core = &mut self.app.core;
        let s = &mut core.statistics;
        match self.recheck.step(copies, model.crc_32) {
            Checked::Piece => None,
            Checked::All => {
                s.model_checks = s.model_checks.saturating_add(1);
                None
            }
            Checked::Damaged(0) => {
                warning!("model {=u32:08x} is damaged where it is decoded from", model.crc_32);
                s.model_damages = s.model_damages.saturating_add(1);
                if !core.trial.is_going_on() {
                    core.upload.forget(); // the spare slot may be the other one now
                }
                Some(SessionEnd::Damaged)
            }
            Checked::Damaged(_) => {
                warning!(
                    "slot {=u8} is damaged: its model is in RAM until the restart",
                    model.slot
                );
                s.slot_damages = s.slot_damages.saturating_add(1);
                self.model.stored = None;
                None
            }
        }
    }
}

impl<P: Platform, F: FrameSource, const ROWS: usize> Core<'_, P, F, ROWS> {
    /// Makes frames and estimates as long as the model's, and decodes the baseline with it. A baseline of other
    /// wires is replaced by the one that is kept, if that fits.
    fn take_shape_of(&mut self, decoder: Option<&Decoder<'_, ROWS>>) {
        let before = (self.wires, self.row_wires);
        let shape = decoder.map(Decoder::shape);
        self.wires =
            shape.and_then(|shape| self.capacity.wires_for(shape)).unwrap_or(self.capacity.wires());
        self.rows = shape.map_or(self.wires.rows, |shape| shape.rows);
        self.outputs = shape.map_or(0, |shape| shape.rows.saturating_mul(shape.outputs));
        let columns = self.wires.columns;
        self.row_wires = decoder
            .map_or(core::array::from_fn(RowWire), |decoder| row_wires(decoder.model(), columns));
        if (self.wires, self.row_wires) != before {
            self.give_up_capture();
            self.baseline.restart(self.wires.readings());
        }
        if self.baseline.frames() == 0 && self.capture.is_none() {
            self.load_baseline();
        }
        self.decode_baseline(decoder);
    }

    /// The readings of the last frame.
    fn readings(&mut self) -> &mut [f32] {
        self.frame.get_mut(..self.wires.readings()).unwrap_or_default()
    }

    /// The time in µs that has passed since the start.
    pub(super) fn now_us(&mut self) -> u64 {
        let now_us = self.line.platform().now_us();
        self.time.at(now_us)
    }

    /// Scans a frame and reports on it; returns whether it has at least one reading.
    fn scan(&mut self, missed: u32, decoder: Option<&Decoder<'_, ROWS>>) -> bool {
        let start_us = self.now_us();
        let frame = self.frame.get_mut(..self.wires.readings()).unwrap_or_default();
        let rows = self.row_wires.get(..self.wires.rows).unwrap_or_default();
        let wires = Selection { rows, columns: self.wires.columns };
        let report = self.source.scan(self.configuration.scan, wires, frame);
        let any = frame.iter().any(|reading| !reading.is_nan());
        let scan_us = self.now_us().wrapping_sub(start_us) as u32;

        let s = &mut self.statistics;
        let frame = s.number_frame();
        s.frames_missed = s.frames_missed.saturating_add(missed);
        s.failed_samples = s.failed_samples.saturating_add(u32::from(report.failed_samples));
        s.longest_scan_us = s.longest_scan_us.max(scan_us);
        let overrun = if missed > 0 { EstimateReport::OVERRUN } else { 0 };

        if self.configuration.send_readings {
            let readings = self.frame.get(..self.wires.readings()).unwrap_or_default();
            let report = Report::Readings { frame, start_us, readings_ohm: Floats::new(readings) };
            self.line.send(UNASKED, &report, &mut self.statistics);
        }
        let (mut flags, health) = self.decode(decoder);
        let sent = self.configuration.confidence;
        let novelty = self.assess(decoder, sent, &mut flags);
        self.feed_baseline(decoder);
        if !health.is_good() {
            self.send_health(frame, start_us, health);
        }
        if self.configuration.send_estimates {
            let flags = flags | overrun;
            self.send_estimate(UNASKED, frame, start_us, flags, (novelty, sent));
        }
        any
    }

    fn send_health(&mut self, frame: u32, start_us: u64, health: Health) {
        let faulty = self.faulty_columns.map(u32::to_le_bytes);
        let report = HealthReport {
            frame,
            start_us,
            missing: health.missing,
            shorted: health.shorted,
            open: health.open,
            faulty_columns: faulty.get(..self.wires.rows).unwrap_or_default().as_flattened(),
        };
        self.line.send(UNASKED, &Report::Health(report), &mut self.statistics);
    }

    /// Decodes the frame without its faulty readings.
    pub(super) fn decode(&mut self, decoder: Option<&Decoder<'_, ROWS>>) -> (u8, Health) {
        let start_us = self.line.platform().now_us();
        let start_cycles = self.line.platform().cycles();
        let limits = Limits {
            shorted_below_ohm: self.configuration.shorted_below_ohm,
            open_above_ohm: self.configuration.open_above_ohm,
        };
        let frame = self.frame.get_mut(..self.wires.readings()).unwrap_or_default();
        let health = Health::new(frame, self.wires.columns, limits, &mut self.faulty_columns);
        let mut flags = if health.is_good() { 0 } else { EstimateReport::FAULTY_READING };
        if let Some(decoder) = decoder {
            if !health.is_good() {
                decoder.fill(frame, self.scratch);
            }
            let captured = self.capture.is_none() && self.baseline.frames() > 0;
            let rest = cut(&mut self.rest, self.rows, self.outputs);
            let rest = Rest {
                baseline_ohm: self.baseline.mean(),
                outputs: rest.outputs,
                status: rest.status,
            };
            let gate = captured.then(|| Gate::new(rest, self.configuration.rest_tolerance));
            let mut estimate = cut(&mut self.estimate, self.rows, self.outputs);
            let decoded = decoder.decode_into(
                Frame { readings_ohm: frame, reciprocals: self.reciprocals, gate: gate.flatten() },
                self.scratch,
                &mut estimate,
            );
            if decoder.metadata().relative_inputs && !self.has_reciprocals {
                flags |= EstimateReport::NO_BASELINE;
            }
            if decoded == Ok(true) {
                flags |= EstimateReport::CLAMPED;
                self.statistics.frames_clamped = self.statistics.frames_clamped.saturating_add(1);
            }
            // The model's shape was found to fit when it came into force.
            if decoded.is_err() || estimate.status.contains(&RowStatus::Overflow) {
                flags |= EstimateReport::OVERFLOW;
            }
        } else {
            cut(&mut self.estimate, self.rows, 0).status.fill(RowStatus::MissingReading);
            flags |= EstimateReport::NO_MODEL;
        }
        let change = self.baseline.largest_relative_deviation(frame);
        let contact = change.is_some_and(|change| change > self.configuration.contact_threshold);
        if contact && self.capture.is_none() {
            flags |= EstimateReport::CONTACT;
        }
        let decode_cycles = self.line.platform().cycles().wrapping_sub(start_cycles);
        let decode_us = self.line.platform().now_us().wrapping_sub(start_us);
        self.count_decoded(decode_us, decode_cycles);
        (flags, health)
    }

    fn count_decoded(&mut self, decode_us: u32, decode_cycles: u32) {
        let status = cut(&mut self.estimate, self.rows, 0).status;
        let at_rest = status.iter().filter(|status| **status == RowStatus::AtRest);
        let s = &mut self.statistics;
        s.rows_at_rest = s.rows_at_rest.saturating_add(at_rest.count() as u32);
        s.frames_decoded = s.frames_decoded.saturating_add(1);
        s.longest_decode_us = s.longest_decode_us.max(decode_us);
        s.longest_decode_cycles = s.longest_decode_cycles.max(decode_cycles);
        if s.shortest_decode_cycles == 0 || decode_cycles < s.shortest_decode_cycles {
            s.shortest_decode_cycles = decode_cycles;
        }
    }

    /// Computes the confidence of the frame that was decoded last, unless nothing of it is `wanted`. Returns the frame's
    /// novelty if the model has a confidence, and adds to the `flags` whether it is novel.
    pub(super) fn assess(
        &mut self,
        decoder: Option<&Decoder<'_, ROWS>>,
        wanted: ConfidenceSent,
        flags: &mut u8,
    ) -> Option<f32> {
        let decoder = decoder.filter(|_| wanted != ConfidenceSent::Nothing)?;
        let start_us = self.line.platform().now_us();
        let start_cycles = self.line.platform().cycles();
        let readings = self.wires.readings();
        let readings_ohm = self.frame.get(..readings).unwrap_or_default();
        let reciprocals = self.reciprocals.get(..readings).unwrap_or_default();
        let frame = Frame { readings_ohm, reciprocals, gate: None };
        let deviation = self.deviations.get_mut(..self.outputs).unwrap_or_default();
        // The model's sizes were found to fit when it came into force.
        let novelty = decoder.assess_into(frame, self.scratch, deviation).ok().flatten()?;
        let cycles = self.line.platform().cycles().wrapping_sub(start_cycles);
        let us = self.line.platform().now_us().wrapping_sub(start_us);
        let s = &mut self.statistics;
        s.longest_confidence_us = s.longest_confidence_us.max(us);
        s.longest_confidence_cycles = s.longest_confidence_cycles.max(cycles);
        if novelty > 0.0 {
            *flags |= EstimateReport::NOVEL;
            s.frames_novel = s.frames_novel.saturating_add(1);
        }
        Some(novelty)
    }

    /// Sends the estimate, either as the answer to request `number` or unasked, with the frame's novelty if there is one,
    /// and the deviations if they are to be sent.
    pub(super) fn send_estimate(
        &mut self,
        number: u16,
        frame: u32,
        start_us: u64,
        flags: u8,
        (novelty, sent): (Option<f32>, ConfidenceSent),
    ) {
        let estimate = cut(&mut self.estimate, self.rows, self.outputs);
        let mut codes = [0; ROWS];
        for (code, status) in codes.iter_mut().zip(estimate.status.iter()) {
            *code = match status {
                RowStatus::Decoded => 0,
                RowStatus::MissingReading => 1,
                RowStatus::Overflow => 2,
                RowStatus::AtRest => EstimateReport::ROW_AT_REST,
            };
        }
        let row_status = codes.get(..self.rows).unwrap_or_default();
        let outputs = Floats::new(estimate.outputs);
        let with_deviations = novelty.is_some() && sent == ConfidenceSent::Deviations;
        let deviations = if with_deviations { self.outputs } else { 0 };
        let deviation = Floats::new(self.deviations.get(..deviations).unwrap_or_default());
        let report =
            EstimateReport { frame, start_us, flags, row_status, outputs, novelty, deviation };
        self.line.send(number, &Report::Estimate(report), &mut self.statistics);
    }

    /// Adds the frame to the baseline that is being captured, and answers the request when the baseline is
    /// complete.
    fn feed_baseline(&mut self, decoder: Option<&Decoder<'_, ROWS>>) {
        let Some(capture) = &mut self.capture else { return };
        self.baseline.add(self.frame);
        capture.left = capture.left.saturating_sub(1);
        let (number, left) = (capture.number, capture.left);
        if left == 0 {
            self.capture = None;
            self.decode_baseline(decoder);
            let report = Report::Baseline { readings_ohm: Floats::new(self.baseline.mean()) };
            self.line.send(number, &report, &mut self.statistics);
        }
    }

    /// Takes the baseline's reciprocals, decodes it with the model in force, and keeps the outputs for rows at rest.
    pub(super) fn decode_baseline(&mut self, decoder: Option<&Decoder<'_, ROWS>>) {
        let known = self.baseline.frames() > 0;
        self.reciprocals.fill(f32::NAN);
        for (place, mean) in self.reciprocals.iter_mut().zip(self.baseline.mean()).filter(|_| known)
        {
            *place = reciprocal(*mean);
        }
        self.has_reciprocals = self.reciprocals.iter().any(|reciprocal| !reciprocal.is_nan());
        let mut rest = cut(&mut self.rest, self.rows, self.outputs);
        let decoded = decoder.filter(|_| known).is_some_and(|decoder| {
            let readings_ohm = self.baseline.mean();
            let frame = Frame { readings_ohm, reciprocals: self.reciprocals, gate: None };
            decoder.decode_into(frame, self.scratch, &mut rest).is_ok()
        });
        if !decoded {
            rest.status.fill(RowStatus::MissingReading);
        }
    }

    /// Replaces the frame with the `readings` (Ω) of a request, as many as are scanned.
    pub(super) fn set_frame(&mut self, readings: impl Iterator<Item = f32>) {
        let frame = self.readings();
        frame.iter_mut().zip(readings).for_each(|(place, reading)| *place = reading);
    }
}

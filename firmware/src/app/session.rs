//! A session: the application's loop while one model is in force.

use taxel_core::Decoder;
use taxel_core::blob::{Columns, Floats};

use super::model::{InForce, candidates, check_head, choose, copy_to};
use super::sensor::Scan;
use super::session_end::SessionEnd;
use super::{App, Core};
use crate::link::message::{EstimateReport, Report};
use crate::link::packet::UNASKED;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::store::{ConfirmedModels, Slot, blob_in_slot};

/// The application with the model in force, whose memory it borrows, and with the spare slot.
pub struct Session<'a, 'm, P, F, S, const ROWS: usize> {
    pub(super) app: &'a mut App<'m, P, F, ROWS>,
    pub(super) model: InForce<'a, ROWS>,
    pub(super) spare: &'a mut S,
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
        let Core { models, link, .. } = &mut app.core;
        models.confirmed = ConfirmedModels::read(link.platform().journal(), slots);
        let (capacity, confirmed) = (models.capacity, models.confirmed);
        let candidates = candidates(slots, &confirmed, models.slot_on_trial());
        let best = candidates.into_iter().flatten().next();
        // Only the copy is checked, so the best model is looked at once.
        let bytes = best.and_then(|best| slots.get(best.slot)).map_or(&[][..], S::bytes);
        let mut model = InForce::NONE;
        let copied =
            best.and_then(|best| model.load(capacity, copy_to(weights, bytes)?, best, true));
        let chosen = if copied.is_some() { best } else { choose(capacity, slots, candidates) };
        models.end_trial_unless(chosen.is_some_and(|chosen| chosen.on_trial));
        let slot = chosen.map(|chosen| chosen.slot);
        let [first, second] = slots;
        let (active, spare) = if slot == Some(1) { (&*second, first) } else { (&*first, second) };
        if let (None, Some(chosen)) = (copied, chosen) {
            // Without a model if that fails.
            let _ = model.load(capacity, active.bytes(), chosen, false);
        }
        if let Some(model) = &mut model.identity {
            model.generation = confirmed.generation.wrapping_add(u32::from(model.on_trial));
            info!(
                "model {=u32:08x} in force, slot {=u8}, generation {=u32}, in RAM: {=bool}",
                model.crc_32, model.slot, model.generation, model.in_ram
            );
        } else {
            warning!("no model in either slot: readings only, until one is uploaded");
        }
        // Behind an uploaded model in slot 1, the spare slot is slot 0. For a line of the log, the blob's head will do.
        if slot == Some(1)
            && !confirmed.has(0, spare.bytes())
            && check_head(capacity, blob_in_slot(spare.bytes())).is_ok()
        {
            info!("slot 0 holds a model that was flashed, not uploaded: it is not used");
        }
        app.core.take_shape_of(model.decoder.as_ref());
        let is_copy = model.identity.is_some_and(|identity| identity.in_ram);
        model.stored = active.bytes().get(..model.blob.len()).filter(|_| is_copy);
        Self { app, model, spare }
    }

    /// Runs one turn of the loop: answers at most one request, and scans a frame if one is due.
    pub fn step(&mut self) -> Option<SessionEnd> {
        self.app.core.link.begin_turn();
        let end = self.serve_link().or_else(|| {
            let Core { models, link, .. } = &mut self.app.core;
            models.end_late_trial(link)
        });
        self.app.core.scan_if_due(&self.model);
        self.app.core.feed_watchdog();
        end
    }
}

impl<P: Platform, F: FrameSource, const ROWS: usize> Core<'_, P, F, ROWS> {
    /// Makes frames and estimates as long as the model's, and takes the baseline. A baseline of other wires is replaced by the one that is kept, if that fits.
    fn take_shape_of(&mut self, decoder: Option<&Decoder<'_, ROWS>>) {
        let Self { sensor, models, link, work } = self;
        let capacity = models.capacity;
        let shape = decoder.map_or(capacity.wires_as_shape(), Decoder::shape);
        let names = decoder.map_or(Columns(""), |decoder| decoder.metadata().input_names);
        work.rows = shape.rows;
        work.outputs = shape.rows.saturating_mul(shape.outputs);
        // Behind forces along x and y comes the one along z.
        let units = decoder.map_or(Columns(""), |decoder| decoder.metadata().output_units);
        work.force =
            units.iter().enumerate().filter(|(_, unit)| *unit == "N").map(|it| it.0).last();
        sensor.scan_wires(capacity, names, shape, link);
        if sensor.baseline.frames() == 0 && sensor.capture.is_none() {
            sensor.load_baseline(link);
        }
        work.take_baseline(&sensor.baseline);
    }

    /// Scans frames, decodes the one that is complete and reports on it.
    fn scan_if_due(&mut self, model: &InForce<'_, ROWS>) {
        let Self { sensor, link, work, .. } = self;
        let Some((frame, scan)) = sensor.scan_if_due(work.scratch, link) else { return };
        let Scan { start_us, missed, .. } = scan;
        let every = sensor.configuration.report_every;
        let is_reported = frame.checked_rem(every.into()) == Some(0);
        let (mut flags, health) = work.decode(sensor, Some(scan), is_reported, link, model);
        let is_touched = flags & EstimateReport::CONTACT != 0;
        work.tell_events(&sensor.configuration, (frame, start_us), is_touched, link);
        let (sent, decoder) = (sensor.configuration.confidence, model.decoder.as_ref());
        let novelty = work.assess(sensor.frame(), link, decoder, sent, &mut flags);
        if let Some(number) = sensor.feed_baseline() {
            work.take_baseline(&sensor.baseline);
            let readings_ohm = Floats::new(sensor.baseline.mean());
            link.send(number, &Report::Baseline { readings_ohm });
        }
        if !is_reported {
            return;
        }
        if !health.is_good() {
            sensor.send_health(frame, start_us, health, link);
        }
        if sensor.configuration.send_estimates {
            flags |= if missed > 0 { EstimateReport::OVERRUN } else { 0 };
            work.send_estimate(UNASKED, (frame, start_us), flags, (novelty, sent), link);
        }
    }

    /// Feeds the watchdog, unless the last scan gave no reading at all. A sensor that stays silent thus leads to a
    /// restart, which sets up its bus again.
    fn feed_watchdog(&mut self) {
        if self.sensor.answers {
            self.link.platform().feed_watchdog();
        } else {
            let bad = &mut self.link.statistics.bad_loops;
            *bad = bad.saturating_add(1);
        }
    }
}

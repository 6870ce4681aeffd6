//! A session: the application's loop while one model is in force.

use model_core::blob::Floats;
use model_core::health::{Health, Limits};
use model_core::{Decoder, Frame, Gate, RowStatus};

use super::{App, Core};
use crate::link::message::{EstimateReport, HealthReport, ModelIdentity, Report};
use crate::link::packet::UNASKED;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::store::{Slot, blob_in_slot, generation};

/// Why a session ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leave {
    /// Another model was committed, and must be put in force.
    NewModel,
    /// The host asked for a restart.
    Restart,
}

/// The application with the model in force, whose slot it borrows, and with the spare slot.
pub struct Session<
    'a,
    'm,
    P: Platform,
    F,
    S,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> {
    pub(super) app: &'a mut App<'m, P, F, ROWS, COLS, OUTPUTS, BYTES>,
    pub(super) model: InForce<'a, ROWS, COLS, OUTPUTS>,
    pub(super) spare: &'a mut S,
}

/// The model in force, if there is one.
pub(super) struct InForce<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize> {
    pub decoder: Option<Decoder<'a, ROWS, COLS, OUTPUTS>>,
    pub identity: Option<ModelIdentity>,
}

impl<
    'a,
    'm,
    P: Platform,
    F: FrameSource<ROWS, COLS>,
    S: Slot,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> Session<'a, 'm, P, F, S, ROWS, COLS, OUTPUTS, BYTES>
{
    /// Starts a session with the most recent sound model in force.
    #[inline(never)] // so that its stack is free again when the loop begins
    pub fn start(
        app: &'a mut App<'m, P, F, ROWS, COLS, OUTPUTS, BYTES>,
        slots: &'a mut [S; 2],
    ) -> Self {
        let chosen = App::<'m, P, F, ROWS, COLS, OUTPUTS, BYTES>::choose(slots);
        let [first, second] = slots;
        let (active, spare) = match chosen {
            Some((1, _)) => (&*second, first),
            _ => (&*first, second),
        };
        let decoder = chosen.and_then(|_| Decoder::load(blob_in_slot(active.bytes())).ok());
        let identity = chosen.zip(decoder.as_ref()).map(|((slot, generation), decoder)| {
            ModelIdentity { crc_32: decoder.model_crc(), slot: slot as u8, generation }
        });
        if let Some(model) = &identity {
            info!(
                "model {=u32:08x} in force, slot {=u8}, generation {=u32}",
                model.crc_32, model.slot, model.generation
            );
        } else {
            warning!("no model in either slot: readings only, until one is uploaded");
        }
        // Behind an uploaded model in slot 1, the spare slot is slot 0.
        if chosen.is_some_and(|(slot, _)| slot == 1)
            && generation(0, spare.bytes()) == Some(0)
            && Decoder::<ROWS, COLS, OUTPUTS>::check(blob_in_slot(spare.bytes())).is_ok()
        {
            info!("slot 0 holds a model that was flashed, not uploaded: it is not used");
        }
        app.core.decode_baseline(decoder.as_ref());
        Self { app, model: InForce { decoder, identity }, spare }
    }

    /// Runs one turn of the loop: answers at most one request, and scans a frame if one is due.
    ///
    /// The watchdog is fed at the end, unless the last scan gave no reading at all. A sensor that stays silent
    /// thus leads to a restart, which sets up its bus again.
    pub fn step(&mut self) -> Option<Leave> {
        let leave = self.serve_link();
        let core = &mut self.app.core;
        let now_us = core.line.platform().now_us();
        if let Some(missed) = core.clock.due(now_us, core.configuration.frame_period_us) {
            core.sensor_answers = core.scan(missed, self.model.decoder.as_ref());
        }
        if core.sensor_answers {
            core.line.platform().feed_watchdog();
        } else {
            core.statistics.bad_loops = core.statistics.bad_loops.saturating_add(1);
        }
        leave
    }
}

impl<
    P: Platform,
    F: FrameSource<ROWS, COLS>,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> Core<'_, P, F, ROWS, COLS, OUTPUTS, BYTES>
{
    /// Scans a frame and reports on it; returns whether it has at least one reading.
    fn scan(&mut self, missed: u32, decoder: Option<&Decoder<'_, ROWS, COLS, OUTPUTS>>) -> bool {
        let start_us = self.line.platform().now_us();
        let report = self.source.scan(self.configuration.scan, self.frame);
        let scan_us = self.line.platform().now_us().wrapping_sub(start_us);

        let s = &mut self.statistics;
        s.frames_scanned = s.frames_scanned.saturating_add(1);
        s.frames_missed = s.frames_missed.saturating_add(missed);
        s.failed_samples = s.failed_samples.saturating_add(u32::from(report.failed_samples));
        s.longest_scan_us = s.longest_scan_us.max(scan_us);
        let frame = s.frames_scanned;
        let overrun = if missed > 0 { EstimateReport::OVERRUN } else { 0 };

        let readings = self.frame.row_column_resistance_ohm.as_flattened();
        let any = readings.iter().any(|reading| !reading.is_nan());
        if self.configuration.send_readings {
            let readings_ohm = Floats::of(readings);
            let sent = self.line.send(UNASKED, &Report::Readings { frame, readings_ohm });
            self.count_lost(sent);
        }
        let (flags, health) = self.decode(decoder);
        self.feed_baseline(decoder);
        if !health.is_good() {
            let faulty = health.faulty_columns.map(u32::to_le_bytes);
            let report = HealthReport {
                frame,
                missing: health.missing,
                shorted: health.shorted,
                open: health.open,
                faulty_columns: faulty.as_flattened(),
            };
            let sent = self.line.send(UNASKED, &Report::Health(report));
            self.count_lost(sent);
        }
        if self.configuration.send_estimates {
            self.send_estimate(UNASKED, frame, flags | overrun);
        }
        any
    }

    /// Decodes the frame without its faulty readings.
    pub(super) fn decode(
        &mut self,
        decoder: Option<&Decoder<'_, ROWS, COLS, OUTPUTS>>,
    ) -> (u8, Health<ROWS>) {
        let start_us = self.line.platform().now_us();
        let limits = Limits {
            shorted_below_ohm: self.configuration.shorted_below_ohm,
            open_above_ohm: self.configuration.open_above_ohm,
        };
        let health = Health::of(self.frame, limits);
        let mut flags = if health.is_good() { 0 } else { EstimateReport::FAULTY_READING };
        if let Some(decoder) = decoder {
            let captured = self.capture.is_none() && self.baseline.frames() > 0;
            let gate = captured.then(|| {
                Gate::new(self.baseline.mean(), self.rest, self.configuration.rest_tolerance)
            });
            decoder.decode_gated_into(self.frame, gate.flatten(), self.estimate);
            if self.estimate.status.contains(&RowStatus::Overflow) {
                flags |= EstimateReport::OVERFLOW;
            }
        } else {
            self.estimate.outputs = [[f32::NAN; OUTPUTS]; ROWS];
            self.estimate.status = [RowStatus::MissingReading; ROWS];
            flags |= EstimateReport::NO_MODEL;
        }
        let change = self.baseline.largest_relative_deviation(self.frame);
        let contact = change.is_some_and(|change| change > self.configuration.contact_threshold);
        if contact && self.capture.is_none() {
            flags |= EstimateReport::CONTACT;
        }
        let decode_us = self.line.platform().now_us().wrapping_sub(start_us);
        let at_rest = self.estimate.status.iter().filter(|status| **status == RowStatus::AtRest);
        let s = &mut self.statistics;
        s.rows_at_rest = s.rows_at_rest.saturating_add(at_rest.count() as u32);
        s.frames_decoded = s.frames_decoded.saturating_add(1);
        s.longest_decode_us = s.longest_decode_us.max(decode_us);
        (flags, health)
    }

    /// Sends the estimate, either as the answer to request `number` or unasked.
    pub(super) fn send_estimate(&mut self, number: u16, frame: u32, flags: u8) {
        let row_status = self.estimate.status.map(|status| match status {
            RowStatus::Decoded => 0,
            RowStatus::MissingReading => 1,
            RowStatus::Overflow => 2,
            RowStatus::AtRest => EstimateReport::ROW_AT_REST,
        });
        let outputs = Floats::of(self.estimate.outputs.as_flattened());
        let report = EstimateReport { frame, flags, row_status: &row_status, outputs };
        let sent = self.line.send(number, &Report::Estimate(report));
        self.count_lost(sent);
    }

    /// Adds the frame to the baseline that is being captured, and answers the request when the baseline is
    /// complete.
    fn feed_baseline(&mut self, decoder: Option<&Decoder<'_, ROWS, COLS, OUTPUTS>>) {
        let Some((number, left)) = self.capture else { return };
        self.baseline.add(self.frame);
        self.capture = left.checked_sub(1).filter(|left| *left > 0).map(|left| (number, left));
        if self.capture.is_none() {
            self.decode_baseline(decoder);
            let mean = self.baseline.mean().row_column_resistance_ohm.as_flattened();
            let sent = self.line.send(number, &Report::Baseline { readings_ohm: Floats::of(mean) });
            self.count_lost(sent);
        }
    }

    /// Decodes the baseline with the model in force, and keeps the outputs for rows at rest.
    pub(super) fn decode_baseline(&mut self, decoder: Option<&Decoder<'_, ROWS, COLS, OUTPUTS>>) {
        if let Some(decoder) = decoder {
            decoder.decode_into(self.baseline.mean(), self.rest);
        }
    }

    pub(super) fn count_lost(&mut self, sent: bool) {
        if !sent {
            self.statistics.lost_reports = self.statistics.lost_reports.saturating_add(1);
        }
    }

    /// Replaces the frame with the `readings` (Ω) of a request.
    pub(super) fn set_frame(&mut self, readings: impl Iterator<Item = f32>) {
        *self.frame = Frame::missing();
        let places = self.frame.row_column_resistance_ohm.as_flattened_mut();
        places.iter_mut().zip(readings).for_each(|(place, reading)| *place = reading);
    }
}

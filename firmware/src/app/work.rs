//! Decoding: the memory for it, and what is reported of a frame.

use core::mem;

use taxel_core::blob::Floats;
use taxel_core::events::{Events, Kind, Shown};
use taxel_core::filter::{State, Track};
use taxel_core::health::Health;
use taxel_core::relative::reciprocal;
use taxel_core::track::{self, Sizes, Tracker};
use taxel_core::{Decoder, Estimate, Frame, RowStatus};

use super::buffers::cut;
use super::link::Link;
use super::model::InForce;
use super::sensor::{Scan, Sensor};
use super::wiring::Wiring;
use crate::link::message::{
    ConfidenceSent, Configuration, EstimateReport, EventReport, Report, Statistics,
};
use crate::link::packet::UNASKED;
use crate::platform::Platform;
use crate::readout::{Baseline, FrameSource, RowTimes};

/// Memory of a decoder, and its results.
pub struct Work<'m, const ROWS: usize> {
    /// Rows of the model in force, and outputs of all of them; without a model, rows that are scanned and 0.
    pub rows: usize,
    pub outputs: usize,
    /// One over each reading of the last complete baseline; NaN without one.
    pub reciprocals: &'m mut [f32],
    /// Whether at least one reading has a reciprocal, so that a model with relative inputs may decode, and a tracker need not
    /// take the blob's resistances at rest.
    pub has_reciprocals: bool,
    /// Room for the readings of a frame before any is filled.
    pub measured: &'m mut [f32],
    /// Working space of a decoder.
    pub scratch: &'m mut [f32],
    pub estimate: Estimate<'m>,
    /// State of the filter in time.
    pub filter: State<&'m mut [Track]>,
    /// State of the tracker of a contact.
    pub contact: &'m mut track::State,
    pub events: Events,
    /// Whether the tracker followed the contact to the frame that was decoded last.
    pub is_followed: bool,
    /// Index of the force among the model's outputs, if it has one.
    pub force: Option<usize>,
    /// Standard deviations of the outputs, for a model that estimates them.
    pub deviations: &'m mut [f32],
}

impl<const ROWS: usize> Work<'_, ROWS> {
    /// Decodes the sensor's frame without its faulty readings, unless the model's tracker explains it: by the network,
    /// whose estimate passes the filter in time. A frame that is not of a `scan`, one of a series, is decoded by itself.
    /// The tracker writes outputs only where they are wanted.
    pub fn decode<P: Platform, F: FrameSource>(
        &mut self,
        sensor: &mut Sensor<'_, F, ROWS>,
        scan: Option<Scan>,
        wants_outputs: bool,
        link: &mut Link<'_, P>,
        model: &InForce<'_, ROWS>,
    ) -> (u8, Health) {
        let (start_us, start_cycles) = now(link);
        let health = sensor.judge_frame();
        let mut flags = if health.is_good() { 0 } else { EstimateReport::FAULTY_READING };
        let is_touched = sensor.is_touched(scan.is_some());
        if scan.is_some() && sensor.configuration.frame_period_us > 0 {
            // A touch need not wait until the frame is decoded.
            link.platform().signal([
                is_touched,
                self.events.is_on(Kind::Load),
                self.events.is_on(Kind::Slip),
            ]);
        }
        if is_touched {
            flags |= EstimateReport::CONTACT;
        }
        if let Some(decoder) = &model.decoder {
            let Configuration { track, filter_lead_us, .. } = sensor.configuration;
            let tracker = model.tracker.filter(|_| track);
            let frame = sensor.frame_mut();
            if tracker.is_some() {
                self.measured.iter_mut().zip(&*frame).for_each(|(place, ohm)| *place = *ohm);
            }
            if !health.is_good() {
                decoder.fill(frame, self.reciprocals, self.scratch);
            }
            if mem::take(&mut sensor.is_configured_anew) {
                self.filter.restart();
                self.contact.restart();
                self.events = Events::default();
            }
            let lacks_baseline = decoder.metadata().relative_inputs && !self.has_reciprocals;
            if lacks_baseline {
                flags |= EstimateReport::NO_BASELINE;
            }
            let mut row_us = [0.0; ROWS];
            let tracked = scan.zip(tracker).filter(|_| !lacks_baseline);
            let tracked = tracked.map(|(scan, tracker)| {
                let frame = track::Frame {
                    readings_ohm: self.measured,
                    reciprocals: self.has_reciprocals.then_some(&*self.reciprocals),
                    start_us: scan.start_us,
                    row_us: row_times(scan, &sensor.wiring, tracker, &mut row_us),
                };
                (tracker, frame)
            });
            let contact = &mut *self.contact;
            let mut estimate = cut(&mut self.estimate, self.rows, self.outputs);
            let mut decoded = Ok(false);
            let mut is_tracked = tracked.is_some_and(|(it, frame)| it.follow(contact, &frame));
            self.is_followed = is_tracked;
            if !is_tracked {
                decoded = decoder.decode_into(
                    Frame { readings_ohm: sensor.frame(), reciprocals: self.reciprocals },
                    self.scratch,
                    &mut estimate,
                );
                is_tracked =
                    tracked.is_some_and(|(it, frame)| it.start(contact, &frame, &estimate));
            }
            if let Some((tracker, _)) = tracked.filter(|_| is_tracked) {
                estimate.status.fill(RowStatus::Decoded);
                if wants_outputs {
                    tracker.write(contact, filter_lead_us as f32, &mut estimate);
                }
            }
            if let Some(Scan { start_us, .. }) = scan.filter(|_| !is_tracked) {
                self.filter.filter(sensor.configuration.filter(), start_us, &mut estimate);
            }
            if decoded == Ok(true) && !is_tracked {
                flags |= EstimateReport::CLAMPED;
                let clamped = &mut link.statistics.frames_clamped;
                *clamped = clamped.saturating_add(1);
            }
            // The model's shape was found to fit when it came into force.
            if decoded.is_err() || estimate.status.contains(&RowStatus::Overflow) {
                flags |= EstimateReport::OVERFLOW;
            }
        } else {
            cut(&mut self.estimate, self.rows, 0).status.fill(RowStatus::MissingReading);
            flags |= EstimateReport::NO_MODEL;
        }
        let (end_us, end_cycles) = now(link);
        let (us, cycles) = (end_us.wrapping_sub(start_us), end_cycles.wrapping_sub(start_cycles));
        self.count_decoded(us, cycles, &mut link.statistics);
        (flags, health)
    }

    /// Shows on the board's pins what goes on in the scan that was decoded last, and reports what it changed.
    pub fn tell_events<P: Platform>(
        &mut self,
        configuration: &Configuration,
        (frame, start_us): (u32, u64),
        is_touched: bool,
        link: &mut Link<'_, P>,
    ) {
        let outputs = cut(&mut self.estimate, self.rows, self.outputs).outputs;
        let load = match self.force {
            _ if self.is_followed => self.contact.depth_mm(),
            Some(place) => outputs.get(place).copied().unwrap_or(f32::NAN),
            None => outputs.iter().copied().fold(0.0, f32::max),
        };
        let place_mm = self.contact.place_mm().filter(|_| self.is_followed);
        let shown = Shown { start_us, is_touched, load, place_mm };
        self.events.update(configuration.events(), shown);
        link.platform().signal(Kind::ALL.map(|kind| self.events.is_on(kind)));
        let bits = |of: [bool; 3]| of.iter().rev().fold(0, |bits, bit| 2 * bits + u8::from(*bit));
        let changed = bits(Kind::ALL.map(|kind| self.events.changed(kind).is_some()));
        if changed != 0 {
            let going_on = bits(Kind::ALL.map(|kind| self.events.is_on(kind)));
            let after_us = link.now_us().wrapping_sub(start_us) as u32;
            let report = EventReport { frame, start_us, after_us, changed, going_on };
            link.send(UNASKED, &Report::Event(report));
        }
    }

    fn count_decoded(&mut self, us: u32, cycles: u32, s: &mut Statistics) {
        let status = cut(&mut self.estimate, self.rows, 0).status;
        // A row without a reading is not decoded, which takes no time.
        let is_whole = !status.contains(&RowStatus::MissingReading);
        s.frames_decoded = s.frames_decoded.saturating_add(1);
        s.longest_decode_us = s.longest_decode_us.max(us);
        s.longest_decode_cycles = s.longest_decode_cycles.max(cycles);
        if is_whole && (s.shortest_decode_cycles == 0 || cycles < s.shortest_decode_cycles) {
            s.shortest_decode_cycles = cycles;
        }
    }

    /// Computes the confidence of the frame that was decoded last, unless nothing of it is `wanted`. Returns the frame's
    /// novelty if the model estimates it, and adds to the `flags` whether it is novel.
    pub fn assess<P: Platform>(
        &mut self,
        frame_ohm: &[f32],
        link: &mut Link<'_, P>,
        decoder: Option<&Decoder<'_, ROWS>>,
        wanted: ConfidenceSent,
        flags: &mut u8,
    ) -> Option<f32> {
        let decoder = decoder.filter(|_| wanted != ConfidenceSent::Nothing)?;
        let (start_us, start_cycles) = now(link);
        let reciprocals = self.reciprocals.get(..frame_ohm.len()).unwrap_or_default();
        let frame = Frame { readings_ohm: frame_ohm, reciprocals };
        let deviation = self.deviations.get_mut(..self.outputs).unwrap_or_default();
        // The model's sizes were found to fit when it came into force.
        let novelty = decoder.assess_into(frame, self.scratch, deviation).ok().flatten()?;
        let (end_us, end_cycles) = now(link);
        let (us, cycles) = (end_us.wrapping_sub(start_us), end_cycles.wrapping_sub(start_cycles));
        let s = &mut link.statistics;
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
    pub fn send_estimate<P: Platform>(
        &mut self,
        number: u16,
        (frame, start_us): (u32, u64),
        flags: u8,
        (novelty, sent): (Option<f32>, ConfidenceSent),
        link: &mut Link<'_, P>,
    ) {
        let estimate = cut(&mut self.estimate, self.rows, self.outputs);
        let mut codes = [0; ROWS];
        for (code, status) in codes.iter_mut().zip(estimate.status.iter()) {
            *code = match status {
                RowStatus::Decoded => 0,
                RowStatus::MissingReading => 1,
                RowStatus::Overflow => 2,
                RowStatus::NoTouch => 3,
            };
        }
        let row_status = codes.get(..self.rows).unwrap_or_default();
        let outputs = Floats::new(estimate.outputs);
        let with_deviations = novelty.is_some() && sent == ConfidenceSent::Deviations;
        let deviations = if with_deviations { self.outputs } else { 0 };
        let deviation = Floats::new(self.deviations.get(..deviations).unwrap_or_default());
        let report =
            EstimateReport { frame, start_us, flags, row_status, outputs, novelty, deviation };
        let sent = link.send(number, &Report::Estimate(report));
        if sent && number == UNASKED {
            let latency_us = link.now_us().wrapping_sub(start_us) as u32;
            let longest_us = &mut link.statistics.longest_latency_us;
            *longest_us = latency_us.max(*longest_us);
        }
    }

    /// Takes the baseline's reciprocals. The filter and the tracker start anew.
    pub fn take_baseline(&mut self, baseline: &Baseline<'_>) {
        let known = baseline.frames() > 0;
        self.reciprocals.fill(f32::NAN);
        for (place, mean) in self.reciprocals.iter_mut().zip(baseline.mean()).filter(|_| known) {
            *place = reciprocal(*mean);
        }
        self.filter.restart();
        self.contact.restart();
        self.has_reciprocals = self.reciprocals.iter().any(|reciprocal| !reciprocal.is_nan());
    }
}

/// Fills `row_us` with the times at which the tracker's rows were read, and returns them.
fn row_times<'t, const ROWS: usize>(
    Scan { row_times: RowTimes { first_us, step_us }, .. }: Scan,
    wiring: &Wiring<'_, ROWS>,
    tracker: Tracker<'_>,
    row_us: &'t mut [f32; ROWS],
) -> &'t [f32] {
    let Sizes { rows, columns, .. } = tracker.sizes();
    let row_us = row_us.get_mut(..rows).unwrap_or_default();
    for (row, us) in row_us.iter_mut().enumerate() {
        *us = first_us + step_us * wiring.scanned_row(row.saturating_mul(columns)) as f32;
    }
    row_us
}

/// The time in µs, and the count of the processor's cycles.
fn now<P: Platform>(link: &mut Link<'_, P>) -> (u32, u32) {
    let platform = link.platform();
    (platform.now_us(), platform.cycles())
}

//! Decoding: the memory for it, and what is reported of a frame.

use core::mem;

use taxel_core::blob::Floats;
use taxel_core::filter::{State, Track};
use taxel_core::health::Health;
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Estimate, Frame, RowStatus};

use super::buffers::cut;
use super::link::Link;
use super::sensor::Sensor;
use crate::link::message::{ConfidenceSent, EstimateReport, Report, Statistics};
use crate::link::packet::UNASKED;
use crate::platform::Platform;
use crate::readout::{Baseline, FrameSource};

/// Memory of a decoder, and its results.
pub struct Work<'m, const ROWS: usize> {
    /// Rows of the model in force, and outputs of all of them; without a model, rows that are scanned and 0.
    pub rows: usize,
    pub outputs: usize,
    /// One over each reading of the last complete baseline; NaN without one.
    pub reciprocals: &'m mut [f32],
    /// Whether at least one reading has a reciprocal, so that a model with relative inputs may decode.
    pub has_reciprocals: bool,
    /// Working space of a decoder.
    pub scratch: &'m mut [f32],
    pub estimate: Estimate<'m>,
    /// State of the filter in time.
    pub filter: State<&'m mut [Track]>,
    /// Standard deviations of the outputs, for a model that tells them.
    pub deviations: &'m mut [f32],
}

impl<const ROWS: usize> Work<'_, ROWS> {
    /// Decodes the sensor's frame without its faulty readings. The estimate of a frame that began at `filtered_us` passes
    /// the filter in time.
    pub fn decode<P: Platform, F: FrameSource>(
        &mut self,
        sensor: &mut Sensor<'_, F, ROWS>,
        filtered_us: Option<u64>,
        link: &mut Link<'_, P>,
        decoder: Option<&Decoder<'_, ROWS>>,
    ) -> (u8, Health) {
        let (start_us, start_cycles) = now(link);
        let (frame, health) = sensor.judge_frame();
        let mut flags = if health.is_good() { 0 } else { EstimateReport::FAULTY_READING };
        if let Some(decoder) = decoder {
            if !health.is_good() {
                decoder.fill(frame, self.reciprocals, self.scratch);
            }
            let mut estimate = cut(&mut self.estimate, self.rows, self.outputs);
            let decoded = decoder.decode_into(
                Frame { readings_ohm: sensor.frame(), reciprocals: self.reciprocals },
                self.scratch,
                &mut estimate,
            );
            if mem::take(&mut sensor.is_configured_anew) {
                self.filter.restart();
            }
            if let Some(start_us) = filtered_us {
                self.filter.filter(sensor.configuration.filter(), start_us, &mut estimate);
            }
            if decoder.metadata().relative_inputs && !self.has_reciprocals {
                flags |= EstimateReport::NO_BASELINE;
            }
            if decoded == Ok(true) {
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
        if sensor.is_touched(filtered_us.is_some()) {
            flags |= EstimateReport::CONTACT;
        }
        let (end_us, end_cycles) = now(link);
        let (us, cycles) = (end_us.wrapping_sub(start_us), end_cycles.wrapping_sub(start_cycles));
        self.count_decoded(us, cycles, &mut link.statistics);
        (flags, health)
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
    /// novelty if the model tells it, and adds to the `flags` whether it is novel.
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

    /// Takes the baseline's reciprocals. The filter starts anew.
    pub fn take_baseline(&mut self, baseline: &Baseline<'_>) {
        let known = baseline.frames() > 0;
        self.reciprocals.fill(f32::NAN);
        for (place, mean) in self.reciprocals.iter_mut().zip(baseline.mean()).filter(|_| known) {
            *place = reciprocal(*mean);
        }
        self.filter.restart();
        self.has_reciprocals = self.reciprocals.iter().any(|reciprocal| !reciprocal.is_nan());
    }
}

/// The time in µs, and the count of the processor's cycles.
fn now<P: Platform>(link: &mut Link<'_, P>) -> (u32, u32) {
    let platform = link.platform();
    (platform.now_us(), platform.cycles())
}

//! Answers that a device must give, and the model that it must have.

use std::time::Duration;

use taxel_core::filter::Settings;
use taxel_data::{Progress, Table};
use taxel_firmware::link::message::{Configuration, EstimateReport};
use taxel_learn::infer::is_missing;
use taxel_learn::tracked::{Series, decode_series};
use taxel_learn::{ModelBlob, PreparedModel};

use super::{Device, stream, upload};
use crate::error::{Result, check_room};

/// Frames that a device is to decode.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// Readings in Ω, in the columns of the model's inputs.
    pub readings: Table,
    /// Baseline in Ω of each of these columns, for a model with relative inputs or a tracker.
    pub baseline_ohm: Option<Vec<f64>>,
    /// Start of each frame in µs, for a filter.
    pub start_us: Vec<u64>,
}

/// Frames of a scene with the answers that the host computes.
pub(super) struct Expected {
    readings_ohm: Vec<f32>,
    outputs: Vec<f32>,
    per_frame: [usize; 2],
    /// Novelty and deviations of every frame; none of a model that tells neither.
    confidence: Vec<(f32, Vec<f32>)>,
    /// Baseline that the device needs, in Ω; NaN if it is to have none.
    baseline_ohm: Option<Vec<f32>>,
    /// Start of each frame in µs.
    start_us: Vec<u64>,
    /// Filter that the outputs have passed, and whether the model's tracker has written them.
    filter: Settings,
    is_tracked: bool,
}

impl Expected {
    /// Answers of the model of `blob` to `frames`, through this filter, else behind its tracker, and with their baseline
    /// if its inputs are relative or it tracks.
    pub(super) fn new(
        blob: &ModelBlob,
        Frames { readings, baseline_ohm, start_us }: &Frames,
        filter: Settings,
    ) -> Self {
        let (model, start_us) = (blob.prepare(), start_us.clone());
        let baseline_ohm = baseline_ohm.as_deref();
        let model = match baseline_ohm {
            Some(baseline) => model.with_baseline(baseline),
            None => model,
        };
        let is_tracked = model.model().tracker().is_some() && !filter.is_on();
        let filled = model.filled(&readings.values, None).map(|(values, _)| values);
        let values = filled.map_or_else(|| readings.values.clone(), Into::into);
        let filled = &Table { names: readings.names.clone(), values };
        let places = readings.values.iter().enumerate();
        let missing: Vec<usize> =
            places.filter(|(_, ohm)| is_missing(**ohm)).map(|(place, _)| place).collect();
        let series = Series { start_us: &start_us, faulty: &missing, baseline: baseline_ohm };
        let outputs = decode_series(&model, filled, series, filter);
        let f32s =
            |values: &[f64]| -> Vec<f32> { values.iter().map(|value| *value as f32).collect() };
        let per_frame = [readings.names.len(), outputs.names.len()];
        let none = is_tracked.then(|| vec![f32::NAN; per_frame[0]]); // for the one that a device may have
        let (baseline_ohm, readings_ohm) =
            (baseline_ohm.map(f32s).or(none), f32s(&readings.values));
        let confidence = confidence(&model, filled);
        let outputs = f32s(&outputs.values);
        Self {
            readings_ohm,
            outputs,
            per_frame,
            confidence,
            baseline_ohm,
            start_us,
            filter,
            is_tracked,
        }
    }

    /// Configuration of a device that filters, and takes readings beyond its limits, if there are any: other sensors read
    /// other numbers.
    fn configuration(&self) -> Configuration {
        let mut wanted = Configuration {
            frame_period_us: 0,
            filter_time_constant_us: self.filter.time_constant_us,
            filter_lead_us: self.filter.lead_us,
            track: self.is_tracked,
            ..Configuration::DEFAULT
        };
        let good = wanted.shorted_below_ohm..=wanted.open_above_ohm;
        if !self.readings_ohm.iter().all(|ohm| good.contains(ohm)) {
            [wanted.shorted_below_ohm, wanted.open_above_ohm] = [f32::NEG_INFINITY, f32::INFINITY];
        }
        wanted
    }

    /// Whether the `estimate` has the time and the outputs of frame number `frame`, and its novelty and deviations.
    pub(super) fn is_same(&self, frame: u32, estimate: &EstimateReport<'_>) -> bool {
        let confidence = self.confidence.get(frame as usize);
        let expected = confidence.map_or(&[][..], |(_, deviation)| deviation);
        let deviation = estimate.deviation.iter().map(f32::to_bits);
        Some(&estimate.start_us) == self.start_us.get(frame as usize)
            && estimate.novelty.map(f32::to_bits)
                == confidence.map(|(novelty, _)| novelty.to_bits())
            && deviation.eq(expected.iter().map(|value| value.to_bits()))
            && Self::is_line(&self.outputs, frame, self.per_frame[1], estimate.outputs.iter())
    }

    fn is_line(all: &[f32], line: u32, width: usize, found: impl Iterator<Item = f32>) -> bool {
        let start = line as usize * width;
        all.get(start..start + width).is_some_and(|expected| {
            found.map(f32::to_bits).eq(expected.iter().map(|value| value.to_bits()))
        })
    }

    /// Number of the first `frames` that the device decodes bit for bit, and the time that it took.
    pub(super) fn count_same(
        &self,
        device: &mut Device,
        frames: usize,
        window: usize,
        progress: &dyn Progress,
    ) -> Result<(usize, Duration)> {
        let mut same = 0;
        device.pause()?; // what is configured next is another configuration, and starts the filter anew
        device.configure(self.configuration())?;
        self.baseline_ohm.as_deref().map_or(Ok(()), |baseline| device.set_baseline(baseline))?;
        progress.stage("decoding on the device", frames);
        let window = if self.filter.is_on() || self.is_tracked { 1 } else { window };
        let readings_ohm = &self.readings_ohm[..frames * self.per_frame[0]];
        let start_us = &self.start_us[..frames];
        let take = |frame, estimate: &EstimateReport<'_>| {
            same += usize::from(self.is_same(frame, estimate));
            progress.step();
        };
        let time = stream::decode_frames(device, readings_ohm, start_us, window, take)?;
        Ok((same, time))
    }
}

/// Novelty and deviations of all frames of `readings` by `model`, if it tells them.
fn confidence(model: &PreparedModel<'_>, readings: &Table) -> Vec<(f32, Vec<f32>)> {
    let Some((deviations, novelty)) = model.assess(&readings.values) else { return vec![] };
    let of_a_frame = deviations.len() / novelty.len().max(1);
    let of_frames = deviations.chunks_exact(of_a_frame.max(1));
    let of_frames = of_frames.map(|of| of.iter().map(|deviation| *deviation as f32).collect());
    novelty.into_iter().map(|novelty| novelty as f32).zip(of_frames).collect()
}

/// Activates the model of `blob` unless it is active already.
pub(super) fn prepare(
    device: &mut Device,
    blob: &ModelBlob,
    progress: &dyn Progress,
) -> Result<()> {
    let identity = device.identify()?;
    let model = blob.parse();
    check_room(identity.capacity(), &model)?;
    if !identity.has_in_force(model.crc()) {
        upload::replace(device, blob.bytes(), progress)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use taxel_core::blob::Floats;

    use super::*;

    fn estimate<'a>(outputs: &'a [f32], deviation: &'a [f32]) -> EstimateReport<'a> {
        let novelty = deviation.first().map(|_| -2.5);
        EstimateReport {
            outputs: Floats::new(outputs),
            novelty,
            deviation: Floats::new(deviation),
            ..Default::default()
        }
    }

    /// Two frames with these novelties and deviations.
    fn expected(confidence: Vec<(f32, Vec<f32>)>) -> Expected {
        Expected {
            readings_ohm: vec![60.0; 4],
            outputs: vec![0.5, -0.25, 0.0, 1.0],
            per_frame: [2, 2],
            confidence,
            baseline_ohm: None,
            start_us: vec![0; 2],
            filter: Settings::default(),
            is_tracked: false,
        }
    }

    #[test]
    fn one_bit_of_an_output_or_a_confidence_makes_frames_differ() {
        let plain = expected(Vec::new());
        assert!(plain.is_same(1, &estimate(&[0.0, 1.0], &[])));
        assert!(!plain.is_same(1, &estimate(&[0.0, 1.0], &[0.5, 0.5])));
        let next = f32::from_bits(1.0_f32.to_bits() + 1);
        for wrong in [&[0.0, next][..], &[-0.0, 1.0], &[0.0], &[0.0, 1.0, 2.0], &[0.5, -0.25]] {
            assert!(!plain.is_same(1, &estimate(wrong, &[])), "{wrong:?}");
        }
        assert!(!plain.is_same(2, &estimate(&[], &[])));
        let sure = expected(vec![(0.5, vec![1.0, 1.0]), (-2.5, vec![0.125, 0.25])]);
        let good = estimate(&[0.0, 1.0], &[0.125, 0.25]);
        assert!(sure.is_same(1, &good));
        for novelty in [Some(-2.25), None] {
            assert!(!sure.is_same(1, &EstimateReport { novelty, ..good }));
        }
        for wrong in [&[0.125, 0.5][..], &[0.125], &[]] {
            assert!(!sure.is_same(1, &estimate(&[0.0, 1.0], wrong)), "{wrong:?}");
        }
    }
}

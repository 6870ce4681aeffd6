//! Answers that a device must give, and the model that it must have.

use std::time::Duration;

use firmware::link::message::Configuration;
use model_core::blob::Model;
use taxel_data::progress::Progress;
use taxel_data::table::Table;
use taxel_learn::{Exponential, ModelBlob, PreparedModel};

use super::{Device, DeviceIdentity, Wire, stream, upload};
use crate::error::{Error, Result};

/// Frames of a scene with the answers that the host computes.
pub(super) struct Expected {
    readings_ohm: Vec<f32>,
    outputs: Vec<f32>,
    per_frame: [usize; 2],
    /// Baseline that the device needs, in Ω.
    baseline_ohm: Option<Vec<f32>>,
}

impl Expected {
    /// Answers of `model` to `readings`, with the exponential that it was prepared with, and with this baseline if
    /// its inputs are relative.
    pub(super) fn new(
        model: PreparedModel<'_>,
        readings: &Table,
        baseline_ohm: Option<&[f64]>,
    ) -> Self {
        let model = match baseline_ohm {
            Some(baseline) => model.with_baseline(baseline),
            None => model,
        };
        let outputs = model.decode_table(readings);
        let f32s = |values: &[f64]| values.iter().map(|value| *value as f32).collect();
        Self {
            baseline_ohm: baseline_ohm.map(f32s),
            readings_ohm: f32s(&readings.values),
            outputs: f32s(&outputs.values),
            per_frame: [readings.names.len(), outputs.names.len()],
        }
    }

    /// Gives the device the baseline that it needs, if any.
    pub(super) fn set_baseline<W: Wire>(&self, device: &mut Device<W>) -> Result<()> {
        self.baseline_ohm.as_deref().map_or(Ok(()), |baseline| device.set_baseline(baseline))
    }

    /// Lets the device take readings beyond its limits, if there are any: other sensors read other numbers.
    fn widen_limits<W: Wire>(&self, device: &mut Device<W>) -> Result<()> {
        let usual = Configuration::DEFAULT;
        let good = usual.shorted_below_ohm..=usual.open_above_ohm;
        if self.readings_ohm.iter().all(|ohm| good.contains(ohm)) {
            return Ok(());
        }
        let [shorted_below_ohm, open_above_ohm] = [f32::NEG_INFINITY, f32::INFINITY];
        device.configure(Configuration {
            frame_period_us: 0,
            shorted_below_ohm,
            open_above_ohm,
            ..usual
        })
    }

    fn first(&self, frames: usize) -> &[f32] {
        &self.readings_ohm[..frames * self.per_frame[0]]
    }

    /// Whether these are the readings of frame number `frame`.
    pub(super) fn was_read(&self, frame: u32, readings: impl Iterator<Item = f32>) -> bool {
        Self::is_line(&self.readings_ohm, frame, self.per_frame[0], readings)
    }

    /// Whether these are the outputs of frame number `frame`.
    pub(super) fn is_same(&self, frame: u32, outputs: impl Iterator<Item = f32>) -> bool {
        Self::is_line(&self.outputs, frame, self.per_frame[1], outputs)
    }

    fn is_line(all: &[f32], line: u32, width: usize, found: impl Iterator<Item = f32>) -> bool {
        let start = line as usize * width;
        all.get(start..start + width).is_some_and(|expected| {
            found.map(f32::to_bits).eq(expected.iter().map(|value| value.to_bits()))
        })
    }

    /// Number of the first `frames` that the device decodes bit for bit, and the time that it took.
    pub(super) fn count_same<W: Wire>(
        &self,
        device: &mut Device<W>,
        frames: usize,
        window: usize,
        progress: &dyn Progress,
    ) -> Result<(usize, Duration)> {
        let mut same = 0;
        self.widen_limits(device)?;
        self.set_baseline(device)?;
        progress.stage("decoding on the device", frames);
        let time = stream::decode_frames(
            device,
            self.first(frames),
            self.per_frame[0],
            window,
            |frame, estimate| {
                same += usize::from(self.is_same(frame, estimate.outputs.iter()));
                progress.step();
            },
        )?;
        Ok((same, time))
    }
}

/// Activates the model of `blob` unless it is active already, and returns the exponential that the
/// device decodes with.
pub(super) fn prepare<W: Wire>(
    device: &mut Device<W>,
    blob: &ModelBlob,
    progress: &dyn Progress,
) -> Result<Exponential> {
    let identity = device.identify()?;
    let model = blob.parse();
    let exponential = fitting_exponential(&identity, &model)?;
    if !identity.has_in_force(model.crc()) {
        upload::replace(device, blob.bytes(), progress)?;
    }
    Ok(exponential)
}

/// Exponential that the device decodes with, if the device has room for this model.
fn fitting_exponential(identity: &DeviceIdentity, model: &Model<'_>) -> Result<Exponential> {
    let (capacity, shape) = (identity.capacity(), model.shape());
    if capacity.wires_for(shape).is_none() {
        return Err(Error::NoRoom { capacity, shape });
    }
    Exponential::by_name(&identity.kernel)
        .ok_or_else(|| Error::UnknownExponential(identity.kernel.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_of_one_output_makes_a_frame_another() {
        let expected = Expected {
            readings_ohm: vec![60.0; 4],
            outputs: vec![0.5, -0.25, 0.0, 1.0],
            per_frame: [2, 2],
            baseline_ohm: None,
        };
        assert!(expected.is_same(1, [0.0, 1.0].into_iter()));
        let next = f32::from_bits(1.0_f32.to_bits() + 1);
        for wrong in [&[0.0, next][..], &[-0.0, 1.0], &[0.0], &[0.0, 1.0, 2.0], &[0.5, -0.25]] {
            assert!(!expected.is_same(1, wrong.iter().copied()), "{wrong:?}");
        }
        assert!(!expected.is_same(2, std::iter::empty()));
    }
}

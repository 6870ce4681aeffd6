//! Frames that points are trained and judged on, with one number of samples a reading.

use std::borrow::Cow;

use taxel_data::dataset::Dataset;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_learn::train::{Examples, projection};
use taxel_simulate::Synthesis;

use super::Plan;
use super::gating::Gates;
use crate::error::Result;
use crate::experiment::{Experiment, MoreFrames};
use crate::metrics::{LimitSummary, Measure};

/// Training and test frames with one number of samples a reading.
pub(super) struct Frames<'e> {
    pub samples_averaged: usize,
    /// Noise level of the averaged readings, as a fraction.
    pub noise_level: f64,
    pub training: Dataset,
    pub test: Dataset,
    /// Networks that see a row each, and networks that see the whole array.
    pub inputs: Vec<Inputs>,
    /// Measure of errors, with the limit once that is [known](Self::measure_beside_limit).
    pub measure: Measure,
    /// Source of more frames, if training is to be refined.
    more: Option<More<'e>>,
}

/// What networks see of a frame.
pub(super) struct Inputs {
    /// Projection of the whole array; `None` if each network sees the readings of its row.
    pub projection: Option<Vec<f32>>,
    pub gates: Gates,
}

/// Frames that only refinement sees.
pub(super) struct More<'e>(&'e Experiment, Synthesis<'e>);

impl Inputs {
    /// Whether one network sees the whole array.
    pub fn whole_array(&self) -> bool {
        self.projection.is_some()
    }
}

impl<'e> Frames<'e> {
    /// Frames of a scene with so many samples a reading, for networks of a row each, of the whole array, or both.
    pub fn of(
        experiment: &'e Experiment,
        samples_averaged: usize,
        arrays: &[bool],
        plan: &Plan,
    ) -> Result<Self> {
        let (world, t) = (&experiment.world, &experiment.training);
        let noise_level = world.noise.level / (samples_averaged as f64).sqrt();
        let frames = Synthesis::of(world).noise_level(noise_level);
        let training = experiment.dataset(&frames, Stream::Training, t.frames);
        let test = experiment.dataset(&frames, Stream::Test, t.test_frames);
        // The gate compares readings in Ω.
        let readings_ohm = if t.relative_inputs {
            Cow::Owned(frames.frames(Stream::Test, t.test_frames).inputs)
        } else {
            Cow::Borrowed(&test.inputs)
        };
        let inputs = |whole_array: &bool| {
            let projection = whole_array.then(|| projection::fit(&training, t.features));
            let kind = (*whole_array, t.relative_inputs);
            let gates = Gates::new(&frames, noise_level, &readings_ohm, &plan.gate_k, kind);
            Ok(Inputs { projection: projection.transpose()?, gates })
        };
        let inputs = arrays.iter().map(inputs).collect::<Result<_>>()?;
        let more = t.refine.then(|| More(experiment, frames.clone()));
        let measure = experiment.measure();
        Ok(Self { samples_averaged, noise_level, training, test, inputs, measure, more })
    }

    /// Finds the limit, which errors are then measured beside.
    pub fn measure_beside_limit(
        &mut self,
        experiment: &Experiment,
        progress: &dyn Progress,
    ) -> LimitSummary {
        let (measure, summary) =
            experiment.measure_beside_limit(self.noise_level, self.test.frames(), progress);
        self.measure = measure;
        summary
    }

    /// Calls `refine` with what refinement measures its error on; `None` unless training is to be refined.
    pub fn refined<T>(&self, refine: impl FnOnce(Examples<'_>) -> T) -> Option<T> {
        let More(experiment, synthesis) = self.more.as_ref()?;
        let more = MoreFrames { experiment, synthesis };
        Some(refine(Examples::Fresh(&more)))
    }
}

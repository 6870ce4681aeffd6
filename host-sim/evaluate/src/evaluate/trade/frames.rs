//! Frames that points are trained and judged on, with one number of samples a reading.

use std::borrow::Cow;

use taxel_data::dataset::Dataset;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_learn::train::projection;
use taxel_simulate::Synthesis;

use super::Plan;
use super::gating::Gates;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::metrics::{LimitSummary, Measure};
use crate::subject::Subject;
use crate::training_set::TrainingSet;

/// Training and test frames with one number of samples a reading.
pub(super) struct Frames<'s> {
    pub samples_averaged: usize,
    /// Noise level of the averaged readings, as a fraction; 0 for measured ones.
    pub noise_level: f64,
    pub set: TrainingSet<'s>,
    pub test: Cow<'s, Dataset>,
    /// Networks that see a row each, and networks that see the whole array.
    pub inputs: Vec<Inputs>,
    /// Measure of errors, once it is [known](Self::measure_beside_limit).
    pub measure: Measure,
}

/// What networks see of a frame.
pub(super) struct Inputs {
    /// Projection of the whole array; `None` if each network sees the readings of its row.
    pub projection: Option<Vec<f32>>,
    pub gates: Gates,
}

impl Inputs {
    /// Whether one network sees the whole array.
    pub fn whole_array(&self) -> bool {
        self.projection.is_some()
    }
}

impl<'s> Frames<'s> {
    /// Frames of a subject with so many samples a reading, for networks of a row each, of the whole array, or both.
    pub fn new(
        subject: &'s Subject,
        samples_averaged: usize,
        arrays: &[bool],
        plan: &Plan,
    ) -> Result<Self> {
        let set = subject.training_set(samples_averaged);
        let test = subject.test_set(samples_averaged);
        let level = subject.scene().map_or(0.0, |scene| scene.world.noise.level);
        let noise_level = level / (samples_averaged as f64).sqrt();
        let features = subject.options().features;
        let inputs = |&whole_array: &bool| {
            let projection = whole_array.then(|| projection::fit(&set.frames, features));
            let gates = match subject {
                _ if plan.gate_k.is_empty() => Gates::none(&test),
                Subject::Scene(scene) => {
                    gates(scene, noise_level, &test, (whole_array, &plan.gate_k))
                }
                Subject::Measured(data) => Gates::measured(data, &plan.gate_k, whole_array)?,
            };
            Ok(Inputs { projection: projection.transpose()?, gates })
        };
        let inputs = arrays.iter().map(inputs).collect::<Result<_>>()?;
        let measure = Measure { full_scale: vec![], thickness_mm: None, limit: None };
        Ok(Self { samples_averaged, noise_level, set, test, inputs, measure })
    }

    /// Frames to train on.
    pub fn training(&self) -> &Dataset {
        &self.set.frames
    }

    /// Finds the measure of errors, and the limit that they are measured beside.
    pub fn measure_beside_limit(
        &mut self,
        subject: &Subject,
        progress: &dyn Progress,
    ) -> LimitSummary {
        let (measure, summary) = subject.measure(self.samples_averaged, progress);
        self.measure = measure;
        summary
    }
}

/// Gates of a scene with these tolerances, for its `test` frames.
fn gates(
    scene: &Experiment,
    noise_level: f64,
    test: &Dataset,
    (whole_array, k): (bool, &[f64]),
) -> Gates {
    let synthesis = Synthesis::new(&scene.world).noise_level(noise_level);
    let t = &scene.training;
    // The gate compares readings in Ω.
    let readings_ohm = if t.relative_inputs {
        Cow::Owned(synthesis.frames(Stream::Test, t.test_frames).inputs)
    } else {
        Cow::Borrowed(&test.inputs)
    };
    Gates::new(&synthesis, noise_level, &readings_ohm, k, (whole_array, t.relative_inputs))
}

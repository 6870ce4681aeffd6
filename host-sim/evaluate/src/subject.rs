//! Subjects: what a model is for. A scene, which is simulated, or measurements of a real sensor.

use std::borrow::Cow;

use taxel_data::{Dataset, Progress, Stream, columns};
use taxel_learn::{Options, Origin};
use taxel_limit::{Reference, Refusal};
use taxel_simulate::Synthesis;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::path::Path;

use crate::experiment::Experiment;
use crate::measurements::Measurements;
use crate::metrics::{LimitSummary, Measure};
use crate::training_set::TrainingSet;

/// Scene or measurements that a model is trained and judged on.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// Scene, whose frames are synthesised.
    Scene(Box<Experiment>),
    Measured(Box<Measurements>),
}

impl Subject {
    /// This subject, of whose column-wires only every so many are read if it is a scene: those in the middle of each
    /// step, and at least one.
    pub fn with_every_column(&self, step: usize) -> Cow<'_, Self> {
        let Self::Scene(scene) = self else { return Cow::Borrowed(self) };
        if step <= 1 {
            return Cow::Borrowed(self);
        }
        let mut scene = scene.clone();
        let sensor = &scene.world.sensor;
        let columns: Vec<usize> = ((step - 1) / 2..sensor.column_wires).step_by(step).collect();
        scene.world.sensor = sensor.with_columns(&columns);
        Cow::Owned(Self::Scene(scene))
    }

    /// Name, which names the output folder and the model.
    pub fn name(&self) -> &str {
        match self {
            Self::Scene(scene) => &scene.name,
            Self::Measured(data) => &data.name,
        }
    }

    /// Scene, if it is one.
    pub fn scene(&self) -> Option<&Experiment> {
        match self {
            Self::Scene(scene) => Some(scene),
            Self::Measured(_) => None,
        }
    }

    /// Scene whose contacts move, and their path, if it is one.
    pub fn moving_scene(&self) -> Option<(&Experiment, Path)> {
        let scene = self.scene()?;
        Some((scene, scene.world.path?))
    }

    /// Measurements, if it is not a scene.
    pub fn measurements(&self) -> Option<&Measurements> {
        match self {
            Self::Scene(_) => None,
            Self::Measured(data) => Some(data),
        }
    }

    /// Options for training its model.
    pub fn options(&self) -> Options {
        match self {
            Self::Scene(scene) => scene.options(),
            Self::Measured(data) => data.how.options,
        }
    }

    /// Origin of its frames, for the model's metadata.
    pub fn origin(&self) -> Origin {
        match self {
            Self::Scene(scene) => scene.origin(),
            Self::Measured(data) => data.origin(),
        }
    }

    /// Names of the outputs, in the model's order.
    pub fn output_names(&self) -> Vec<String> {
        match self {
            Self::Scene(scene) => scene.world.output_names(),
            Self::Measured(data) => data.training.outputs.names.clone(),
        }
    }

    /// Number of frames to train on.
    pub fn training_frames(&self) -> usize {
        match self {
            Self::Scene(scene) => scene.frames,
            Self::Measured(data) => data.training.frames(),
        }
    }

    /// Number of frames to judge by.
    pub fn test_frames(&self) -> usize {
        match self {
            Self::Scene(scene) => scene.test_frames,
            Self::Measured(data) => data.test.frames(),
        }
    }

    /// Number of rows that outputs belong to; 1 where they belong to none.
    pub fn rows(&self) -> usize {
        match self {
            Self::Scene(scene) => match scene.world.outputs {
                Outputs::Contact(_) => 1,
                Outputs::Electrodes(_) => scene.world.read_rows.len(),
            },
            Self::Measured(data) => data.training.rows,
        }
    }

    /// Row-wire (from 1) of each row table, where outputs belong to row-wires.
    pub fn row_wires(&self) -> Vec<usize> {
        match self {
            Self::Scene(scene) => match scene.world.outputs {
                Outputs::Contact(_) => vec![],
                Outputs::Electrodes(_) => scene.world.read_rows.iter().map(|row| row + 1).collect(),
            },
            Self::Measured(data) => {
                let names = &data.training.outputs.names;
                let of_rows = names.chunks_exact(names.len() / data.training.rows);
                let wire = |names: &[String]| {
                    let wire = columns::row_of(&names[0])?;
                    names.iter().all(|name| columns::row_of(name) == Some(wire)).then_some(wire)
                };
                of_rows.map(wire).collect::<Option<_>>().unwrap_or_default()
            }
        }
    }

    /// Frames to train on.
    pub fn training_set(&self) -> TrainingSet<'_> {
        match self {
            Self::Scene(scene) => TrainingSet::of_scene(scene, Synthesis::new(&scene.world)),
            Self::Measured(data) => {
                let mut set = TrainingSet::of_folds(&data.training, &data.fold_of, data.origin());
                (set.refine, set.reading_model) = (data.how.refine, data.how.reading_model);
                set
            }
        }
    }

    /// Frames to train on, and those to judge by.
    pub fn sets(&self) -> (TrainingSet<'_>, Cow<'_, Dataset>) {
        let test = match self {
            Self::Scene(scene) => {
                let synthesis = Synthesis::new(&scene.world);
                Cow::Owned(scene.dataset(&synthesis, Stream::Test, scene.test_frames))
            }
            Self::Measured(data) => Cow::Borrowed(&data.test),
        };
        (self.training_set(), test)
    }

    /// Measure for errors on the test frames, with their ratio to the limit of all readings of a frame where it is known, and
    /// a summary of that limit or the reason why there is none. Ratios are formed on the first test frames, as many as suffice
    /// unless their number is given.
    pub fn measure(
        &self,
        limit_frames: Option<usize>,
        progress: &dyn Progress,
    ) -> (Measure, LimitSummary) {
        match self {
            Self::Scene(scene) => {
                let frames = limit_frames.unwrap_or_else(|| Reference::few_frames(&scene.world));
                let frames = frames.min(scene.test_frames);
                let limit = Reference::new(&scene.world, frames, progress);
                let summary = LimitSummary::new(&limit);
                (Measure { limit: limit.ok(), ..scene.measure() }, summary)
            }
            Self::Measured(data) => (data.measure(), LimitSummary::new(&Err(Refusal::Measured))),
        }
    }
}

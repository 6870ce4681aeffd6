//! One noise level of a scene, with what every decoder there is set beside.

use crate::equations::Equations;
use taxel_data::BadValue;
use taxel_data::dataset::Dataset;
use taxel_data::error::require;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_learn::decoders::BASELINES;
use taxel_learn::{Decoder, Estimates, Exponential, FrameDecoder, Frames, ModelBlob};
use taxel_limit::solve::Solution;
use taxel_simulate::Synthesis;
use taxel_simulate::outputs::Outputs;

use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::{Direction, Experiment};
use taxel_evaluate::metrics::{self, DecoderErrors, LimitSummary, Measure};
use taxel_evaluate::training_set::TrainingSet;

/// Most frames that networks are trained on.
const MOST_TRAINING_FRAMES: usize = 10_000;
/// Most frames that a limit is computed on.
const MOST_LIMIT_FRAMES: usize = 40;

/// Results at one noise level.
pub trait AtNoise {
    /// Noise level p, as a fraction.
    fn noise_level(&self) -> f64;
    fn decoders(&self) -> &[DecoderErrors];
    fn limit(&self) -> &LimitSummary;
}

/// Makes results with these fields results at a noise level.
macro_rules! at_noise {
    ($level:ty) => {
        impl crate::level::AtNoise for $level {
            fn noise_level(&self) -> f64 {
                self.noise_level
            }
            fn decoders(&self) -> &[DecoderErrors] {
                &self.decoders
            }
            fn limit(&self) -> &LimitSummary {
                &self.limit
            }
        }
    };
}
pub(crate) use at_noise;

/// A scene at one noise level, with its test frames.
pub(super) struct NoiseLevel {
    /// Scene at this level, whose networks decode and are trained as the paper's: K-means, then output weights.
    pub scene: Experiment,
    pub test: Dataset,
    pub measure: Measure,
    /// Limit on the first of them, or why there is none.
    pub limit: LimitSummary,
}

/// Checks that equations for single rows can decode the scene, and that so many `frames` can be tested.
pub(super) fn check(experiment: &Experiment, frames: usize) -> std::result::Result<(), BadValue> {
    let world = &experiment.world;
    let all = world.outputs == Outputs::all_deformations();
    require(all, "outputs", "others", || {
        "equations give all deformations: ask for quantity = \"deformation\" and axes = [\"x\", \"y\", \"z\"]".into()
    })?;
    require(world.drift.is_none(), "drift.gain", "[drift]", || {
        "the equations know no drift of the gain: leave it out".into()
    })?;
    require(!experiment.training.relative_inputs, "training.relative_inputs", true, || {
        "the equations are about readings as they are: leave it out".into()
    })?;
    require(frames > 0, "frames", frames, || "give at least 1".into())?;
    world.check_frames("frames", frames)
}

impl NoiseLevel {
    /// Sets `experiment` to a noise level, with so many test `frames`. The limit is left out, for the reason in
    /// `no_limit`, where a larger level had none.
    pub fn new(
        experiment: &Experiment,
        noise_level: f64,
        frames: usize,
        no_limit: &mut Option<String>,
        progress: &dyn Progress,
    ) -> Self {
        let mut scene = experiment.clone();
        scene.world.noise.level = noise_level;
        scene.table1 = None;
        let t = &mut scene.training;
        (t.direction, t.refine, t.confidence, t.fill) = (Direction::Inverse, false, false, false);
        t.frames = t.frames.min(MOST_TRAINING_FRAMES);
        let (measure, limit) = match no_limit {
            Some(reason) if noise_level > 0.0 => {
                let refused = Some(format!("not tried: at more noise, {reason}"));
                (scene.measure(), LimitSummary { frames: 0, groups: Vec::new(), refused })
            }
            _ => scene.measure_beside_limit(
                scene.world.noise.with_level(noise_level),
                MOST_LIMIT_FRAMES.min(frames),
                progress,
            ),
        };
        if no_limit.is_none() {
            no_limit.clone_from(&limit.refused);
        }
        let test = scene.dataset(&Synthesis::new(&scene.world), Stream::Test, frames);
        Self { scene, test, measure, limit }
    }

    /// Errors of `decoder` on the test frames.
    pub fn judge(&self, decoder: &dyn Decoder) -> DecoderErrors {
        metrics::judge(decoder, &self.test, &self.measure)
    }

    /// Trains the scene's network, and returns its errors and those of the baselines.
    pub fn trained(&self, progress: &dyn Progress) -> Result<Vec<DecoderErrors>> {
        let (set, blob) = train(&self.scene, progress)?;
        let network = blob.prepare(Exponential::default());
        let baselines = BASELINES.iter().map(|it| self.judge(it.fit(&set.frames).as_ref()));
        Ok(std::iter::once(self.judge(&network)).chain(baselines).collect())
    }
}

/// Solutions of the test frames as a decoder of these.
pub(super) struct Solved<'s>(pub &'s Equations<'s>, pub &'s [Solution]);

impl Decoder for Solved<'_> {
    fn name(&self) -> &str {
        FrameDecoder::name(self.0)
    }

    fn decode_frames(&self, _: Frames<'_>, _: usize) -> Estimates {
        Estimates::of_values(self.1.iter().flat_map(|solution| &solution.place).copied().collect())
    }
}

/// Trains the model of `scene`; with the frames that it was trained on.
pub(super) fn train<'s>(
    scene: &'s Experiment,
    progress: &dyn Progress,
) -> Result<(TrainingSet<'s>, ModelBlob)> {
    let set = TrainingSet::of_scene(scene, Synthesis::new(&scene.world));
    let blob = set.blob(&scene.options(), progress)?;
    Ok((set, blob))
}

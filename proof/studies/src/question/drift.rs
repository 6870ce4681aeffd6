//! Effect of a drifting gain on models that take readings, and on those that take them relative to the baseline.

use serde::Serialize;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_learn::decoders::{BASELINES, mean};
use taxel_learn::{Decoder, Exponential};
use taxel_simulate::Synthesis;
use taxel_simulate::drift::Drift;
use taxel_simulate::world::check_gain;

use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::metrics::{self, Errors};
use taxel_evaluate::training_set::TrainingSet;

/// Largest relative change of the gain, unless the scene or a user says otherwise.
pub const TYPICAL_GAIN: f64 = 0.02;

/// Errors of one decoder on the same test frames without and with drift.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    pub decoder: String,
    /// Whether its inputs are readings relative to the baseline.
    pub relative_inputs: bool,
    /// Whether it was trained on sessions that drift as much.
    pub trained_with_drift: bool,
    pub undrifted: Vec<Errors>,
    pub drifted: Vec<Errors>,
}

/// Results of a scene, by decoder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriftResult {
    pub subject: String,
    pub seed: u64,
    /// Largest relative change of the gain.
    pub gain: f64,
    pub training_frames: usize,
    pub test_frames: usize,
    /// Errors by decoder: all that take readings, those trained with drift, those with relative inputs. The mean
    /// stands once.
    pub lines: Vec<Line>,
}

/// Trains the scene's decoders on readings, on readings of sessions that drift, and on relative inputs. Judges each
/// on the scene's test frames, without drift and with a `gain` that differs by up to so much in each session.
pub fn measure(experiment: &Experiment, gain: f64, progress: &dyn Progress) -> Result<DriftResult> {
    check_gain("gain", gain)?;
    let drift = Some(Drift { gain });
    let t = &experiment.training;
    let mut lines = Vec::new();
    for (relative_inputs, trained_with_drift) in [(false, false), (false, true), (true, false)] {
        let mut own = experiment.clone();
        own.training.relative_inputs = relative_inputs;
        own.world.drift = if trained_with_drift { drift } else { None };
        let synthesis = Synthesis::new(&own.world);
        let mut training = TrainingSet::of_scene(&own, synthesis.clone());
        training.confidence = false;
        training.fill = false;
        let blob = training.blob(&own.options(), progress)?;
        let network = blob.prepare(Exponential::default()).of_inputs();
        let tests = [None, drift]
            .map(|drift| own.dataset(&synthesis.clone().drift(drift), Stream::Test, t.test_frames));

        let first = lines.is_empty();
        let baselines = BASELINES.iter().filter(|baseline| first || baseline.name != mean::NAME);
        let baselines: Vec<Box<dyn Decoder>> = baselines.map(|b| b.fit(&training.frames)).collect();
        let measure = own.measure();
        let decoders =
            std::iter::once(&network as &dyn Decoder).chain(baselines.iter().map(AsRef::as_ref));
        lines.extend(decoders.map(|decoder| {
            let judge = |test| metrics::judge(decoder, test, &measure);
            let [undrifted, drifted] = tests.each_ref().map(judge);
            Line {
                decoder: undrifted.decoder,
                relative_inputs,
                trained_with_drift,
                undrifted: undrifted.errors,
                drifted: drifted.errors,
            }
        }));
    }
    Ok(DriftResult {
        subject: experiment.name.clone(),
        seed: experiment.world.seed,
        gain,
        training_frames: t.frames,
        test_frames: t.test_frames,
        lines,
    })
}

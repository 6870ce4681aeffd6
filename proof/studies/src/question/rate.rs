//! Error against the rate of frames: both readouts of the board, contacts that are still and that move, by samples a reading.

use serde::Serialize;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_evaluate::error::Result;
use taxel_evaluate::evaluate::moving_contacts::{self, MovingWay};
use taxel_evaluate::evaluate::trade::{Device, FilterSettings, Readout};
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::metrics::{self, Errors};
use taxel_evaluate::training_set::TrainingSet;
use taxel_learn::Exponential;
use taxel_simulate::noise::Noise;

/// Readouts and numbers of samples a reading that are compared.
const WAYS: [(Readout, &[usize]); 2] =
    [(Readout::Spi, &[1, 2, 4, 16]), (Readout::OnChip, &[1, 4, 12, 48])];

/// Time constants in ms of the noises that are compared, all of the scene's level; 0 for white noise.
pub const TIME_CONSTANTS_MS: [f64; 3] = [0.0, 2.0, 20.0];

/// One readout with so many samples a reading, under one noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Time constant of the noise in ms; 0 for white noise.
    pub time_constant_ms: f64,
    pub readout: Readout,
    pub samples_averaged: usize,
    pub frames_per_s: f64,
    /// Mean age of an estimate when it is used.
    pub age_ms: f64,
    /// RMSE on still contacts.
    pub still: f64,
    /// RMSE of the newest finished estimate on contacts that move.
    pub moving: f64,
    /// RMSE of the newest finished estimate behind a filter.
    pub filtered: f64,
    pub filter: Option<FilterSettings>,
}

/// Errors of a scene by readout and samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RateStudy {
    pub subject: String,
    pub seed: u64,
    /// Outputs that errors are of, and their unit.
    pub group: String,
    pub unit: String,
    pub lines: Vec<Line>,
}

/// Trains the model of `scene` for the noise that each readout and number of samples leaves, and judges it on still contacts
/// and on those that move; for white noise, and for noises of the same level with a memory.
pub fn measure(scene: &Experiment, progress: &dyn Progress) -> Result<RateStudy> {
    let (names, mut lines) = (scene.output_names(), Vec::new());
    let group = taxel_data::columns::groups(&names).last().map_or("", |(group, _)| *group);
    let rmse = |errors: &[Errors]| metrics::rmse_of(errors, group).unwrap_or(f64::NAN);
    let ways =
        WAYS.iter().flat_map(|(readout, all)| all.iter().map(|samples| (*readout, *samples)));
    for time_constant_ms in TIME_CONSTANTS_MS {
        let mut scene = scene.clone();
        let level = scene.world.noise.total_level();
        scene.world.noise = Noise::white(scene.world.noise.kind, level);
        if time_constant_ms > 0.0 {
            let noise = scene.world.noise.with_level(0.0);
            scene.world.noise = Noise { correlated_level: level, time_constant_ms, ..noise };
        }
        let scene = &scene;
        for (readout, samples_averaged) in ways.clone() {
            let device = Device { readout, ..Device::default() };
            let synthesis = moving_contacts::scanned(scene, device, samples_averaged);
            let set = TrainingSet::of_scene(scene, synthesis.clone());
            let blob = set.blob(&scene.options(), progress)?;
            let model = blob.prepare(Exponential::default()).of_inputs();
            let test = scene.dataset(&synthesis, Stream::Test, scene.training.test_frames);
            let still = metrics::judge(&model, &test, &scene.measure());
            let ways = moving_contacts::on_device(scene, &blob, device, samples_averaged)?;
            let of = |is_filtered: bool| {
                ways.iter().find(|way: &&MovingWay| way.filter.is_some() == is_filtered)
            };
            let errors = |way: Option<&MovingWay>| way.map_or(f64::NAN, |way| rmse(&way.errors));
            lines.push(Line {
                time_constant_ms,
                readout,
                samples_averaged,
                frames_per_s: ways[0].times.frames_per_s,
                age_ms: ways[0].times.age_ms.unwrap_or(f64::NAN),
                still: rmse(&still.errors),
                moving: errors(of(false)),
                filtered: errors(of(true)),
                filter: of(true).and_then(|way| way.filter),
            });
        }
    }
    Ok(RateStudy {
        subject: scene.name.clone(),
        seed: scene.world.seed,
        group: group.into(),
        unit: metrics::unit_of_rmse(group).into(),
        lines,
    })
}

//! Both directions: a network from deformations to noisy readings, as at the end of the paper's §3, its inversion, and
//! the network that decodes directly.

use std::time::Instant;

use crate::equations::Equations;
use crate::equations::RowModel;
use nalgebra::DMatrix;
use serde::Serialize;
use taxel_core::rbf::{Format, Network, direct};
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::Exponential;
use taxel_learn::decoders::BASELINES;
use taxel_simulate::Synthesis;

use crate::level::{NoiseLevel, Solved, at_noise, check, train};
use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::{Direction, Experiment};
use taxel_evaluate::metrics::{self, DecoderErrors, LimitSummary};

/// Noise levels of the study, the largest first.
pub const NOISE_LEVELS: [f64; 5] = [0.1, 0.05, 0.01, 0.005, 0.0];
pub const INVERTED: &str = "inverted";
/// Name of its inversion that is damped by noise and scene.
pub const INVERTED_DAMPED: &str = "inverted, damped";

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DirectionsResult {
    pub subject: String,
    pub seed: u64,
    pub frames: usize,
    /// Number of rows that were inverted at each level.
    pub rows: usize,
    pub training_frames: usize,
    pub centres: usize,
    /// Results by noise, without noise first.
    pub levels: Vec<Level>,
}

/// Results at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// Noise level p, as a fraction.
    pub noise_level: f64,
    /// Root mean square of the noise on the readings, in Ω: the least possible error of predicting them.
    pub noise_ohm: f64,
    /// Errors of predicting noisy readings.
    pub readings: Vec<DecoderErrors>,
    /// RMSE in Ω of the network's prediction against readings without noise.
    pub ideal_rmse_ohm: f64,
    /// Inversions of the network.
    pub inversions: Vec<Inversion>,
    /// Errors of decoding: of the inversions, the network that decodes directly, and the baselines.
    pub decoders: Vec<DecoderErrors>,
    pub limit: LimitSummary,
}

at_noise!(Level);

/// Effort of inverting the network.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inversion {
    pub decoder: String,
    /// Share of the rows that converged: to an exact solution in the box, or where it is damped to a minimum.
    pub percent_converged: f64,
    /// Time of a frame on this machine with all its cores, in µs. It differs from run to run.
    pub frame_us: f64,
}

/// Trains networks in both directions at every level of noise, and inverts those that predict readings.
pub fn study(
    experiment: &Experiment,
    frames: usize,
    progress: &dyn Progress,
) -> Result<DirectionsResult> {
    check(experiment, frames)?;
    let (mut levels, mut no_limit, mut training_frames) = (Vec::new(), None, 0);
    for noise_level in NOISE_LEVELS {
        let level = NoiseLevel::new(experiment, noise_level, frames, &mut no_limit, progress);
        training_frames = level.scene.training.frames;
        levels.push(of_level(level, progress)?);
    }
    levels.reverse();
    Ok(DirectionsResult {
        subject: experiment.name.clone(),
        seed: experiment.world.seed,
        frames,
        rows: frames * experiment.world.read_rows.len(),
        training_frames,
        centres: experiment.training.centres,
        levels,
    })
}

fn of_level(level: NoiseLevel, progress: &dyn Progress) -> Result<Level> {
    let mut forward = level.scene.clone();
    let t = &mut forward.training;
    // Distances are direct, so that f64 continues the network's own formula.
    (t.direction, t.format) = (Direction::Forward, Format::F32Direct);
    (t.whole_array, t.features, t.output_rank) = (false, None, None);
    let (set, blob) = train(&forward, progress)?;
    let synthesis = Synthesis::new(&forward.world);
    let frames = level.test.frames();
    let test = forward.dataset(&synthesis, Stream::Test, frames);
    let ideal = forward.dataset(&synthesis.ideal(), Stream::Test, frames);
    let (model, measure) = (blob.prepare(Exponential::default()), forward.measure());
    let mut readings = vec![metrics::judge(&model, &test, &measure)];
    readings.extend(
        BASELINES.iter().map(|it| metrics::judge(it.fit(&set.frames).as_ref(), &test, &measure)),
    );
    let rmse_ohm =
        |squares: Vec<f64>| (squares.iter().sum::<f64>() / test.outputs.values.len() as f64).sqrt();
    let predicted = model.decode_table(&test.inputs).values;

    // Readings deviate from the network by their noise and its own error.
    let estimated = model.decode_table(&set.frames.inputs);
    let deviation = deviation(&Synthesis::new(&forward.world), &set.frames.outputs, &estimated);
    let networks = Networks::new(&blob.parse());
    let world = &level.scene.world;
    let mut inversions = Vec::new();
    let mut decoders = Vec::new();
    progress.stage("invert networks", 2);
    for equations in [
        Equations::exact(world).of_model(INVERTED, &networks),
        Equations::damped(world, deviation).of_model(INVERTED_DAMPED, &networks),
    ] {
        let started = Instant::now();
        let solved = equations.solve_all(&level.test.inputs.values);
        let seconds = started.elapsed().as_secs_f64();
        let converged = solved.iter().filter(|solution| solution.converged).count();
        let errors = level.judge(&Solved(&equations, &solved));
        inversions.push(Inversion {
            decoder: errors.decoder.clone(),
            percent_converged: 100.0 * converged as f64 / solved.len() as f64,
            frame_us: 1e6 * seconds / frames as f64,
        });
        decoders.push(errors);
        progress.step();
    }
    decoders.extend(level.trained(progress)?);
    Ok(Level {
        noise_level: level.scene.world.noise.level,
        noise_ohm: rmse_ohm(test.outputs.squared_errors(&ideal.outputs.values)),
        readings,
        ideal_rmse_ohm: rmse_ohm(ideal.outputs.squared_errors(&predicted)),
        inversions,
        decoders,
        limit: level.limit,
    })
}

/// Root mean square of predicted − reading, each relative to what noise is relative to: the reading or its span.
fn deviation(synthesis: &Synthesis<'_>, readings: &Table, predicted: &Table) -> f64 {
    let spans_ohm = synthesis.noise_span_ohm();
    let pairs = readings.values.iter().zip(&predicted.values).enumerate();
    let relative = pairs.map(|(i, (reading, predicted))| {
        (predicted - reading) / spans_ohm.get(i % readings.names.len()).unwrap_or(reading)
    });
    let squares: f64 = relative.map(|off| off * off).sum();
    (squares / readings.values.len() as f64).sqrt()
}

/// Networks that predict the readings of each row, in f64 and without the clamp on their inputs.
struct Networks<'m>(Vec<direct::Network<'m>>);

impl<'m> Networks<'m> {
    /// Networks of a model with direct distances, of which each row has one.
    fn new(model: &taxel_core::blob::Model<'m>) -> Self {
        let direct = |network| match network {
            Network::F32Direct(direct) => Some(direct),
            _ => None,
        };
        Self(model.networks().filter_map(direct).collect())
    }
}

impl RowModel for Networks<'_> {
    fn log_readings(
        &self,
        place: usize,
        deformation_mm: &[f64],
        logs: &mut [f64],
        slopes: &mut DMatrix<f64>,
    ) {
        let p = self.0[place].parameters();
        let (inputs, outputs) = (deformation_mm.len(), logs.len());
        let per_span = |i: usize| f64::from(p.input_per_span[i]);
        let scaled = deformation_mm.iter().enumerate();
        let scaled: Vec<f64> =
            scaled.map(|(i, mm)| (mm - f64::from(p.input_minimum[i])) * per_span(i)).collect();
        slopes.fill(0.0);
        logs.iter_mut().zip(p.bias).for_each(|(value, bias)| *value = f64::from(*bias));
        let mut add = |k: usize, i: usize, slope: f64| slopes[(k, i)] += slope;
        for (i, weights) in p.affine.chunks_exact(outputs).enumerate() {
            for (k, weight) in weights.iter().enumerate() {
                logs[k] += f64::from(*weight) * scaled[i];
                add(k, i, f64::from(*weight));
            }
        }
        let weights = p.output_weights.chunks_exact(outputs);
        for (j, (centre, weights)) in p.centres.chunks_exact(inputs).zip(weights).enumerate() {
            let decay = f64::from(p.decay[j.min(p.decay.len() - 1)]);
            let off: Vec<f64> = scaled.iter().zip(centre).map(|(x, c)| x - f64::from(*c)).collect();
            let activation = (-decay * off.iter().map(|d| d * d).sum::<f64>()).exp();
            for (k, weight) in weights.iter().enumerate() {
                let part = f64::from(*weight) * activation;
                logs[k] += part;
                off.iter().enumerate().for_each(|(i, d)| add(k, i, -2.0 * decay * part * d));
            }
        }
        // From readings to their logarithms, and from spans to mm.
        for (k, value) in logs.iter_mut().enumerate() {
            (0..inputs).for_each(|i| slopes[(k, i)] *= per_span(i) / *value);
            *value = value.ln();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::progress::Silent;
    use taxel_evaluate::metrics::NETWORK;
    use taxel_simulate::noise::NoiseKind;

    /// Row 4 of `press`, whose network predicts its readings.
    fn forward() -> Experiment {
        let mut scene = Experiment::load("press").unwrap();
        scene.world.read_rows = vec![3];
        scene.table1 = None;
        let t = &mut scene.training;
        (t.direction, t.format, t.refine) = (Direction::Forward, Format::F32Direct, false);
        (t.frames, t.centres) = (1000, 16);
        scene
    }

    #[test]
    fn slopes_and_values_in_f64_are_those_of_the_network() {
        let (scene, progress) = (forward(), &Silent);
        let blob = scene.train(progress).unwrap();
        let test = scene.dataset(&Synthesis::new(&scene.world), Stream::Test, 5);
        let predicted = blob.prepare(Exponential::default()).decode_table(&test.inputs);
        let networks = Networks::new(&blob.parse());
        let at = |deformation_mm: &[f64]| {
            let (mut logs, mut slopes) = (vec![0.0; 18], DMatrix::zeros(18, 18));
            networks.log_readings(0, deformation_mm, &mut logs, &mut slopes);
            (logs, slopes)
        };
        for (moved, predicted) in test.inputs.lines().zip(predicted.lines()) {
            let (logs, slopes) = at(moved);
            for (log, predicted) in logs.iter().zip(predicted) {
                assert!((log.exp() / predicted - 1.0).abs() < 1e-5, "{log} {predicted}");
            }
            for i in 0..18 {
                let by = |mm: f64| {
                    let mut moved = moved.to_vec();
                    moved[i] += mm;
                    at(&moved).0
                };
                for (k, (up, down)) in by(1e-4).iter().zip(by(-1e-4)).enumerate() {
                    let slope = (up - down) / 2e-4;
                    assert!((slopes[(k, i)] - slope).abs() < 1e-7, "reading {k}, unknown {i}");
                }
            }
        }
    }

    #[test]
    fn readings_deviate_by_the_noise_level_in_the_unit_of_the_noise() {
        let mut scene = forward();
        scene.world.noise.level = 0.05;
        for kind in [NoiseKind::Relative, NoiseKind::Span] {
            scene.world.noise.kind = kind;
            let synthesis = Synthesis::new(&scene.world);
            let [noisy, ideal] = [&synthesis, &synthesis.clone().ideal()]
                .map(|it| scene.dataset(it, Stream::Test, 1000).outputs);
            let found = deviation(&synthesis, &noisy, &ideal);
            assert!((found / 0.05 - 1.0).abs() < 0.02, "{kind:?}: {found}");
        }
    }

    #[test]
    fn a_network_that_predicts_readings_beats_their_mean_and_comes_near_the_noise() {
        let scene = forward();
        let level = NoiseLevel::new(&scene, 0.005, 100, &mut Some(String::new()), &Silent);
        let level = of_level(level, &Silent).unwrap();
        let rmse = |name| metrics::of_decoder(&level.readings, name)[0].rmse;
        assert_eq!(metrics::of_decoder(&level.readings, NETWORK)[0].unit, "Ω");
        assert!(rmse(NETWORK) < 1.2 * level.noise_ohm && rmse("mean") > 1.5 * level.noise_ohm);
        let z = |name| metrics::of_decoder(&level.decoders, name)[2].rmse;
        assert!(z(INVERTED_DAMPED) < 1.3 * z(NETWORK) && z(INVERTED) > 3.0 * z(NETWORK));
        assert_eq!(level.inversions[1].percent_converged, 100.0);
    }
}

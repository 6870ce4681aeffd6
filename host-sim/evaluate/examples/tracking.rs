//! What a tracker leaves of errors on contacts that move, and where it does not help: other forms of contacts, noise with a
//! memory, gains that are a little off; and on how many trajectories it does worse than the network alone.
//!
//! `cargo run -p taxel-evaluate --example tracking`, which takes a minute, and fails if an error is above its bound.

use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::{Silent, Table};
use taxel_evaluate::device::{Device, Readout, Wires};
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::moving::Moving;
use taxel_evaluate::tracking;
use taxel_evaluate::{Error, Result};
use taxel_learn::cost::{Cost, Design};
use taxel_learn::{Decoder, ModelBlob, Tracked};
use taxel_simulate::Synthesis;
use taxel_simulate::synth::BASELINE_FRAMES;

/// Trajectories of each case; no model was trained on one.
const TRAJECTORIES: usize = 64;

/// How readings of a case differ from those of training.
#[derive(Clone, Copy)]
struct Readings {
    /// Standard deviation of each reading's gain, which stays the same.
    gain: f64,
    /// Whether the tracker has a baseline, as that of a device.
    has_baseline: bool,
}

const AS_TRAINED: Readings = Readings { gain: 0.0, has_baseline: false };
const GAINS_OFF: Readings = Readings { gain: 0.005, has_baseline: false };
const WITH_BASELINE: Readings = Readings { has_baseline: true, ..GAINS_OFF };

/// Parts of a trajectory whose errors are taken for independent: each is longer than a touch is remembered.
const PARTS: usize = 12;

/// Mean squares of errors in µm², in parts of each trajectory.
type Squares = Vec<Vec<f64>>;

/// Squares of the network alone, and of the tracker.
struct Found {
    network: Squares,
    tracked: Squares,
}

impl Found {
    /// Number of trajectories on which the tracker does worse, and of those by more than two standard errors.
    fn worse(&self) -> [usize; 2] {
        let (mut worse, mut surely) = (0, 0);
        for (network, tracked) in self.network.iter().zip(&self.tracked) {
            let beyond: Vec<f64> = tracked.iter().zip(network).map(|(a, b)| a - b).collect();
            let [difference, error] = mean(&beyond);
            worse += usize::from(difference > 0.0);
            surely += usize::from(difference > 2.0 * error);
        }
        [worse, surely]
    }
}

/// Mean, and its standard error.
fn mean(numbers: &[f64]) -> [f64; 2] {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let spread = numbers.iter().map(|it| (it - mean).powi(2)).sum::<f64>();
    [mean, (spread / count / (count - 1.0)).sqrt()]
}

/// Root of the mean square, and its standard error over trajectories.
fn rmse(squares: &Squares) -> [f64; 2] {
    let of_trajectories: Vec<f64> = squares.iter().map(|parts| mean(parts)[0]).collect();
    let [square, error] = mean(&of_trajectories);
    [square.sqrt(), error / (2.0 * square.sqrt())]
}

fn squares(moving: &Moving, estimates: &[f64], finished_ms: f64) -> Squares {
    let held = moving.held(estimates, finished_ms);
    let length = moving.moments_s.len() * moving.truth.names.len();
    let errors: Vec<f64> = moving
        .truth
        .values
        .iter()
        .zip(held)
        .map(|(truth, held)| 1e6 * (truth - held).powi(2))
        .collect();
    let of_parts =
        |errors: &[f64]| errors.chunks(length.div_ceil(PARTS)).map(|part| mean(part)[0]).collect();
    errors.chunks_exact(length).map(of_parts).collect()
}

/// Readings by factors that differ from reading to reading, and stay the same.
fn with_gains(inputs: &mut Table, deviation: f64) {
    let mut random = Random::new(1, Stream::Test, Purpose::Drift, 0, 0);
    let gains: Vec<f64> = inputs.names.iter().map(|_| 1.0 + deviation * random.normal()).collect();
    for line in inputs.values.chunks_exact_mut(gains.len()) {
        line.iter_mut().zip(&gains).for_each(|(reading, gain)| *reading *= gain);
    }
}

fn found(
    scene: &Experiment,
    blob: &ModelBlob,
    (device, samples): (&Device, usize),
    Readings { gain, has_baseline }: Readings,
) -> Result<Found> {
    let synthesis = Synthesis::new(&scene.world);
    let path = scene.world.path.expect("a scene whose contacts move");
    let scan_ms = device.scan_ms(Some(Wires::of(&scene.world)), samples);
    let moving = |cost: Cost| {
        let times = device.times(scan_ms, &cost);
        let scans = ([scan_ms.unwrap_or_default(), times.period_ms()], device.passes(samples));
        let mut moving = Moving::new(scene, &synthesis, path, scans)?;
        with_gains(&mut moving.frames.inputs, gain);
        Ok::<_, taxel_data::BadValue>((moving, times))
    };
    let model = blob.prepare().of_inputs();
    let (plain, times) = moving(Cost::of_frame(&Design::new(blob)))?;
    let estimates = model.decode_lines(&plain.frames.inputs.values);
    let network = squares(&plain, &estimates, times.frame_ms);
    let parsed = blob.parse();
    let tracker = parsed.tracker().expect("a model with a tracker");
    let (moving, times) = moving(Cost::of_tracker(tracker.sizes()))?;
    let ahead_us = 1000.0 * (times.frame_ms + 0.5 * times.period_ms());
    let mut baseline = synthesis.baselines(Stream::Test, 1, BASELINE_FRAMES);
    with_gains(&mut baseline, gain);
    let baseline = has_baseline.then_some(&baseline.values[..]);
    let decoder = Tracked::new(model, tracker, baseline, ahead_us as f32);
    let estimates = moving.decoded(&decoder as &dyn Decoder);
    Ok(Found { network, tracked: squares(&moving, &estimates, times.frame_ms) })
}

fn main() -> Result<()> {
    let onchip = Device::default();
    let spi = Device { readout: Readout::Spi, ..onchip };
    println!(
        "RMSE of z in µm ± standard error, over {TRAJECTORIES} trajectories; the number of them on which the tracker does \n\
         worse than the network, and by more than two standard errors"
    );
    let mut broken = Vec::new();
    for (name, device, samples, most_um) in [
        ("converters on SPI, 1 sample", spi, 1, 22.0),
        ("the board's own, 12 samples", onchip, 12, 6.0),
    ] {
        let mut scene = Experiment::load("moving")?;
        if let Some(path) = &mut scene.world.path {
            path.trajectories = TRAJECTORIES;
        }
        scene.training.refine = false;
        let wires = Some(Wires::of(&scene.world));
        scene.world.noise = device.averaged(scene.world.noise, wires, samples);
        let blob = tracking::add(&scene.train(&Silent)?, &scene.world)?;
        println!(
            "\n{name}\n{:24}{:>15}{:>15}{:>8}{:>8}{:>8}",
            "", "network", "tracked", "ratio", "worse", "surely"
        );
        let mut show = |case: &str, scene: &Experiment, readings: Readings| {
            let found = found(scene, &blob, (&device, samples), readings)?;
            let [worse, surely] = found.worse();
            let [[a, a_error], [b, b_error]] = [rmse(&found.network), rmse(&found.tracked)];
            println!(
                "{case:24}{a:>8.1} ± {a_error:<4.1}{b:>8.1} ± {b_error:<4.1}{:>8.2}{worse:>8}{surely:>8}",
                b / a
            );
            let is_trained = case == "as trained";
            let bounds = [
                (b < a || !readings.has_baseline && readings.gain > 0.0, "is above the network's"),
                (b < most_um || !is_trained && !readings.has_baseline, "is above its bound"),
                (surely == 0 || !is_trained, "is surely worse than the network on a trajectory"),
            ];
            let failed = bounds.iter().filter(|(holds, _)| !holds);
            broken.extend(failed.map(|(_, what)| format!("{name}, {case}: the tracker {what}")));
            Ok::<_, Error>(())
        };
        show("as trained", &scene, AS_TRAINED)?;
        show("gains 0.5 % off", &scene, GAINS_OFF)?;
        show("… with a baseline", &scene, WITH_BASELINE)?;
        let mut other = scene.clone();
        for shape in scene.others.iter().filter(|it| it.name.len() > 3) {
            other.world.motion = shape.deformation.clone();
            show(&shape.name, &other, AS_TRAINED)?;
        }
        let mut correlated = Experiment::load("moving")?.world.noise;
        (correlated.correlated_level, correlated.level, correlated.time_constant_ms) =
            (correlated.level, 0.0, 20.0);
        let mut other = scene.clone();
        other.world.noise = device.averaged(correlated, wires, samples);
        show("noise of 20 ms", &other, AS_TRAINED)?;
    }
    if broken.is_empty() { Ok(()) } else { Err(Error::failed(broken.join("\n"))) }
}

//! Equation 6 as a decoder: what solving it says of a row's deformation, by noise, and how many deformations read alike.

use crate::equations::Equations;
use rayon::prelude::*;
use serde::Serialize;
use taxel_data::progress::Progress;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_limit::solve::Solution;
use taxel_simulate::Synthesis;

use crate::level::{NoiseLevel, Solved, at_noise, check};
use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::metrics::{DecoderErrors, LimitSummary};

/// Noise levels of the study, the largest first.
pub const NOISE_LEVELS: [f64; 8] = [0.1, 0.05, 0.01, 0.005, 1e-3, 1e-4, 1e-5, 0.0];
/// Largest difference in mm of two deformations that count as one.
const SAME_MM: f64 = 1e-3;
/// Largest error of z in mm that counts as none.
const NONE_MM: f64 = 1e-6;

/// Number of searches for other deformations that read alike, for each row of a frame.
const SEARCHES: usize = 24;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EquationsResult {
    pub subject: String,
    pub seed: u64,
    pub frames: usize,
    /// Number of rows that were solved at each level: those of all test frames.
    pub rows: usize,
    pub training_frames: usize,
    /// Errors by noise, without noise first.
    pub levels: Vec<Level>,
    /// What solving gives without noise, by row-wire.
    pub without_noise: Vec<RowWire>,
    /// Searches for other deformations that read alike, for each row of a frame.
    pub searches: usize,
}

/// Errors at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// Noise level p, as a fraction.
    pub noise_level: f64,
    /// Share of the rows for which an exact solution in the box was found.
    pub percent_solved: f64,
    /// Errors on the test frames. All rows count: one that is not solved has the last place of the search.
    pub decoders: Vec<DecoderErrors>,
    pub limit: LimitSummary,
}

at_noise!(Level);

/// What solving the equations of one row-wire gives without noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowWire {
    /// Row-wire, from 1.
    pub row_wire: usize,
    /// Share of the rows solved to the true deformation.
    pub percent_true: f64,
    /// Share of the rows solved to another deformation that reads alike.
    pub percent_other: f64,
    /// Share of the rows without a solution.
    pub percent_unsolved: f64,
    /// Share of the rows for which this search or another one from elsewhere came to the true deformation.
    pub percent_reached: f64,
    /// Share of the rows whose z is off by less than 1e-6 mm at every electrode.
    pub percent_z_exact: f64,
    /// Share of the rows with more than one deformation within the scene's ranges that gives their readings.
    pub percent_ambiguous: f64,
    /// Most deformations within the scene's ranges that were found for the readings of one row.
    pub most_alike: usize,
    /// Share of the rows that any decoder can tell at most: it chooses the most probable of these deformations. Only
    /// where electrodes move independently and uniformly.
    pub percent_any_decoder: Option<f64>,
    /// Share of the deformations at which the determinant of ∂ln R/∂Δ has another sign than at rest.
    pub percent_turned: Option<f64>,
}

impl EquationsResult {
    /// Shares over all row-wires, of which each has as many rows. Its row-wire is 0.
    pub fn all_rows(&self) -> Option<RowWire> {
        let rows = &self.without_noise;
        let mean = |of: &dyn Fn(&RowWire) -> f64| {
            rows.iter().map(of).sum::<f64>() / rows.len().max(1) as f64
        };
        let optional = |of: &dyn Fn(&RowWire) -> Option<f64>| {
            let all: Option<Vec<f64>> = rows.iter().map(of).collect();
            all.map(|all| all.iter().sum::<f64>() / rows.len().max(1) as f64)
        };
        Some(RowWire {
            row_wire: 0,
            percent_true: mean(&|row| row.percent_true),
            percent_other: mean(&|row| row.percent_other),
            percent_unsolved: mean(&|row| row.percent_unsolved),
            percent_reached: mean(&|row| row.percent_reached),
            percent_z_exact: mean(&|row| row.percent_z_exact),
            percent_ambiguous: mean(&|row| row.percent_ambiguous),
            most_alike: rows.iter().map(|row| row.most_alike).max()?,
            percent_any_decoder: optional(&|row| row.percent_any_decoder),
            percent_turned: optional(&|row| row.percent_turned),
        })
    }
}

/// Solves the equations of the scene's test frames at every level of noise, and judges that beside trained decoders.
pub fn study(
    experiment: &Experiment,
    frames: usize,
    progress: &dyn Progress,
) -> Result<EquationsResult> {
    check(experiment, frames)?;
    let (mut levels, mut no_limit, mut without_noise) = (Vec::new(), None, Vec::new());
    let mut training_frames = 0;
    for noise_level in NOISE_LEVELS {
        let level = NoiseLevel::new(experiment, noise_level, frames, &mut no_limit, progress);
        let (world, readings) = (&level.scene.world, &level.test.inputs.values);
        progress.stage(&format!("equations, noise {noise_level}"), 1);
        let exact = Equations::exact(world);
        let solved = exact.solve_all(readings);
        let found = solved.iter().filter(|solution| solution.converged).count();
        let mut decoders = vec![
            level.judge(&Solved(&exact, &solved)),
            level.judge(&Equations::damped(world, noise_level)),
        ];
        progress.step();
        if noise_level == 0.0 {
            without_noise = by_row_wire(&level, &exact, &solved, progress);
        }
        decoders.extend(level.trained(progress)?);
        training_frames = level.scene.training.frames;
        levels.push(Level {
            noise_level,
            percent_solved: percent(found, solved.len()),
            decoders,
            limit: level.limit,
        });
    }
    levels.reverse();
    Ok(EquationsResult {
        subject: experiment.name.clone(),
        seed: experiment.world.seed,
        frames,
        rows: frames * experiment.world.read_rows.len(),
        training_frames,
        levels,
        without_noise,
        searches: SEARCHES,
    })
}

fn percent(count: usize, of: usize) -> f64 {
    100.0 * count as f64 / of as f64
}

/// Largest difference of two deformations, at every third entry from `first` on by `step`.
fn largest_difference(a: &[f64], b: &[f64], first: usize, step: usize) -> f64 {
    let pairs = a.iter().zip(b).skip(first).step_by(step);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Whether two deformations are not the same one.
fn is_other(a: &[f64], b: &[f64]) -> bool {
    largest_difference(a, b, 0, 1) > SAME_MM
}

/// What is found of one row of one frame.
struct OfRow {
    /// Whether the row was solved, and if so to the truth.
    is_true: Option<bool>,
    is_reached: bool,
    z_is_exact: bool,
    alike: usize,
    /// Probability of the most probable one of the deformations that read alike.
    probability: f64,
    turned: Option<bool>,
}

fn by_row_wire(
    level: &NoiseLevel,
    equations: &Equations<'_>,
    solved: &[Solution],
    progress: &dyn Progress,
) -> Vec<RowWire> {
    let world = &level.scene.world;
    let (rows, columns) = (world.read_rows.len(), world.sensor.column_wires);
    let unknowns = 3 * world.sensor.electrodes_per_row_wire;
    let ranges = Synthesis::new(world).ideal().frames(Stream::Span, 4096).outputs.ranges();
    let truths = &level.test.outputs.values;
    progress.stage("deformations that read alike", solved.len());
    let of_row = |n: usize| {
        let place = n % rows;
        let truth = &truths[n * unknowns..(n + 1) * unknowns];
        let readings = &level.test.inputs.values[n * columns..(n + 1) * columns];
        let ranges = &ranges[place * unknowns..(place + 1) * unknowns];
        let mut alike = vec![truth.to_vec()];
        let mut random =
            Random::new(world.seed, Stream::Test, Purpose::Posterior, n as u64, place as u64);
        let others = (0..SEARCHES).map(|_| {
            let start = ranges.iter().map(|range| random.between(*range));
            equations.solve_row(place, readings, &start.collect::<Vec<_>>())
        });
        let mut is_reached = false;
        for other in std::iter::once(solved[n].clone()).chain(others) {
            let inside = other.place.iter().zip(ranges).all(|(x, r)| (r[0]..=r[1]).contains(x));
            is_reached |= other.converged && !is_other(truth, &other.place);
            let is_new = |known: &Vec<f64>| is_other(known, &other.place);
            if other.converged && inside && alike.iter().all(is_new) {
                alike.push(other.place);
            }
        }
        progress.step();
        let determinants: Option<Vec<f64>> =
            alike.iter().map(|at| equations.determinant(place, at)).collect();
        let densities = determinants.iter().flatten().map(|d| 1.0 / d.abs());
        let largest = densities.clone().fold(0.0, f64::max);
        let at_rest = equations.determinant(place, &vec![0.0; unknowns]);
        let found = &solved[n];
        let is_true = found.converged.then(|| !is_other(truth, &found.place));
        OfRow {
            is_true,
            is_reached,
            z_is_exact: largest_difference(&found.place, truth, 2, 3) < NONE_MM,
            alike: alike.len(),
            probability: largest / densities.sum::<f64>(),
            turned: at_rest.zip(determinants).map(|(rest, all)| (rest > 0.0) != (all[0] > 0.0)),
        }
    };
    let found: Vec<OfRow> = (0..solved.len()).into_par_iter().map(of_row).collect();
    let of_wire = |(place, row): (usize, &usize)| {
        let found = || found.iter().skip(place).step_by(rows);
        let count = found().count();
        let share =
            |has: &dyn Fn(&OfRow) -> bool| percent(found().filter(|it| has(it)).count(), count);
        let (percent_true, percent_other) =
            (share(&|it| it.is_true == Some(true)), share(&|it| it.is_true == Some(false)));
        let probability: f64 = found().map(|it| it.probability).sum();
        RowWire {
            row_wire: row + 1,
            percent_true,
            percent_other,
            percent_unsolved: share(&|it| it.is_true.is_none()),
            percent_reached: share(&|it| it.is_reached),
            percent_z_exact: share(&|it| it.z_is_exact),
            percent_ambiguous: share(&|it| it.alike > 1),
            most_alike: found().map(|it| it.alike).max().unwrap_or(0),
            percent_any_decoder: (world.motion.has_independent_rows() && probability.is_finite())
                .then(|| 100.0 * probability / count as f64),
            percent_turned: found()
                .all(|it| it.turned.is_some())
                .then(|| share(&|it| it.turned == Some(true))),
        }
    };
    world.read_rows.iter().enumerate().map(of_wire).collect()
}

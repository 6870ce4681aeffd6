//! Training and test error by centres K, spread and number of samples N; and the paper's claims on them.
//!
//! Networks are the paper's: Gaussians of one width and a bias, without affine tail, in f64. Centres are those of K-means,
//! or all samples (K = N), which interpolates.

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use taxel_data::dataset::{Dataset, RowTable};
use taxel_data::error::require;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_data::{BadValue, columns};
use taxel_learn::Options;
use taxel_learn::train::least_squares::{Factor, Regressors, predict};
use taxel_learn::train::{INITIAL_COVARIANCE, InputScale, Samples, check_spread};
use taxel_simulate::Synthesis;
use taxel_simulate::world::check_noise_level;

use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::Experiment;

mod claims;

pub use claims::Claim;

/// Most samples that are all taken as centres: the work grows with their cube.
pub const MOST_INTERPOLATED: usize = 1000;
/// Samples of all training sets of a map together, at least, but for [`MOST_SETS`]: few samples differ from draw to draw.
const SAMPLES_IN_ALL: usize = 1000;
/// Most training sets of a map.
const MOST_SETS: usize = 10;

#[derive(Debug, Clone, PartialEq, Args)]
pub struct Plan {
    /// Numbers of samples N.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = Self::default().samples)]
    pub samples: Vec<usize>,
    /// Centres K; those below N, and N itself up to 1000.
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_values_t = Self::default().centres)]
    pub centres: Vec<usize>,
    /// Spreads.
    #[arg(long = "spread", value_name = "S,…", value_delimiter = ',', default_values_t = Self::default().spreads, allow_negative_numbers = true)]
    pub spreads: Vec<f64>,
    /// Noise levels as fractions (0.01 is 1 %).
    #[arg(long = "noise", value_name = "LEVEL,…", value_delimiter = ',', default_values_t = Self::default().noise_levels, allow_negative_numbers = true)]
    pub noise_levels: Vec<f64>,
    /// Test frames.
    #[arg(long, value_name = "N", default_value_t = Self::default().test_frames)]
    pub test_frames: usize,
    /// Initial covariance δ: output weights have a penalty of 1/δ on their squares.
    #[arg(long, value_name = "DELTA", default_value_t = Self::default().initial_covariance, allow_negative_numbers = true)]
    pub initial_covariance: f64,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            samples: vec![30, 100, 300, 1000, 6000],
            centres: vec![4, 8, 16, 32, 64, 128, 256],
            spreads: (1..=10).map(|tenths| f64::from(tenths) / 10.0).collect(),
            noise_levels: vec![0.005, 0.1],
            test_frames: 2000,
            initial_covariance: INITIAL_COVARIANCE,
        }
    }
}

impl Plan {
    pub fn check(&self) -> std::result::Result<(), BadValue> {
        let lists = [
            ("samples", self.samples.len(), self.samples.is_sorted_by(|a, b| a < b)),
            ("centres", self.centres.len(), self.centres.is_sorted_by(|a, b| a < b)),
            ("spreads", self.spreads.len(), self.spreads.is_sorted_by(|a, b| a < b)),
            ("noise_levels", self.noise_levels.len(), self.noise_levels.is_sorted_by(|a, b| a < b)),
        ];
        for (field, count, ascending) in lists {
            require(count > 0 && ascending, field, format!("{count} values"), || {
                "list at least one value, each larger than the one before".into()
            })?;
        }
        for &samples in &self.samples {
            require((4..=100_000).contains(&samples), "samples", samples, || {
                "give numbers from 4 to 100000".into()
            })?;
        }
        for &centres in &self.centres {
            require((1..=1024).contains(&centres), "centres", centres, || {
                "give numbers from 1 to 1024: the work grows with their square".into()
            })?;
        }
        require(self.test_frames > 0, "test_frames", 0, || "give at least 1".into())?;
        let covariance = self.initial_covariance;
        require((1e-3..=1e15).contains(&covariance), "initial_covariance", covariance, || {
            "give a number from 1e-3 to 1e15, such as 1e6".into()
        })?;
        self.spreads.iter().try_for_each(|spread| check_spread("spreads", *spread))?;
        self.noise_levels.iter().try_for_each(|level| check_noise_level("noise_levels", *level))
    }

    /// Numbers of centres that are tried on so many `samples`.
    fn centres_for(&self, samples: usize) -> Vec<usize> {
        let below = self.centres.iter().copied().filter(|centres| *centres < samples);
        below.chain((samples <= MOST_INTERPOLATED).then_some(samples)).collect()
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapStudy {
    pub subject: String,
    pub seed: u64,
    /// Row-wire that is read, from 1.
    pub row_wire: usize,
    pub group: String,
    pub unit: String,
    pub test_frames: usize,
    pub initial_covariance: f64,
    /// Numbers of centres K that were tried; besides these N itself.
    pub centres: Vec<usize>,
    pub spreads: Vec<f64>,
    /// Maps, by noise level and then by number of samples.
    pub maps: Vec<Map>,
    /// The paper's claims, judged on the maps.
    pub claims: Vec<Claim>,
}

/// Errors with a number of samples and a noise level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// Noise level of training and test frames, as a fraction.
    pub noise_level: f64,
    pub samples: usize,
    /// Number of training sets whose squared errors are averaged.
    pub training_sets: usize,
    /// RMSE of always predicting the mean of the samples, on the test frames.
    pub mean_rmse: f64,
    /// RMSE of always predicting the mean of the samples, on the samples themselves.
    pub mean_training_rmse: f64,
    /// Errors, by centres and then by spread.
    pub cells: Vec<Cell>,
}

/// Errors of networks with a number of centres and a spread.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cell {
    pub centres: usize,
    pub spread: f64,
    /// RMSE on the samples themselves.
    pub training_rmse: f64,
    /// RMSE on the test frames.
    pub test_rmse: f64,
}

impl Map {
    /// Cell with the least test error among those that `allow` lets pass.
    pub fn best(&self, allow: impl Fn(&Cell) -> bool) -> Option<&Cell> {
        let cells = self.cells.iter().filter(|cell| allow(cell));
        cells.min_by(|a, b| a.test_rmse.total_cmp(&b.test_rmse))
    }
}

/// Computes the maps for the one row-wire that the scene of `experiment` reads, and for `group` of its outputs.
///
/// # Panics
/// If the scene reads more than one row-wire, or has no such group.
pub fn compute(
    experiment: &Experiment,
    group: &str,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<MapStudy> {
    plan.check()?;
    assert_eq!(experiment.world.read_rows.len(), 1, "one row-wire");
    let names = experiment.world.output_names();
    let groups = columns::groups(&names);
    let found = groups.iter().find(|(name, _)| *name == group);
    let (_, members) = found.expect("a group of the scene");
    let wanted = Wanted { group: members, plan, seed: experiment.world.seed };
    progress.stage("synthesise", plan.noise_levels.len());
    let mut cases = Vec::new();
    for &noise_level in &plan.noise_levels {
        let synthesis = Synthesis::new(&experiment.world).noise_level(noise_level);
        let frames = |stream, count| experiment.dataset(&synthesis, stream, count);
        let most = plan.samples.iter().map(|samples| samples * training_sets(*samples)).max();
        let training = frames(Stream::Training, most.unwrap_or_default());
        let test = frames(Stream::Test, plan.test_frames).row_table(0);
        for &samples in &plan.samples {
            let sets = 0..training_sets(samples);
            let sets = sets.map(|set| TrainingSet::new(&training, set, samples, &test, members));
            cases.push((noise_level, sets.collect::<Vec<_>>()));
        }
        progress.step();
    }
    let tasks: Vec<(usize, usize, usize)> = cases
        .iter()
        .enumerate()
        .flat_map(|(case, (_, sets))| {
            let centres = plan.centres_for(sets[0].samples.inputs.len());
            let of_set = move |set| centres.clone().into_iter().map(move |k| (case, set, k));
            (0..sets.len()).flat_map(of_set).collect::<Vec<_>>()
        })
        .collect();
    progress.stage("fit networks", tasks.len());
    let squares: Vec<Vec<[f64; 2]>> = tasks
        .par_iter()
        .map(|&(case, set, centres)| {
            let squares = wanted.squares(&cases[case].1[set], centres);
            progress.step();
            squares
        })
        .collect();
    let maps: Vec<Map> = cases
        .iter()
        .enumerate()
        .map(|(case, (noise_level, sets))| {
            let of_case = tasks.iter().zip(&squares).filter(|((of, ..), _)| *of == case);
            let found: Vec<(usize, &Vec<[f64; 2]>)> =
                of_case.map(|((_, _, centres), squares)| (*centres, squares)).collect();
            map(*noise_level, sets, &found, plan)
        })
        .collect();
    let claims = claims::judge(plan, &maps);
    Ok(MapStudy {
        subject: experiment.name.clone(),
        seed: experiment.world.seed,
        row_wire: experiment.world.read_rows[0] + 1,
        group: group.into(),
        unit: columns::unit_of(group).into(),
        test_frames: plan.test_frames,
        initial_covariance: plan.initial_covariance,
        centres: plan.centres.clone(),
        spreads: plan.spreads.clone(),
        maps,
        claims,
    })
}

/// Number of training sets of so many `samples` whose errors are averaged.
fn training_sets(samples: usize) -> usize {
    (SAMPLES_IN_ALL / samples).clamp(1, MOST_SETS)
}

/// Map of the mean squared errors that were `found` for each number of centres on each training set.
fn map(
    noise_level: f64,
    sets: &[TrainingSet],
    found: &[(usize, &Vec<[f64; 2]>)],
    plan: &Plan,
) -> Map {
    let samples = sets[0].samples.inputs.len();
    let count = sets.len() as f64;
    let cell = |centres: usize, place: usize, spread: f64| {
        let of_centres = found.iter().filter(|(k, _)| *k == centres);
        let mut sums = [0.0; 2];
        of_centres.for_each(|(_, squares)| {
            sums.iter_mut().zip(squares[place]).for_each(|(sum, square)| *sum += square);
        });
        let [training_rmse, test_rmse] = sums.map(|sum| (sum / count).sqrt());
        Cell { centres, spread, training_rmse, test_rmse }
    };
    let centres = plan.centres_for(samples).into_iter();
    let cells = centres.flat_map(|centres| {
        plan.spreads.iter().enumerate().map(move |(place, spread)| (centres, place, *spread))
    });
    let of_mean = |targets: fn(&TrainingSet) -> &[f64]| {
        let squares = sets.iter().map(|set| mean_square(targets(set)));
        (squares.sum::<f64>() / count).sqrt()
    };
    Map {
        noise_level,
        samples,
        training_sets: sets.len(),
        mean_rmse: of_mean(|set| &set.test_targets),
        mean_training_rmse: of_mean(|set| &set.targets),
        cells: cells.map(|(centres, place, spread)| cell(centres, place, spread)).collect(),
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
}

/// Samples to train on, and test frames as they are scaled by these.
struct TrainingSet {
    number: usize,
    samples: RowTable,
    /// Scaled inputs of the samples and of the test frames.
    scaled: Vec<f64>,
    test_scaled: Vec<f64>,
    /// Deviations of the outputs from the samples' means.
    targets: Vec<f64>,
    test_targets: Vec<f64>,
}

impl TrainingSet {
    fn new(
        training: &Dataset,
        number: usize,
        samples: usize,
        test: &RowTable,
        group: &[usize],
    ) -> Self {
        let indices: Vec<usize> = (number * samples..(number + 1) * samples).collect();
        let samples = training.subset(&indices).row_table(0);
        let scale = InputScale::new(&samples);
        let means = samples.outputs.means();
        let deviations = |table: &RowTable| -> Vec<f64> {
            let of_line =
                |line: &[f64]| group.iter().map(|c| line[*c] - means[*c]).collect::<Vec<_>>();
            table.outputs.lines().flat_map(of_line).collect()
        };
        Self {
            number,
            scaled: scale.apply(&samples.inputs.values),
            test_scaled: scale.apply(&test.inputs.values),
            targets: deviations(&samples),
            test_targets: deviations(test),
            samples,
        }
    }
}

/// What is fitted to every training set.
struct Wanted<'p> {
    /// Columns of the outputs.
    group: &'p [usize],
    plan: &'p Plan,
    seed: u64,
}

impl Wanted<'_> {
    /// Mean squared errors on the samples and on the test frames, for every spread.
    fn squares(&self, set: &TrainingSet, centres: usize) -> Vec<[f64; 2]> {
        let samples = Samples::new(&set.samples);
        let centres = if centres == set.samples.inputs.len() {
            set.scaled.clone()
        } else {
            let mut options = Options { centres, seed: self.seed, ..Options::default() };
            options.search.most_points = 4096;
            options.search.restarts = 1;
            samples.centres(&options, set.number)
        };
        let outputs = self.group.len();
        let of_spread = |spread: &f64| {
            let regressors = Regressors {
                centres: &centres,
                inputs: set.samples.inputs.names.len(),
                decays: &[1.0 / (2.0 * spread * spread)],
                affine_tail: false,
            };
            let [seen, unseen] = [&set.scaled, &set.test_scaled].map(|x| regressors.of(x));
            let covariance = self.plan.initial_covariance;
            let weights = Factor::new(&seen, &set.targets, outputs, covariance).weights();
            [(seen, &set.targets), (unseen, &set.test_targets)].map(|(design, targets)| {
                let mut errors = predict(&design, 0..targets.len() / outputs, &weights, outputs);
                errors.iter_mut().zip(targets).for_each(|(error, target)| *error -= target);
                mean_square(&errors)
            })
        };
        self.plan.spreads.iter().map(of_spread).collect()
    }
}

#[cfg(test)]
mod tests;

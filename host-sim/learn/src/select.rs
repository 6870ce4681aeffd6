//! Selection of K and spread by k-fold cross-validation.

use rayon::prelude::*;
use serde::Serialize;
use taxel_data::BadValue;
use taxel_data::dataset::Dataset;
use taxel_data::progress::{Progress, Silent};
use taxel_data::random::{Purpose, Random, Stream};

use crate::decoders::{BASELINES, Baseline};
use crate::error::Result;
use crate::infer::{Exponential, infer};
use crate::train::{
    self, Examples, FittedNetwork, Layers, Options, Refinement, check_spread,
    refine::{self, LEAST_FOLDS},
};

/// Result of one candidate on the folds that it was not trained on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// Number of centres, K.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// RMSE of each output over all held-out samples, in the output's unit.
    pub rmse: Vec<f64>,
    /// Mean over the outputs of RMSE/standard deviation: the quantity that selection minimises. Outputs
    /// that never change do not count.
    pub score: f64,
}

/// Results of every candidate, and the best one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Selection {
    /// All candidates, by K and then spread.
    pub scored: Vec<Scored>,
    /// Index in `scored` of the lowest score (the first among equals).
    pub best: usize,
    /// Baselines on the same folds, for comparison.
    pub baselines: Vec<BaselineScore>,
}

/// Result of a baseline on the folds that it was not fitted to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineScore {
    /// Name of the baseline.
    pub decoder: &'static str,
    /// RMSE of each output over all held-out samples, in the output's unit.
    pub rmse: Vec<f64>,
}

impl Selection {
    /// Candidate with the lowest score.
    #[must_use]
    pub fn best(&self) -> &Scored {
        &self.scored[self.best]
    }
}

/// Assigns `frames` to `folds` at random, in equal numbers: the fold of each frame, from 0.
#[must_use]
pub fn random_folds(frames: usize, folds: usize, seed: u64) -> Vec<usize> {
    let mut assigned: Vec<usize> = (0..frames).map(|i| i % folds).collect();
    let mut random = Random::new(seed, Stream::Training, Purpose::Folds, 0, 0);
    for i in (1..frames).rev() {
        assigned.swap(i, random.below(i + 1)); // Fisher–Yates
    }
    assigned
}

/// Folds by `values`: frames with equal values share a fold; folds are numbered from 0 by ascending
/// value.
#[must_use]
pub fn number_folds(values: &[f64]) -> Vec<usize> {
    let mut distinct = values.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    values.iter().map(|value| distinct.partition_point(|d| d.total_cmp(value).is_lt())).collect()
}

fn training_part(fold_of: &[usize], fold: usize) -> usize {
    fold_of.iter().filter(|f| **f != fold).count()
}

/// Number of training frames left by the largest fold.
#[must_use]
pub fn smallest_training_part(fold_of: &[usize]) -> usize {
    let folds = fold_of.iter().max().map_or(0, |last| last + 1);
    (0..folds).map(|fold| training_part(fold_of, fold)).min().unwrap_or(0)
}

/// Scores every pair of `centres` and `spreads` by cross-validation.
///
/// `fold_of` gives each frame's fold, numbered from 0; all other options come from `options`. With a `refinement`,
/// spreads are where it starts, and it takes the folds that are not held out as its own.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for fewer than two folds (with a refinement, one more than
/// it needs), no candidate, or a candidate that
/// does not fit the data; otherwise the errors of [`train`](crate::train::train).
pub fn cross_validate(
    dataset: &Dataset,
    fold_of: &[usize],
    centres: &[usize],
    spreads: &[f64],
    options: &Options,
    refinement: Option<&Refinement>,
    progress: &dyn Progress,
) -> Result<Selection> {
    let folds = fold_of.iter().max().map_or(0, |last| last + 1);
    let least = if refinement.is_some() { LEAST_FOLDS + 1 } else { 2 };
    if folds < least {
        let of = if refinement.is_some() { " of refined training" } else { "" };
        let rule = format!("cross-validation{of} needs at least {least}");
        return Err(BadValue::new("folds", folds, rule).into());
    }
    for fold in 0..folds {
        let training = training_part(fold_of, fold);
        for (&centres, &spread) in centres.iter().zip(spreads.iter().cycle()) {
            Options { centres, spread, ..*options }.check(training)?;
        }
    }
    for &spread in spreads {
        check_spread("spread", spread)?;
    }
    let tasks: Vec<(usize, usize)> =
        centres.iter().flat_map(|k| (0..folds).map(move |fold| (*k, fold))).collect();
    progress.stage("cross-validate", tasks.len());
    let squares: Vec<Vec<Vec<f64>>> = tasks
        .into_par_iter()
        .map(|(k, fold)| {
            let options = Options { centres: k, ..*options };
            let squares = held_out_squares(dataset, fold_of, fold, spreads, &options, refinement);
            progress.step();
            squares
        })
        .collect::<Result<_>>()?;

    let deviations = dataset.outputs.deviations();
    let mut scored = Vec::new();
    let root_mean = |squares: f64| (squares / dataset.frames() as f64).sqrt();
    let baselines = BASELINES.iter().map(|baseline| {
        let squares: Vec<Vec<f64>> = (0..folds)
            .into_par_iter()
            .map(|fold| baseline_squares(baseline, dataset, fold_of, fold))
            .collect();
        let rmse = |output: usize| root_mean(squares.iter().map(|fold| fold[output]).sum());
        BaselineScore { decoder: baseline.name, rmse: (0..deviations.len()).map(rmse).collect() }
    });
    let baselines = baselines.collect();
    for (k, of_folds) in centres.iter().zip(squares.chunks_exact(folds)) {
        for (s, spread) in spreads.iter().enumerate() {
            let rmse: Vec<f64> = (0..deviations.len())
                .map(|output| root_mean(of_folds.iter().map(|fold| fold[s][output]).sum()))
                .collect();
            let relative: Vec<f64> = rmse
                .iter()
                .zip(&deviations)
                .filter(|(_, deviation)| **deviation > 0.0)
                .map(|(rmse, deviation)| rmse / deviation)
                .collect();
            let score = relative.iter().sum::<f64>() / relative.len().max(1) as f64;
            scored.push(Scored { centres: *k, spread: *spread, rmse, score });
        }
    }
    let best =
        (0..scored.len()).min_by(|a, b| scored[*a].score.total_cmp(&scored[*b].score)).ok_or_else(
            || BadValue::new("candidates", 0, "give at least one value of K and of spread"),
        )?;
    Ok(Selection { scored, best, baselines })
}

/// Sums of squared errors on one fold, `[spread][output]`, after training on the others.
fn held_out_squares(
    dataset: &Dataset,
    fold_of: &[usize],
    fold: usize,
    spreads: &[f64],
    options: &Options,
    refinement: Option<&Refinement>,
) -> Result<Vec<Vec<f64>>> {
    let (training, test) = split(dataset, fold_of, fold);
    let others = fold_of.iter().filter(|f| **f != fold);
    let inner: Vec<usize> = others.map(|f| if *f > fold { f - 1 } else { *f }).collect();
    let start = Layers::start(&training, options)?;
    let of_spread = |spread: &f64| {
        let mut layers = start.clone();
        layers.hidden.iter_mut().for_each(|layer| layer.spread = *spread);
        let mut options = *options;
        if let Some(settings) = refinement {
            let examples = Examples::Folds(&inner);
            layers = refine::refine(&training, &layers, &options, settings, examples, &Silent)?;
            options = settings.options(&options, training.frames());
        }
        let trained = train::fit(&training, layers, &options, &Silent)?;
        let networks = trained.networks.iter().enumerate();
        let of_row = |(row, network): (usize, &FittedNetwork)| {
            let test = test.row_table(row);
            let network = network.network();
            let predicted = infer(&network, Exponential::default(), &test.inputs.values);
            test.outputs.squared_errors(&predicted)
        };
        Ok(networks.flat_map(of_row).collect())
    };
    spreads.iter().map(of_spread).collect()
}

/// Sums of squared errors of a baseline on one fold, `[output]`, after fitting it to the others.
fn baseline_squares(
    baseline: &Baseline,
    dataset: &Dataset,
    fold_of: &[usize],
    fold: usize,
) -> Vec<f64> {
    let (training, test) = split(dataset, fold_of, fold);
    let predicted = baseline.fit(&training).decode_all(&test.inputs.values, 1);
    test.outputs.squared_errors(&predicted.values)
}

/// Training part and held-out part of a data set, for one fold.
fn split(dataset: &Dataset, fold_of: &[usize], fold: usize) -> (Dataset, Dataset) {
    let (held, kept): (Vec<usize>, Vec<usize>) =
        (0..dataset.frames()).partition(|i| fold_of[*i] == fold);
    (dataset.subset(&kept), dataset.subset(&held))
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::table::Table;

    /// Data set whose output y follows two inputs, while `constant` never changes.
    fn dataset(outputs: &[&str]) -> Dataset {
        let mut random = Random::new(3, Stream::Training, Purpose::Noise, 0, 0);
        let (mut inputs, mut values) = (Vec::new(), Vec::new());
        for _ in 0..400 {
            let (a, b) = (random.unit(), random.unit());
            inputs.extend([a, b]);
            let of = |name: &&str| if *name == "y" { (9.0 * a).sin() * b } else { 5.0 };
            values.extend(outputs.iter().map(of));
        }
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect();
        Dataset {
            common_span: false,
            relative_inputs: false,
            inputs: Table { names: names(&["a", "b"]), values: inputs },
            outputs: Table { names: names(outputs), values },
            rows: 1,
        }
    }

    fn best_spread(outputs: &[&str]) -> f64 {
        let dataset = dataset(outputs);
        let folds = random_folds(dataset.frames(), 4, 1);
        let options = Options { centres: 1, spread: 1.0, ..Options::default() };
        let spreads = [0.05, 0.2, 3.0];
        let progress = Silent;
        let selection =
            cross_validate(&dataset, &folds, &[20], &spreads, &options, None, &progress).unwrap();
        assert_eq!(selection.scored.len(), 3);
        selection.best().spread
    }

    #[test]
    fn the_better_spread_is_chosen_whatever_stands_beside() {
        assert_eq!(best_spread(&["y"]), 0.2);
        assert_eq!(best_spread(&["y", "constant"]), 0.2);
    }

    #[test]
    fn equal_values_share_a_fold() {
        assert_eq!(number_folds(&[7.0, -1.0, 7.0, 0.5]), [2, 0, 2, 1]);
        assert_eq!(smallest_training_part(&[2, 0, 2, 1]), 2);
    }

    #[test]
    fn random_folds_are_equal_in_number_and_seeded() {
        let folds = random_folds(103, 5, 7);
        for fold in 0..5 {
            let count = folds.iter().filter(|f| **f == fold).count();
            assert!((20..=21).contains(&count));
        }
        assert_eq!(folds, random_folds(103, 5, 7));
        assert_ne!(folds, random_folds(103, 5, 8));
    }
}

//! Choosing K and spread by k-fold cross-validation.

use rayon::prelude::*;
use serde::Serialize;

use super::{Options, Samples};
use crate::dataset::Dataset;
use crate::error::{Error, Result};
use crate::infer::{Kernel, infer};
use crate::random::{Purpose, Random, Stream};

/// What one candidate scored on the folds that it was not trained on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// Centres, K.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// RMSE of each output over all held-out samples, in the output's unit.
    pub rmse: Vec<f64>,
    /// Mean over the outputs of RMSE/standard deviation: what is minimised.
    pub score: f64,
}

/// Every candidate, and the best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Selection {
    /// All candidates, by K and then spread.
    pub scored: Vec<Scored>,
    /// Place of the one with the lowest score (the first among equals).
    pub best: usize,
}

impl Selection {
    /// The candidate with the lowest score.
    #[must_use]
    pub fn best(&self) -> &Scored {
        &self.scored[self.best]
    }
}

/// Assigns `frames` to `folds` at random, in equal numbers.
#[must_use]
pub fn random_folds(frames: usize, folds: usize, seed: u64) -> Vec<usize> {
    let mut assigned: Vec<usize> = (0..frames).map(|i| i % folds).collect();
    let mut random = Random::new(seed, Stream::Training, Purpose::Folds, 0, 0);
    for i in (1..frames).rev() {
        assigned.swap(i, random.below(i + 1)); // Fisher–Yates
    }
    assigned
}

/// Scores every pair of `centres` and `spreads` by cross-validation; `fold_of` gives each frame's
/// fold, numbered from 0. Everything else comes from `options`.
///
/// # Errors
/// [`Error::Usage`] if there are fewer than two folds, or a candidate does not fit the data.
pub fn cross_validate(
    dataset: &Dataset,
    fold_of: &[usize],
    centres: &[usize],
    spreads: &[f64],
    options: &Options,
) -> Result<Selection> {
    let folds = fold_of.iter().max().map_or(0, |last| last + 1);
    if folds < 2 {
        return Err(Error::Usage(format!(
            "cross-validation needs at least 2 folds; the data has {folds}"
        )));
    }
    for fold in 0..folds {
        let training = fold_of.iter().filter(|f| **f != fold).count();
        for (&centres, &spread) in centres.iter().zip(spreads.iter().cycle()) {
            Options { centres, spread, ..*options }.check(training)?;
        }
    }
    for &spread in spreads {
        Options { centres: 1, spread, ..*options }.check(1)?;
    }
    let tasks: Vec<(usize, usize)> =
        centres.iter().flat_map(|k| (0..folds).map(move |fold| (*k, fold))).collect();
    let squares: Vec<Vec<Vec<f64>>> = tasks
        .into_par_iter()
        .map(|(k, fold)| {
            held_out_squares(dataset, fold_of, fold, spreads, &Options { centres: k, ..*options })
        })
        .collect::<Result<_>>()?;

    let deviations = standard_deviations(dataset);
    let mut scored = Vec::new();
    for (k, of_folds) in centres.iter().zip(squares.chunks_exact(folds)) {
        for (s, spread) in spreads.iter().enumerate() {
            let mean_square = |output: usize| {
                let sum: f64 = of_folds.iter().map(|fold| fold[s][output]).sum();
                sum / dataset.frames() as f64
            };
            let rmse: Vec<f64> = (0..deviations.len()).map(|o| mean_square(o).sqrt()).collect();
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
    let best = (0..scored.len())
        .min_by(|a, b| scored[*a].score.total_cmp(&scored[*b].score))
        .ok_or_else(|| Error::Usage("give at least one value of K and of spread".into()))?;
    Ok(Selection { scored, best })
}

/// Sums of squared errors on one fold, `[spread][output]`, after training on the others.
fn held_out_squares(
    dataset: &Dataset,
    fold_of: &[usize],
    fold: usize,
    spreads: &[f64],
    options: &Options,
) -> Result<Vec<Vec<f64>>> {
    let (held, kept): (Vec<usize>, Vec<usize>) =
        (0..dataset.frames()).partition(|i| fold_of[*i] == fold);
    let (training, test) = (dataset.subset(&kept), dataset.subset(&held));
    let mut squares = vec![Vec::new(); spreads.len()];
    for row in 0..dataset.rows {
        let (block, test) = (training.block(row), test.block(row));
        let samples = Samples::new(&block);
        let centres = samples.centres(options, row);
        for (squares, &spread) in squares.iter_mut().zip(spreads) {
            let fitted = samples.fit(&centres, &Options { spread, ..*options })?;
            let predicted = infer(&fitted.network(), Kernel::Polynomial, &test.inputs);
            let outputs = test.outputs.names.len();
            let mut sums = vec![0.0; outputs];
            for (predicted, truth) in predicted.chunks_exact(outputs).zip(test.outputs.lines()) {
                for (sum, (p, t)) in sums.iter_mut().zip(predicted.iter().zip(truth)) {
                    *sum += (p - t) * (p - t);
                }
            }
            squares.extend(sums);
        }
    }
    Ok(squares)
}

fn standard_deviations(dataset: &Dataset) -> Vec<f64> {
    let (n, count) = (dataset.outputs.names.len(), dataset.frames() as f64);
    let mut means = vec![0.0; n];
    for line in dataset.outputs.lines() {
        means.iter_mut().zip(line).for_each(|(m, v)| *m += v / count);
    }
    let mut variances = vec![0.0; n];
    for line in dataset.outputs.lines() {
        for (variance, (value, mean)) in variances.iter_mut().zip(line.iter().zip(&means)) {
            *variance += (value - mean) * (value - mean) / count;
        }
    }
    variances.into_iter().map(f64::sqrt).collect()
}

//! Folds of measured frames, for cross-validation and for refinement.

use taxel_data::{Dataset, Purpose, Random, Stream, Table};

use crate::decoders::Baseline;
use crate::parallel;

/// Frames that baselines decode at once.
const FRAMES_AT_ONCE: usize = 8192;

/// Assigns `frames` to `folds` at random, in equal numbers: the fold of each frame, from 0.
pub fn random_folds(frames: usize, folds: usize, seed: u64) -> Vec<usize> {
    let mut assigned: Vec<usize> = (0..frames).map(|i| i % folds).collect();
    let mut random = Random::new(seed, Stream::Training, Purpose::Folds, 0, 0);
    for i in (1..frames).rev() {
        assigned.swap(i, random.below(i + 1)); // Fisher–Yates
    }
    assigned
}

/// Assigns `frames` to `folds` in their order, in equal numbers: the first ones to fold 0, and so on.
///
/// Neighbours of a log resemble each other. With random folds each held-out frame has neighbours in training, so that
/// errors look smaller than they are on a new log; with blocks only the ends of a block have any.
pub fn block_folds(frames: usize, folds: usize) -> Vec<usize> {
    (0..frames).map(|frame| frame * folds / frames).collect()
}

/// Folds by `values`: frames with equal values share a fold; folds are numbered from 0 by ascending
/// value.
pub fn number_folds(values: &[f64]) -> Vec<usize> {
    let mut distinct = values.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    values.iter().map(|value| distinct.partition_point(|d| d.total_cmp(value).is_lt())).collect()
}

/// Number of training frames left by the largest fold: of those that have an output, for the output that has fewest.
pub fn smallest_training_part(fold_of: &[usize], outputs: &Table) -> usize {
    let folds = fold_of.iter().max().map_or(0, |last| last + 1);
    let mut held_out = vec![vec![0; outputs.names.len()]; folds];
    for (fold, line) in fold_of.iter().zip(outputs.lines()) {
        held_out[*fold].iter_mut().zip(line).for_each(|(n, v)| *n += usize::from(!v.is_nan()));
    }
    let counts = outputs.counts();
    let left = held_out.iter().flat_map(|fold| counts.iter().zip(fold).map(|(all, n)| all - n));
    left.min().unwrap_or(0)
}

/// RMSE of a baseline on folds that it was not fitted to, for each output, in its unit. `fold_of` gives each frame's fold,
/// numbered from 0. It is NaN for an output without a value. `None` for a baseline that cannot be fitted.
pub fn baseline_rmse(
    baseline: &Baseline,
    dataset: &Dataset,
    fold_of: &[usize],
) -> Option<Vec<f64>> {
    let folds = fold_of.iter().max().map_or(0, |last| last + 1);
    let squares = parallel::map(folds, &|fold| baseline_squares(baseline, dataset, fold_of, fold));
    let squares: Vec<Vec<f64>> = squares.into_iter().collect::<Option<_>>()?;
    Some(pooled_rmse(&squares, &dataset.outputs))
}

/// RMSE of each of `outputs` over all folds, in its unit, from the sums of squared errors on each fold, `[fold][output]`. It is
/// NaN for an output without a value.
pub fn pooled_rmse(squares: &[Vec<f64>], outputs: &Table) -> Vec<f64> {
    let of = |(output, count): (usize, usize)| {
        let sum: f64 = squares.iter().map(|fold| fold[output]).sum();
        (sum / count as f64).sqrt()
    };
    outputs.counts().into_iter().enumerate().map(of).collect()
}

/// Sums of squared errors of a baseline on one fold, `[output]`, after fitting it to the others.
fn baseline_squares(
    baseline: &Baseline,
    dataset: &Dataset,
    fold_of: &[usize],
    fold: usize,
) -> Option<Vec<f64>> {
    let (held, kept) = split(fold_of, fold);
    let decoder = baseline.fit_to(dataset, &kept)?;
    let mut sums = vec![0.0; dataset.outputs.names.len()];
    for lines in held.chunks(FRAMES_AT_ONCE) {
        let test = dataset.subset(lines);
        let predicted = decoder.decode_all(&test.inputs.values, 1);
        test.outputs.add_squared_errors(&predicted.values, &mut sums);
    }
    Some(sums)
}

/// Frames that are held out, and all others, for one fold: indices from 0.
pub fn split(fold_of: &[usize], fold: usize) -> (Vec<usize>, Vec<usize>) {
    (0..fold_of.len()).partition(|frame| fold_of[*frame] == fold)
}

/// Folds of the frames that are not in `fold`, numbered without a gap.
pub fn without(fold_of: &[usize], fold: usize) -> Vec<usize> {
    let others = fold_of.iter().filter(|f| **f != fold);
    others.map(|f| if *f > fold { f - 1 } else { *f }).collect()
}

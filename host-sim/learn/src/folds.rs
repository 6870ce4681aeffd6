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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_are_numbered_without_the_one_that_is_held_out() {
        assert_eq!(without(&[0, 1, 2, 3, 1, 0], 1), [0, 1, 2, 0]);
    }

    #[test]
    fn blocks_are_equal_in_number_and_follow_one_another() {
        assert_eq!(block_folds(7, 3), [0, 0, 0, 1, 1, 2, 2]);
        assert!(block_folds(1003, 5).is_sorted());
    }

    #[test]
    fn equal_values_share_a_fold() {
        assert_eq!(number_folds(&[7.0, -1.0, 7.0, 0.5]), [2, 0, 2, 1]);
    }

    #[test]
    fn the_output_with_fewest_frames_limits_the_training_part() {
        let outputs = |y: f64| {
            let values = vec![1.0, y, 2.0, y, 3.0, 4.0, 5.0, 6.0];
            Table { names: ["f", "y"].map(String::from).to_vec(), values: values.into() }
        };
        assert_eq!(smallest_training_part(&[2, 0, 2, 1], &outputs(7.0)), 2);
        assert_eq!(smallest_training_part(&[2, 0, 2, 1], &outputs(f64::NAN)), 1);
    }

    #[test]
    fn errors_of_all_folds_count_the_frames_that_have_the_output() {
        let values = vec![1.0, 2.0, f64::NAN, 4.0, 5.0, f64::NAN];
        let outputs = Table { names: ["f", "y"].map(String::from).to_vec(), values: values.into() };
        let rmse = pooled_rmse(&[vec![6.0, 3.0], vec![2.0, 9.0]], &outputs);
        assert_eq!(rmse, [2.0, 6.0_f64.sqrt()]);
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

//! Descent on measured data: on each fold in turn, with an end before it fits noise.

use taxel_data::Progress;

use super::descent::Descent;
use super::movable::Piece;
use crate::error::Result;

/// Steps between two looks at the fold that tells when to stop.
const LOOK_EVERY: usize = 20;
/// Standard errors by which a gain must exceed 0.
const CERTAIN: f64 = 2.0;
/// Least number of samples that tell a gain from chance.
const LEAST_SAMPLES: usize = 30;
/// Descents in all: one to find the number of steps, one to take them.
pub(super) const PASSES: usize = 2;

/// Descends on the samples of `folds` from `start`: as many steps as a fold that is not looked at
/// allows, at most so many `steps`.
pub(super) fn descend(
    start: &Descent,
    folds: &[Vec<Piece>],
    steps: usize,
    progress: &dyn Progress,
) -> Result<Descent> {
    let Some((watched, others)) = folds.split_last() else { return Ok(start.clone()) };
    let (all_others, watched) = (together(others), together([watched]));
    let mut start = start.clone();
    start.hold(&all_others);
    let mut trial = start.clone();
    let at_start = trial.errors(&all_others, &watched)?;
    let (mut best, mut best_gain) = (0, 0.0);
    for step in 0..steps {
        step_on(&mut trial, others, step)?;
        progress.step();
        if (step + 1) % LOOK_EVERY == 0 || step + 1 == steps {
            let now = trial.errors(&all_others, &watched)?;
            let gain = at_start.iter().zip(&now).map(|(a, b)| certain_gain(a, b)).sum();
            if gain > best_gain {
                (best, best_gain) = (step + 1, gain);
            }
        }
    }
    let mut descent = start;
    for step in 0..best {
        step_on(&mut descent, folds, step)?;
        progress.step();
    }
    Ok(descent)
}

/// Samples of all of these folds.
fn together<'p>(folds: impl IntoIterator<Item = &'p Vec<Piece>>) -> Vec<&'p Piece> {
    folds.into_iter().flatten().collect()
}

/// What the mean squared error of a task has fallen by, less what may be chance: [`CERTAIN`] standard errors of the
/// difference. Nothing is certain with few samples.
fn certain_gain(before: &[f64], after: &[f64]) -> f64 {
    if before.len() < LEAST_SAMPLES {
        return 0.0;
    }
    let count = before.len() as f64;
    let gains = || before.iter().zip(after).map(|(before, after)| before - after);
    let mean = gains().sum::<f64>() / count;
    let variance = gains().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0);
    mean - CERTAIN * (variance / count).sqrt()
}

/// Takes step number `step`: one fold is held out, weights are solved on the others.
fn step_on(descent: &mut Descent, folds: &[Vec<Piece>], step: usize) -> Result<()> {
    let held = step % folds.len();
    let rest = folds.iter().enumerate().filter(|(fold, _)| *fold != held).map(|(_, fold)| fold);
    descent.step_held_out(&together(rest), &together([&folds[held]]))
}

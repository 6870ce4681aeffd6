//! Refined training: centres, widths and the projection move down the gradient of the error, from a K-means
//! start.
//!
//! K-means puts centres where samples are; the best places are elsewhere. A device computes the same network,
//! with better numbers. Output weights are not moved but solved for at every step: see [`Examples`] for what
//! the error is measured on. `docs/training.md` has measurements.

use std::collections::BTreeSet;

use rayon::prelude::*;
use taxel_data::{BadValue, Dataset, Progress, require};

use super::layers::Layers;
use super::touch::{self, GroupFrames};
use super::{Options, memory};
use crate::error::Result;

mod products;
pub mod movable;
pub mod loss;
pub mod adam;
mod turn;
mod targets;
pub mod width;
mod sources;
mod descent;
mod folds;

use descent::Descent;
use movable::Piece;
use sources::Sources;

/// Source of frames that training has not seen.
pub trait FreshFrames: Sync {
    /// Frames of step number `step`: `count` of them, others at every step, the same in every run.
    fn frames(&self, step: usize, count: usize) -> Dataset;
}

/// What the error is measured on.
#[derive(Clone, Copy)]
pub enum Examples<'e> {
    /// Frames that are new at every step, where there is no end of them. Weights are solved on the same frames.
    Fresh(&'e dyn FreshFrames),
    /// The training frames themselves, in folds: each frame's fold is numbered from 0. One fold after the other is
    /// held out, and the weights are solved on the others. A first descent, which leaves out the last fold, tells
    /// after how many steps frames that were not looked at are decoded best, and the second one stops there. Both
    /// keep centres from fitting noise.
    Folds(&'e [usize]),
}

/// Least number of folds: one that tells when to stop, one that is held out, and the rest.
pub const LEAST_FOLDS: usize = 3;

/// Least number of fresh frames for each centre in a step: with fewer, weights fit the noise of their step's frames, and
/// centres follow.
const FRAMES_A_CENTRE: usize = 16;

/// Most measured frames that are looked at in each step.
const MOST_MEASURED: usize = 16_384;

/// Settings of refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Number of steps down the gradient.
    pub steps: usize,
    /// Least number of fresh frames that each step looks at. Networks of many centres take more: 16 for each centre.
    pub frames: usize,
    /// Rate of the descent at its start: about how far a number moves in a step. Inputs are scaled to [0, 1].
    pub rate: f64,
    /// Penalty on squared weights, for each frame, where [`Options::penalty`] gives none: also that of the weights
    /// fitted at the end.
    pub ridge: f64,
}

impl Default for Refinement {
    fn default() -> Self {
        Self { steps: 400, frames: 4096, rate: 0.02, ridge: 1e-7 }
    }
}

impl Refinement {
    /// Number of pieces in which the samples of a step are held, each with the square of all weights.
    pub(super) fn pieces(&self, frames: usize, centres: usize, examples: Examples<'_>) -> usize {
        match examples {
            Examples::Fresh(_) => self.fresh_frames(centres).div_ceil(products::SIDE),
            Examples::Folds(fold_of) => {
                let folds = fold_of.iter().max().map_or(0, |last| last + 1);
                frames.min(MOST_MEASURED).div_ceil(products::SIDE) + folds
            }
        }
    }

    /// Number of fresh frames that each step looks at.
    fn fresh_frames(&self, centres: usize) -> usize {
        self.frames.max(FRAMES_A_CENTRE * centres)
    }

    fn check(&self, examples: Examples<'_>, frames: usize) -> std::result::Result<(), BadValue> {
        require(self.steps > 0, "steps", self.steps, || "give at least 1".into())?;
        require(self.frames > 0, "frames", self.frames, || "give at least 1".into())?;
        require(self.rate > 0.0 && self.rate < 1.0, "rate", self.rate, || {
            "give a number between 0 and 1".into()
        })?;
        require(self.ridge > 0.0 && self.ridge < 1.0, "ridge", self.ridge, || {
            "give a number between 0 and 1".into()
        })?;
        let Examples::Folds(fold_of) = examples else { return Ok(()) };
        assert_eq!(fold_of.len(), frames, "a fold for every frame");
        let distinct = fold_of.iter().collect::<BTreeSet<_>>().len();
        require(distinct >= LEAST_FOLDS, "folds", distinct, || {
            format!(
                "refinement needs at least {LEAST_FOLDS}; give more, or train without refinement"
            )
        })
    }
}

/// Refines the `layers` that training on `frames` starts from, to those that it ends with. Folds and fresh frames are those of
/// the data set that these are of.
///
/// The refined layers are the same on any number of threads.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for settings that cannot be used, or more memory than is allowed;
/// [`Error`](crate::Error) for samples without a regression, or a projection beyond f32.
///
/// # Panics
/// If folds are not given for every frame, or fresh frames have other columns than the data set.
pub fn refine(
    frames: &GroupFrames,
    layers: &Layers,
    options: &Options,
    settings: &Refinement,
    examples: Examples<'_>,
    progress: &dyn Progress,
) -> Result<Layers> {
    let dataset = &frames.examples;
    let (fresh_of_group, folds_of_group): (touch::Fresh<'_>, Vec<usize>);
    let examples = match examples {
        Examples::Fresh(fresh) => {
            fresh_of_group = touch::Fresh { fresh, group: &frames.group };
            Examples::Fresh(&fresh_of_group)
        }
        Examples::Folds(fold_of) => {
            folds_of_group = frames.kept.iter().map(|frame| fold_of[*frame]).collect();
            Examples::Folds(&folds_of_group)
        }
    };
    settings.check(examples, dataset.frames())?;
    let pieces = settings.pieces(dataset.frames(), options.centres, examples);
    memory::check(&frames.all, options, Some(pieces))?;
    let sources = Sources::new(dataset, layers);
    let start = |layer| Descent::new(sources.start(layer), options, settings);
    let mut descents: Vec<Descent> = layers.hidden.iter().enumerate().map(start).collect();
    match examples {
        Examples::Fresh(fresh) => {
            progress.stage("refine", settings.steps);
            let count = settings.fresh_frames(options.centres);
            let samples = |step| -> Vec<Vec<Piece>> {
                let frames = fresh.frames(step, count);
                let networks = (0..layers.hidden.len()).into_par_iter();
                networks.map(|network| sources.pieces(&frames, network)).collect()
            };
            let mut now = samples(0);
            for step in 0..settings.steps {
                let descend = || {
                    let networks = descents.par_iter_mut().zip(&now);
                    networks.try_for_each(|(descent, pieces)| {
                        descent.step(&pieces.iter().collect::<Vec<_>>())
                    })
                };
                // One thread lays out the next samples, while others descend.
                let more = step + 1 < settings.steps;
                let (done, next) = rayon::join(descend, || more.then(|| samples(step + 1)));
                done?;
                now = next.unwrap_or_default();
                progress.step();
            }
        }
        Examples::Folds(fold_of) => {
            progress.stage("refine", fold_steps(settings.steps, descents.len()));
            let parts = parts(dataset, fold_of);
            let networks = descents.par_iter_mut().enumerate();
            networks.try_for_each(|(network, descent)| {
                let pieces = |part| sources.pieces(part, network);
                let folds: Vec<Vec<Piece>> = parts.iter().map(pieces).collect();
                *descent = folds::descend(descent, &folds, settings.steps, progress)?;
                Result::Ok(())
            })?;
        }
    }
    let found: Vec<_> = descents.iter().map(Descent::layer).collect();
    sources.layers(frames, &found, options.format)
}

/// Most steps of progress that refinement of so many `networks` takes on folds. Descents that end sooner take fewer.
pub fn fold_steps(steps: usize, networks: usize) -> usize {
    folds::PASSES * steps * networks
}

/// Frames of each fold, the largest fold last: that one tells when to stop. Of many frames an even selection is taken.
fn parts(dataset: &Dataset, fold_of: &[usize]) -> Vec<Dataset> {
    let count = fold_of.iter().max().map_or(0, |last| last + 1);
    let step = dataset.frames().div_ceil(MOST_MEASURED);
    let frames_of = |fold: usize| -> Vec<usize> {
        (0..dataset.frames()).filter(|frame| fold_of[*frame] == fold).step_by(step).collect()
    };
    let parts = (0..count).map(|fold| dataset.subset(&frames_of(fold)));
    let mut parts: Vec<Dataset> = parts.filter(|part| part.frames() > 0).collect();
    parts.sort_by_key(Dataset::frames);
    parts
}

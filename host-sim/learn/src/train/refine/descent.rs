//! A network on its way down the gradient.

use taxel_core::rbf::Format;

use super::Refinement;
use super::adam::Adam;
use super::loss::{self, Loss};
use super::movable::{Movable, Piece, Sizes};
use super::sources::Start;
use super::width;
use crate::error::Result;
use crate::train::{HiddenLayer, Options};

/// Factor on the ranges of features, which are seen on a few frames at a time and are wider on all.
const UNSEEN_RANGE: f64 = 1.1;

#[derive(Clone)]
pub(super) struct Descent {
    movable: Movable,
    /// Outputs of each task.
    tasks: Vec<Vec<usize>>,
    adam: Adam,
    format: Format,
    /// Ranges that inputs are scaled by, unless they are mixed: those change.
    ranges: Vec<[f64; 2]>,
    ridge: f64,
}

impl Descent {
    /// Descent of one network from its `start`.
    pub(super) fn new(start: Start, options: &Options, settings: &Refinement) -> Self {
        let Start { layer, mix, ranges, tasks } = start;
        let inputs = ranges.len();
        let sizes = Sizes {
            inputs,
            centres: layer.centres.len() / inputs,
            sources: mix.len() / inputs,
            affine_tail: options.affine_tail,
        };
        let movable = Movable::new(sizes, &layer.centres, layer.spread, &mix);
        let adam = Adam::new(settings.rate, settings.steps, movable.values.len());
        Self {
            movable,
            tasks,
            adam,
            format: options.format,
            ranges,
            ridge: options.penalty.unwrap_or(settings.ridge),
        }
    }

    /// One step on samples whose weights are solved on themselves.
    pub(super) fn step(&mut self, pieces: &[&Piece]) -> Result<()> {
        let loss = loss::on_same(&self.movable, &self.tasks, pieces, self.ridge)?;
        self.descend(loss, pieces);
        Ok(())
    }

    /// One step on the samples that are `held_out`, whose weights are solved on the `rest`.
    pub(super) fn step_held_out(&mut self, rest: &[&Piece], held_out: &[&Piece]) -> Result<()> {
        let loss = loss::on_held_out(&self.movable, &self.tasks, rest, held_out, self.ridge)?;
        self.descend(loss, rest);
        Ok(())
    }

    /// Squared errors of the samples of each task that are `held_out`, whose weights are solved on the `rest`.
    pub(super) fn errors(&self, rest: &[&Piece], held_out: &[&Piece]) -> Result<Vec<Vec<f64>>> {
        loss::held_out_errors(&self.movable, &self.tasks, rest, held_out, self.ridge)
    }

    /// Descends on a loss, if there is one.
    fn descend(&mut self, loss: Option<Loss>, pieces: &[&Piece]) {
        if let Some(loss) = loss {
            self.adam.descend(&mut self.movable.values, &loss.gradient);
            self.hold(pieces);
        }
    }

    /// Makes the width so large that the format holds it.
    pub(super) fn hold(&mut self, pieces: &[&Piece]) {
        if self.format == Format::Fixed16 {
            let least = width::least(self.movable.centres(), &self.ranges(pieces));
            self.movable.widen_to(least);
        }
    }

    /// Ranges by which the network's inputs are going to be scaled.
    fn ranges(&self, pieces: &[&Piece]) -> Vec<[f64; 2]> {
        if self.movable.sizes.sources == 0 {
            return self.ranges.clone();
        }
        let widened = |[low, high]: [f64; 2]| {
            let (middle, half) = (0.5 * (low + high), 0.5 * UNSEEN_RANGE * (high - low));
            [middle - half, middle + half]
        };
        self.movable.ranges(pieces).into_iter().map(widened).collect()
    }

    /// Where the descent has come to: the hidden layer among mixed inputs, and the mix.
    pub(super) fn layer(&self) -> (HiddenLayer, &[f64]) {
        let movable = &self.movable;
        let layer = HiddenLayer { centres: movable.centres().to_vec(), spread: movable.width() };
        (layer, movable.mix())
    }
}

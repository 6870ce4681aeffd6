//! What refinement moves: centres, width and the mix of a network, as one list of numbers; activations for
//! given samples, and the way back from a loss's derivative by regressors to that by these numbers.

use taxel_data::widest;

use super::products::{Line, SIDE, add_combinations, add_products};
use crate::train::least_squares::{exponentiate_non_positive, squared_distances};

/// Lines that samples are laid into at once.
const AT_ONCE: usize = 8;

/// Sizes of a network that is refined.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    /// Number of inputs that the network sees.
    pub inputs: usize,
    /// Number of centres.
    pub centres: usize,
    /// Number of numbers that the inputs are mixed of; 0 if the network sees samples as they are.
    pub sources: usize,
    /// Whether the inputs are regressors too.
    pub affine_tail: bool,
}

impl Sizes {
    /// Number of regressors: activations, inputs if there is a tail, and 1.
    pub(super) fn regressors(self) -> usize {
        self.centres + if self.affine_tail { self.inputs } else { 0 } + 1
    }
}

/// Centres (`centres × inputs`), the logarithm of their width, and the mix (`sources × inputs`) if there is one.
#[derive(Debug, Clone)]
pub struct Movable {
    pub(super) sizes: Sizes,
    /// All numbers, one after the other.
    pub values: Vec<f64>,
}

impl Movable {
    /// Start of a network with these `centres`, their `width`, and the mix (empty for none).
    pub fn new(sizes: Sizes, centres: &[f64], width: f64, mix: &[f64]) -> Self {
        Self { sizes, values: [centres, &[libm::log(width)], mix].concat() }
    }

    pub(super) fn centres(&self) -> &[f64] {
        &self.values[..self.sizes.centres * self.sizes.inputs]
    }

    /// Width of all centres.
    pub(super) fn width(&self) -> f64 {
        libm::exp(self.values[self.width_place()])
    }

    /// What each input adds to each mixed input; empty without a mix.
    pub(super) fn mix(&self) -> &[f64] {
        &self.values[self.width_place() + 1..]
    }

    /// Makes the width at least so large.
    pub(super) fn widen_to(&mut self, least: f64) {
        let place = self.width_place();
        if least > 0.0 {
            self.values[place] = self.values[place].max(libm::log(least));
        }
    }

    /// Ranges of the inputs that the network sees, over the samples of `pieces`.
    pub(super) fn ranges(&self, pieces: &[&Piece]) -> Vec<[f64; 2]> {
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.sizes.inputs];
        for piece in pieces {
            for ([low, high], line) in ranges.iter_mut().zip(&self.mixed(piece)) {
                for value in &line[..piece.samples] {
                    (*low, *high) = (low.min(*value), high.max(*value));
                }
            }
        }
        ranges
    }

    /// Inputs that the network sees of the samples in `piece`.
    fn mixed(&self, piece: &Piece) -> Vec<Line> {
        if self.sizes.sources == 0 {
            return piece.inputs.clone();
        }
        let mut mixed = vec![[0.0; SIDE]; self.sizes.inputs];
        add_combinations(self.mix(), &piece.inputs, &mut mixed);
        mixed
    }

    fn width_place(&self) -> usize {
        self.sizes.centres * self.sizes.inputs
    }

    /// Computes the regressors of the samples in `piece`.
    pub(super) fn activate(&self, piece: &Piece) -> Activated {
        let Sizes { inputs, centres, affine_tail, .. } = self.sizes;
        let mixed = self.mixed(piece);
        let decay = 0.5 / self.width().powi(2);
        let mut exponents = vec![[0.0; SIDE]; centres];
        for (exponents, centre) in exponents.iter_mut().zip(self.centres().chunks_exact(inputs)) {
            *exponents = exponents_of(&mixed, centre, decay);
        }
        let mut regressors = exponents.clone();
        for line in &mut regressors {
            widest!(exponentiate_non_positive(line));
        }
        if affine_tail {
            regressors.extend_from_slice(&mixed);
        }
        for line in &mut regressors {
            line.iter_mut().zip(&piece.weights).for_each(|(value, weight)| *value *= weight);
        }
        regressors.push(piece.weights);
        Activated { mixed, exponents, regressors }
    }

    /// Adds to `gradient` what the derivative of a loss by the regressors, `by_regressors`, makes of it.
    pub(super) fn add_gradient(
        &self,
        piece: &Piece,
        activated: &Activated,
        by_regressors: Vec<Line>,
        gradient: &mut [f64],
    ) {
        let Sizes { inputs, centres, sources, affine_tail, .. } = self.sizes;
        let per_variance = self.width().powi(-2);
        let width_place = self.width_place();
        let mut by_exponents = by_regressors;
        let by_tail = by_exponents.split_off(centres);
        let lines = by_exponents.iter_mut().zip(&activated.regressors).zip(&activated.exponents);
        for ((by_exponent, activation), exponent) in lines {
            let mut sums = [0.0; SIDE];
            widest!({
                for s in 0..SIDE {
                    by_exponent[s] *= activation[s];
                    sums[s] = -2.0 * exponent[s] * by_exponent[s];
                }
            });
            gradient[width_place] += sums.iter().sum::<f64>();
        }

        let with_one: Vec<Line> = activated.mixed.iter().copied().chain([[1.0; SIDE]]).collect();
        let mut sums = vec![0.0; centres * (inputs + 1)];
        add_products(&by_exponents, &with_one, &mut sums);
        let lines = self.centres().chunks_exact(inputs).zip(sums.chunks_exact(inputs + 1));
        for ((centre, sums), place) in lines.zip(gradient.chunks_exact_mut(inputs)) {
            for ((place, c), sum) in place.iter_mut().zip(centre).zip(sums) {
                *place += (sum - c * sums[inputs]) * per_variance;
            }
        }

        if sources > 0 {
            let mut by_mixed = vec![[0.0; SIDE]; inputs];
            add_combinations(self.centres(), &by_exponents, &mut by_mixed);
            let mut total = [[0.0; SIDE]];
            add_combinations(&vec![1.0; centres], &by_exponents, &mut total);
            for (j, (by_mixed, mixed)) in by_mixed.iter_mut().zip(&activated.mixed).enumerate() {
                for s in 0..SIDE {
                    let by_tail = if affine_tail { by_tail[j][s] * piece.weights[s] } else { 0.0 };
                    by_mixed[s] = by_tail + (by_mixed[s] - mixed[s] * total[0][s]) * per_variance;
                }
            }
            add_products(&piece.inputs, &by_mixed, &mut gradient[width_place + 1..]);
        }
    }
}

/// Exponents −decay·‖x − c‖² of one centre, for all samples.
fn exponents_of(inputs: &[Line], centre: &[f64], decay: f64) -> Line {
    widest!({
        let mut exponents = squared_distances(centre, inputs);
        exponents.iter_mut().for_each(|square| *square *= -decay);
        exponents
    })
}

/// Samples side by side; lines beyond the last sample are 0.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Scaled inputs, a line each.
    pub(super) inputs: Vec<Line>,
    /// What the outputs should be times the weight, a line each; NaN where one is missing.
    pub(super) targets: Vec<Line>,
    /// Factor on the error of each sample; 1 where all count alike.
    pub(super) weights: Line,
    /// Number of samples, at most [`SIDE`].
    pub(super) samples: usize,
}

impl Piece {
    /// Lays samples side by side: `inputs` (`samples × width`) with their `targets` (`samples × outputs`) and `weights`.
    pub fn all(
        (inputs, width): (&[f64], usize),
        (targets, outputs): (&[f64], usize),
        weights: &[f64],
    ) -> Vec<Self> {
        let pieces = inputs.chunks(SIDE * width).zip(targets.chunks(SIDE * outputs));
        let piece = |((inputs, targets), some): ((&[f64], &[f64]), &[f64])| {
            let mut weights = [0.0; SIDE];
            weights[..some.len()].copy_from_slice(some);
            let mut targets = side_by_side(targets, outputs);
            for line in &mut targets {
                line.iter_mut().zip(&weights).for_each(|(target, weight)| *target *= weight);
            }
            let (samples, inputs) = (some.len(), side_by_side(inputs, width));
            Self { inputs, targets, weights, samples }
        };
        pieces.zip(weights.chunks(SIDE)).map(piece).collect()
    }

    /// Number of samples that have output number `output`.
    pub(super) fn samples_with(&self, output: usize) -> usize {
        self.targets[output][..self.samples].iter().filter(|target| !target.is_nan()).count()
    }

    /// Tasks that have samples here, by the samples that they have: the targets of one output, and the tasks.
    pub(super) fn together(&self, tasks: &[Vec<usize>]) -> Vec<(&Line, Vec<usize>)> {
        let mut groups: Vec<(&Line, Vec<usize>)> = Vec::new();
        for (task, columns) in tasks.iter().enumerate() {
            let targets = &self.targets[columns[0]];
            let same =
                |other: &Line| other.iter().zip(targets).all(|(a, b)| a.is_nan() == b.is_nan());
            match groups.iter_mut().find(|(other, _)| same(other)) {
                Some((_, group)) => group.push(task),
                None if self.samples_with(columns[0]) > 0 => groups.push((targets, vec![task])),
                None => (),
            }
        }
        groups
    }

    /// `lines` of all outputs, with 0 where an output is missing.
    pub(super) fn known(&self, mut lines: Vec<Line>) -> Vec<Line> {
        for (value, target) in lines.iter_mut().flatten().zip(self.targets.iter().flatten()) {
            if target.is_nan() {
                *value = 0.0;
            }
        }
        lines
    }
}

fn side_by_side(values: &[f64], width: usize) -> Vec<Line> {
    let mut lines = vec![[0.0; SIDE]; width];
    // A few lines at once: what is read and written then stays in the cache.
    for (first, lines) in (0..width).step_by(AT_ONCE).zip(lines.chunks_mut(AT_ONCE)) {
        for (s, sample) in values.chunks_exact(width).enumerate() {
            lines.iter_mut().zip(&sample[first..]).for_each(|(line, value)| line[s] = *value);
        }
    }
    lines
}

/// Regressors of the samples in a piece, and what the way back needs.
#[derive(Debug, Clone)]
pub(super) struct Activated {
    mixed: Vec<Line>,
    exponents: Vec<Line>,
    pub(super) regressors: Vec<Line>,
}

//! Fitting of output weights to the activations that a device will compute, one file a number format.
//!
//! Centres, width and scaling are rounded to the format first, and the weights are fitted to the
//! resulting activations. That rounding then causes no error any more; only the weights are rounded
//! last.

use std::cell::OnceCell;

use taxel_core::rbf::{self, Format, Network, NetworkError, Shape};
use taxel_data::table::means;

use super::least_squares::{Decomposed, Factor};
use super::samples::{Ridge, Samples};
use super::tasks::{Factors, Task, Weighed, Write};
use super::{HiddenLayer, Options, Solver};
use crate::error::{Error, Result, parameter_not_held};

mod fixed16;
mod float32;

/// Most that a format may take from the R² of an output on the training frames, unless its squared error grows by no
/// more than [`MOST_GROWTH`].
pub const MOST_LOST: f64 = 0.01;
/// Factor on squared errors that rounding may cost where an output is hard to decode: its RMSE doubles.
pub const MOST_GROWTH: f64 = 4.0;
/// Standard deviations of an output that its mean is at least from 0, where [`MOST_LOST`] holds however hard it is to decode:
/// subtracting the mean helps.
const FAR: f64 = 1e3;

/// Trained network with its parameters as the blob will hold them, owned.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedNetwork {
    shape: Shape,
    format: Format,
    affine: bool,
    words: Vec<u32>,
}

impl FittedNetwork {
    /// Checks and holds the network in `words`.
    ///
    /// # Errors
    /// [`Error`] if a parameter does not fit the format.
    pub(crate) fn try_new(
        shape: Shape,
        format: Format,
        affine: bool,
        words: Vec<u32>,
    ) -> Result<Self> {
        let fitted = Self { shape, format, affine, words };
        match fitted.try_network() {
            Ok(_) => Ok(fitted),
            Err(cause) => Err(parameter_not_held(format, cause)),
        }
    }

    /// The network, if it decodes each output as well as the solution in f64 that it was rounded from, which has so much
    /// squared error `left` of each.
    ///
    /// # Errors
    /// [`Error`] if R² of an output is lower by more than [`MOST_LOST`], and its squared error larger by more
    /// than [`MOST_GROWTH`], or its mean beyond [`FAR`] deviations.
    pub(super) fn unless_lost(self, targets: &Targets<'_>, left: &[f64]) -> Result<Self> {
        let outputs = &targets.samples.table.outputs;
        let found = targets.samples.squared_errors(&self.network());
        let errors = found.into_iter().zip(left).zip(targets.squares()).zip(&targets.means);
        for (output, ((((found, left), total), mean), count)) in
            errors.zip(outputs.counts()).enumerate()
        {
            let lost = (found - left) / total;
            let rounding = count as f64 * (4.0 * f64::EPSILON * mean).powi(2);
            let is_far = count as f64 * mean * mean > FAR * FAR * total;
            if total > rounding && lost > MOST_LOST && (is_far || found > MOST_GROWTH * left) {
                let (format, output) = (self.format.name(), &outputs.names[output]);
                let other = match self.format {
                    Format::F32 => "",
                    Format::Fixed16 => "another format (f32) or ",
                };
                return Err(Error::unfit(format!(
                    "the format {format} loses the output {output:?}: R² on the training frames would be {lost:.3} lower \
                     than with the same centres in f64. Subtract {mean:?}, its mean, from the output; or choose {other}a \
                     smaller spread"
                )));
            }
        }
        Ok(self)
    }

    fn try_network(&self) -> std::result::Result<Network<'_>, NetworkError> {
        let Self { shape, format, affine, words, .. } = self;
        Ok(match format {
            Format::F32 => rbf::float32::Network::of_words(*shape, *affine, words)?.into(),
            Format::Fixed16 => rbf::fixed16::Network::try_new(*shape, *affine, words)?.into(),
        })
    }

    /// Number format of the network.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Network of these parameters, ready to infer.
    ///
    /// # Panics
    /// Never: the parameters were checked when they were fitted.
    pub fn network(&self) -> Network<'_> {
        self.try_network().expect("checked when fitted")
    }
}

/// Outputs of samples, whose deviations from their means weights are fitted to. Outputs that are told as multiples of a
/// touch's strength are divided by it.
///
/// The means go into the bias. An offset would otherwise be spread over large weights that cancel, and
/// cost digits.
pub(super) struct Targets<'s> {
    samples: &'s Samples<'s>,
    pub means: Vec<f64>,
}

impl<'s> Targets<'s> {
    pub fn new(samples: &'s Samples<'s>) -> Self {
        let lines = (0..samples.table.frames()).map(|line| samples.targets(line));
        Self { means: means(lines, samples.table.outputs.names.len()), samples }
    }

    pub fn outputs(&self) -> usize {
        self.means.len()
    }

    /// Sum of the squared deviations of each output from its mean, times the squares of the weights; NaN is skipped.
    fn squares(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.outputs()];
        for line in 0..self.samples.table.frames() {
            let weight = self.samples.weight(line);
            let targets = self.samples.targets(line).zip(&self.means);
            let deviations = targets.map(|(value, mean)| value - mean);
            let present = sums.iter_mut().zip(deviations).filter(|(_, d)| !d.is_nan());
            present
                .for_each(|(sum, deviation)| *sum += (deviation * weight) * (deviation * weight));
        }
        sums
    }
}

/// Weights of a fit, separated by the regressors that they multiply.
struct Weights {
    /// Weights of the activations, `centres × outputs`.
    centres: Vec<f64>,
    /// Weights of the affine tail, `inputs × outputs`, or none.
    affine: Vec<f64>,
    /// Biases, one an output, with the means added.
    bias: Vec<f64>,
}

impl Weights {
    /// Separates `regressors × outputs` weights: those of `centres`, of the inputs if there is a tail,
    /// and of 1.
    fn split(mut weights: Vec<f64>, centres: usize, targets: &Targets<'_>) -> Self {
        let outputs = targets.outputs();
        let mut bias = weights.split_off(weights.len() - outputs);
        bias.iter_mut().zip(&targets.means).for_each(|(bias, mean)| *bias += mean);
        let affine = weights.split_off(centres * outputs);
        Self { centres: weights, affine, bias }
    }
}

/// Gaussians of a network as a number format holds them: all that is rounded before weights are fitted.
trait Held: Send + Sync {
    /// Number of regressors, and regressors that a device computes for lines of readings.
    fn regressors(&self) -> (usize, Write<'_>);

    /// Network with the weights of `factors`, which were fitted to the deviations of `targets`.
    ///
    /// # Errors
    /// [`Error`] if the format does not hold the network.
    fn network(&self, factors: &Factors, targets: &Targets<'_>) -> Result<FittedNetwork>;
}

/// Samples of a table that weights are fitted to.
struct Fit<'s> {
    targets: &'s Targets<'s>,
    solver: Solver,
    held: &'s dyn Held,
    /// Number of frames that the penalties on each output's weights are counted over.
    frames: &'s [usize],
    tasks: Vec<Task>,
    /// Decompositions of the tasks, which all penalties share.
    decomposed: Vec<OnceCell<Decomposed>>,
}

impl<'s> Fit<'s> {
    fn new(
        held: &'s dyn Held,
        targets: &'s Targets<'s>,
        solver: Solver,
        frames: &'s [usize],
    ) -> Self {
        let table = targets.samples.table;
        let tasks = Task::all(&table.outputs, &(0..table.frames()).collect::<Vec<_>>());
        let decomposed = vec![OnceCell::new(); tasks.len()];
        Self { targets, solver, held, frames, tasks, decomposed }
    }

    /// Factors of all samples, with these penalties on squared weights.
    fn factors(&self, ridge: Ridge) -> Factors {
        let of_task = |(task, decomposed): (&Task, &OnceCell<Decomposed>)| {
            (task.columns.clone(), self.factor(task, decomposed, ridge))
        };
        Factors(self.tasks.iter().zip(&self.decomposed).map(of_task).collect())
    }

    fn factor(&self, task: &Task, decomposed: &OnceCell<Decomposed>, ridge: Ridge) -> Factor {
        let (frames, outputs) = (self.frames[task.columns[0]], task.columns.len());
        let (regressors, write) = self.held.regressors();
        let Targets { samples, means } = self.targets;
        let samples = Weighed { samples, means, task, regressors, write };
        match self.solver {
            Solver::Qr => decomposed
                .get_or_init(|| Decomposed::new(&samples, &samples, outputs))
                .factor_with(|it| ridge.root(frames, it, regressors)),
            Solver::Rls => {
                let covariance = ridge.initial_covariance(frames);
                Factor::by_recursion(&samples, &samples, outputs, covariance)
            }
        }
    }

    /// Network whose weights have these penalties.
    fn network(&self, ridge: Ridge) -> Result<FittedNetwork> {
        let factors = self.factors(ridge);
        let network = self.held.network(&factors, self.targets)?;
        network.unless_lost(self.targets, &self.left(&factors))
    }

    /// Squared error of each output that the solution of `factors` leaves: the squares of the targets without those along
    /// the regressors.
    fn left(&self, factors: &Factors) -> Vec<f64> {
        let mut left = self.targets.squares();
        let mut along = vec![0.0; left.len()];
        for line in factors.projection().chunks_exact(left.len()) {
            along.iter_mut().zip(line).for_each(|(sum, value)| *sum += value * value);
        }
        left.iter_mut().zip(along).for_each(|(left, along)| *left = (*left - along).max(0.0));
        left
    }
}

/// Fits `samples` with the Gaussians of `layer`: a network for each of `ridges`, or an error where the format does not hold
/// it. They share one decomposition, unless the solver is a recursion.
pub(super) fn fit(
    samples: &Samples<'_>,
    layer: &HiddenLayer,
    options: &Options,
    ridges: &[Ridge],
) -> Vec<Result<FittedNetwork>> {
    let (targets, frames) = (Targets::new(samples), samples.table.outputs.counts());
    let with = |held: &dyn Held| {
        let fit = Fit::new(held, &targets, options.solver, &frames);
        ridges.iter().map(|ridge| fit.network(*ridge)).collect()
    };
    match options.format {
        Format::F32 => with(&float32::Gaussians::new(samples, layer, options)),
        Format::Fixed16 => match fixed16::Exponents::new(samples, layer, options) {
            Ok(held) => with(&held),
            Err(cause) => ridges.iter().map(|_| Err(Error::unfit(cause.to_string()))).collect(),
        },
    }
}

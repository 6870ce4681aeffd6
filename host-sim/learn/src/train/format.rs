//! Fitting of output weights to the activations that a device will compute, one file a number format.
//!
//! Centres, width and scaling are rounded to the format first, and the weights are fitted to the
//! resulting activations. That rounding then causes no error any more; only the weights are rounded
//! last.

use std::cell::OnceCell;

use taxel_core::rbf::{self, Format, Network, NetworkError, Shape};

use taxel_data::{Dataset, Table};

use super::least_squares::{Decomposed, Design, Factor, Weighed, weighed};
use super::samples::{Ridge, Samples};
use super::tasks::{Factors, Task};
use super::{HiddenLayer, Options, Solver};
use crate::error::{Error, Result, parameter_not_held};
use crate::infer::infer;

mod fixed16;
mod float32;

/// Most that a format may take from the R² of an output on the training frames, unless its squared error grows by no
/// more than [`MOST_GROWTH`].
pub const MOST_LOST: f64 = 0.01;
/// Factor on squared errors that rounding may cost where an output is hard to decode: its RMSE doubles.
pub const MOST_GROWTH: f64 = 4.0;

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

    /// The network, if it decodes each output of `table` as well as the solution in f64 that it was rounded from, which
    /// has so much squared error `left` of each.
    ///
    /// # Errors
    /// [`Error`] if R² of an output is lower by more than [`MOST_LOST`], and its squared error larger by more
    /// than [`MOST_GROWTH`].
    pub(super) fn unless_lost(
        self,
        table: &Dataset,
        targets: &Targets,
        left: &[f64],
    ) -> Result<Self> {
        let outputs = &table.outputs;
        let weights = table.weights.as_deref();
        let predicted = infer(&self.network(), &table.inputs.values);
        let found = weighed_errors(table, &predicted);
        let totals =
            column_squares(&weighed(weights, &targets.deviations.values), targets.outputs());
        let errors = found.into_iter().zip(left).zip(totals).zip(&targets.means);
        for (output, ((((found, left), total), mean), count)) in
            errors.zip(outputs.counts()).enumerate()
        {
            let lost = (found - left) / total;
            let rounding = count as f64 * (4.0 * f64::EPSILON * mean).powi(2);
            if total > rounding && lost > MOST_LOST && found > MOST_GROWTH * left {
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

/// Deviations of the outputs from their means, to which weights are fitted.
///
/// The means go into the bias. An offset would otherwise be spread over large weights that cancel, and
/// cost digits.
pub(super) struct Targets {
    pub deviations: Table,
    pub means: Vec<f64>,
}

impl Targets {
    pub fn new(outputs: &Table) -> Self {
        let (mut deviations, means) = (outputs.clone(), outputs.means());
        for line in deviations.values.chunks_exact_mut(means.len()) {
            line.iter_mut().zip(&means).for_each(|(value, mean)| *value -= mean);
        }
        Self { deviations, means }
    }

    pub fn outputs(&self) -> usize {
        self.means.len()
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
    fn split(mut weights: Vec<f64>, centres: usize, targets: &Targets) -> Self {
        let outputs = targets.outputs();
        let mut bias = weights.split_off(weights.len() - outputs);
        bias.iter_mut().zip(&targets.means).for_each(|(bias, mean)| *bias += mean);
        let affine = weights.split_off(centres * outputs);
        Self { centres: weights, affine, bias }
    }
}

/// Gaussians of a network as a number format holds them: all that is rounded before weights are fitted.
trait Held: Send + Sync {
    /// Regressors that a device computes for the inputs of `table`, line after line.
    fn design<'t>(&'t self, table: &'t Dataset) -> Box<dyn Design + 't>;

    /// Network with the weights of `factors`, which were fitted to the deviations of `targets`.
    ///
    /// # Errors
    /// [`Error`] if the format does not hold the network.
    fn network(&self, factors: &Factors, targets: &Targets) -> Result<FittedNetwork>;
}

/// Samples of a table that weights are fitted to.
struct Fit<'s> {
    table: &'s Dataset,
    targets: &'s Targets,
    solver: Solver,
    held: &'s dyn Held,
    /// Number of frames that the penalties on each output's weights are counted over.
    frames: &'s [usize],
    tasks: Vec<Task<'s>>,
    /// Decompositions of the tasks, which all penalties share.
    decomposed: Vec<OnceCell<Decomposed>>,
}

impl<'s> Fit<'s> {
    fn new(
        held: &'s dyn Held,
        table: &'s Dataset,
        targets: &'s Targets,
        solver: Solver,
        frames: &'s [usize],
    ) -> Self {
        let tasks = Task::all(table, &targets.deviations);
        let decomposed = vec![OnceCell::new(); tasks.len()];
        Self { table, targets, solver, held, frames, tasks, decomposed }
    }

    /// Factors of all samples, with these penalties on squared weights.
    fn factors(&self, ridge: Ridge) -> Factors {
        let of_task = |(task, decomposed): (&Task<'_>, &OnceCell<Decomposed>)| {
            (task.columns.clone(), self.factor(task, decomposed, ridge))
        };
        Factors(self.tasks.iter().zip(&self.decomposed).map(of_task).collect())
    }

    fn factor(&self, task: &Task<'_>, decomposed: &OnceCell<Decomposed>, ridge: Ridge) -> Factor {
        let frames = self.frames[task.columns[0]];
        let weights = task.table.weights.as_deref();
        let (targets, outputs) = (&*weighed(weights, &task.targets), task.columns.len());
        let design = self.held.design(&task.table);
        let design: &dyn Design = match weights {
            Some(weights) => &Weighed { design: &*design, weights },
            None => &*design,
        };
        match self.solver {
            Solver::Qr => decomposed
                .get_or_init(|| Decomposed::new(design, targets, outputs))
                .factor_with(|it| ridge.root(frames, it, design.regressors())),
            Solver::Rls => {
                Factor::by_recursion(design, targets, outputs, ridge.initial_covariance(frames))
            }
        }
    }

    /// Network whose weights have these penalties.
    fn network(&self, ridge: Ridge) -> Result<FittedNetwork> {
        let factors = self.factors(ridge);
        let network = self.held.network(&factors, self.targets)?;
        network.unless_lost(self.table, self.targets, &self.left(&factors))
    }

    /// Squared error of each output that the solution of `factors` leaves.
    fn left(&self, factors: &Factors) -> Vec<f64> {
        // The squares of the targets without those along the regressors.
        let squares = |values: &[f64]| column_squares(values, self.targets.outputs());
        let weights = self.table.weights.as_deref();
        let all = squares(&weighed(weights, &self.targets.deviations.values)).into_iter();
        all.zip(squares(&factors.projection())).map(|(all, along)| (all - along).max(0.0)).collect()
    }
}

/// Sum of the squared errors of each output of `table`, times the squares of its frames' weights, for `predicted` ones.
pub(super) fn weighed_errors(table: &Dataset, predicted: &[f64]) -> Vec<f64> {
    let (weights, outputs) = (table.weights.as_deref(), &table.outputs);
    let values = weighed(weights, &outputs.values).into_owned();
    let truth = Table { names: outputs.names.clone(), values };
    truth.squared_errors(&weighed(weights, predicted))
}

/// Sum of the squares of each of so many columns; NaN is skipped.
fn column_squares(values: &[f64], columns: usize) -> Vec<f64> {
    let of = |column| values.iter().skip(column).step_by(columns).filter(|v| !v.is_nan());
    (0..columns).map(|column| of(column).map(|v| v * v).sum()).collect()
}

/// Fits `samples` with the Gaussians of `layer`: one network for each of `ridges`. They share one
/// decomposition, unless the solver is a recursion.
///
/// # Errors
/// [`Error`](crate::Error) if the format does not hold a network.
pub(super) fn fit(
    samples: &Samples<'_>,
    layer: &HiddenLayer,
    options: &Options,
    ridges: &[Ridge],
) -> Result<Vec<FittedNetwork>> {
    let targets = Targets::new(&samples.table.outputs);
    let (table, solver) = (samples.table, options.solver);
    let frames = table.outputs.counts();
    let held: &dyn Held = match options.format {
        Format::F32 => &float32::Gaussians::new(samples, layer, options),
        Format::Fixed16 => &fixed16::Exponents::new(samples, layer, options)?,
    };
    let fit = Fit::new(held, table, &targets, solver, &frames);
    ridges.iter().map(|ridge| fit.network(*ridge)).collect()
}

//! Recalibration: a model's inputs, fitted to a sensor that has changed, from reference presses.
//!
//! Readings drift: channel by channel, by gain and by offset. Within the small range of readings that a press spans,
//! either is a shift of the channel. So a shift s of every network's inputs is what recalibration finds: of the readings
//! of a row, or of the features behind a projection. Weights and centres stay as they were trained.
//!
//! Inputs x are in spans of the training range, and errors in training errors of each output. The network f is taken as
//! a smooth function in f64 without its clamp: a tenth more gain moves an input by a whole training range, where clamped
//! inputs have no slope. For each press p, inputs xₚ and true outputs yₚ are known.
//!
//! 1. **Guess.** Centres are inputs whose outputs the network tells. A linear regression of the centres on their
//!    outputs, with a `RIDGE`, says which inputs g(yₚ) the stated outputs should have had. The guess s₀ is the median
//!    of xₚ − g(yₚ) over all presses.
//! 2. **Fit.** The shift minimises Σₚ (m/3)·ln(1 + 3eₚ²) + `PRIOR`²·‖s − s₀‖², with eₚ² the mean squared error of
//!    f(xₚ − s) in its m outputs. The logarithm belongs to errors with Cauchy's distribution: a press that is far from
//!    explained, or whose outputs were misstated, says little. Gauss–Newton steps find the minimum; each weighs the
//!    presses by 1/(1 + 3eₚ²), solves by orthogonal rotations ([`rls`]), and is halved until the sum falls.
//! 3. **Judge.** Guess and fit are repeated without a fifth of the presses, five times, and tell the error on presses
//!    that they have not seen. Errors before and after are judged as a device decodes, with the clamp. A network whose
//!    Σ ln(1 + 3eₚ²) falls by less than a tenth keeps its inputs.
//!
//! docs/drift.md has what it reaches.

use rayon::prelude::*;
use taxel_core::blob::Model;
use taxel_core::rbf::Network;
use taxel_data::Table;

use crate::error::{Error, Result};
use crate::packing::{ModelBlob, rebuild};
use crate::prepared::PreparedModel;
use crate::rls;
use crate::train::FittedNetwork;

mod smooth;

use smooth::Smooth;

/// Root of the ridge penalty of the regression that guesses, for outputs in training errors.
const RIDGE: f64 = 3.0;
/// 1/σ: shifts are expected to be a quarter of a training range from the guess.
const PRIOR: f64 = 4.0;
/// Weight of a squared error in the weight of its press.
const DOUBT: f64 = 3.0;
/// Most Gauss–Newton steps of a fit, and most times that one is halved.
const MOST_STEPS: usize = 50;
const MOST_HALVINGS: usize = 20;
/// Longest step, in training ranges, that ends a fit.
const SMALLEST_STEP: f64 = 1e-4;
/// Number of parts of the presses, of which each in turn is kept from a fit that is judged by it.
const PARTS: usize = 5;
/// Largest cost of a network that is better than before, relative to that before.
const WORTH: f64 = 0.9;
/// Farthest that a usable input may be from the zero of its training range, in training ranges.
const FARTHEST: f64 = 8.0;
/// Largest usable error of an output, in training errors.
const MOST_ERRORS: f64 = 1e4;
/// Least training error that counts, relative to the full scale of the output.
const LEAST_ERROR: f64 = 1e-3;
/// Least mean variance of the stated outputs, in squared training errors, with which presses count as different.
const LEAST_VARIETY: f64 = 0.05;

/// A model that was recalibrated, and what its presses say of it.
#[derive(Debug)]
pub struct Recalibrated {
    /// The model in its own number format.
    pub blob: ModelBlob,
    /// Number of presses that at least one network could use.
    pub presses: usize,
    /// Number of networks: rows, or 1 behind a projection.
    pub networks: usize,
    /// Root mean square error of the model before, in training errors of each output.
    pub error_before: f64,
    /// The same of the recalibrated model, on presses that its fit has not seen.
    pub error_after: f64,
}

/// Checks that a `model` can be recalibrated.
///
/// # Errors
/// [`Error::Unfit`] with what stands against it.
pub fn check(model: &Model<'_>) -> Result<()> {
    let network = |row| model.network_of_row(row);
    let shares = |row: usize| (0..row).any(|before| network(before) == network(row));
    let errors = training_errors(model);
    let networks = if model.whole_frames() { 1 } else { model.shape().rows };
    let of_network = errors.len() / networks;
    let fronts: Vec<_> = model.fronts().collect();
    let faults = [
        (
            fronts.len() > 1 || fronts.iter().any(|front| front.touch.is_some()),
            "its features are normalised: train one with readings as they are (--features-kind plain)",
        ),
        (
            !model.whole_frames() && (0..model.shape().rows).any(shares),
            "rows share a network, while their channels drift apart: train one with a network for each row",
        ),
        (
            model.confidence().is_some(),
            "its confidence is of the sensor as it was: train one without --confidence",
        ),
        (
            model.fill().is_some(),
            "its fill of missing readings is of the sensor as it was: train one without --fill",
        ),
        (
            errors.chunks_exact(of_network).any(|errors| errors.iter().all(|error| *error <= 0.0)),
            "it tells no training errors of a network: `train` writes them",
        ),
    ];
    match faults.into_iter().find(|(is_there, _)| *is_there) {
        Some((_, fault)) => Err(Error::unfit(format!("the model cannot be recalibrated: {fault}"))),
        None => Ok(()),
    }
}

/// Recalibrates a `model`, with its baseline if it needs one, by presses: their `readings`, NaN where missing, and what
/// the `outputs` truly were, each a line a press in the model's columns.
///
/// # Errors
/// [`Error::Unfit`] for a model that presses cannot recalibrate; [`Error::Failed`] if a network has seen too few presses, or
/// presses that are too alike, and if no network would be better.
///
/// # Panics
/// If the tables have other numbers of columns than the model, or of lines than each other.
pub fn recalibrate(
    model: &PreparedModel<'_>,
    readings: &Table,
    outputs: &Table,
) -> Result<Recalibrated> {
    check(model.model())?;
    let width = model.model().metadata().output_names.iter().count();
    assert_eq!(outputs.names.len(), width, "the model's outputs");
    assert_eq!(readings.len(), outputs.len(), "outputs for each press");
    let inputs = model.inputs_of_networks(&readings.values).concat();
    let networks = model.networks();
    let units: Vec<Unit> = (0..networks.len())
        .into_par_iter()
        .map(|index| Unit::new(index, model, &inputs, outputs))
        .collect();
    if let Some(network) = units.iter().position(|unit| !unit.is_excited()) {
        let row = (networks.len() > 1).then_some(network + 1);
        let row = row.map_or(String::new(), |row| format!("row {row} has seen "));
        return Err(Error::failed(format!(
            "{row}too few presses, or presses that are too alike; press other places"
        )));
    }
    let fits: Vec<Fit> = units.par_iter().map(Unit::recalibrate).collect();
    if !fits.iter().any(|fit| fit.is_better) {
        let reason =
            "no better model came of the presses; the model is as good, or the presses are wrong";
        return Err(Error::failed(reason));
    }
    let shifted: Result<Vec<(usize, FittedNetwork)>> = units
        .iter()
        .zip(&fits)
        .zip(networks)
        .enumerate()
        .map(|(row, ((unit, fit), network))| {
            let index = model.model().network_of_row(row).expect("a row of the model");
            let none = vec![0.0; fit.shift.len()];
            let shift = if fit.is_better { &fit.shift } else { &none };
            Ok((index, unit.shifted(network, shift)?))
        })
        .collect();
    let mut shifted = shifted?;
    shifted.sort_by_key(|(index, _)| *index);
    let views: Vec<Network<'_>> = shifted.iter().map(|(_, network)| network.network()).collect();
    let used = |press: &usize| units.iter().any(|unit| unit.numbers.contains(press));
    let root_mean =
        |error: fn(&Fit) -> f64| (fits.iter().map(error).sum::<f64>() / fits.len() as f64).sqrt();
    Ok(Recalibrated {
        blob: rebuild(model.model(), &views, None, None)?,
        presses: (0..outputs.len()).filter(used).count(),
        networks: networks.len(),
        error_before: root_mean(|fit| fit.square_before),
        error_after: root_mean(|fit| {
            // A network that gets no better keeps its inputs.
            if fit.is_better { fit.square_after } else { fit.square_before }
        }),
    })
}

/// Training error of each output of a `model`, in its unit; 0 if it never changed.
fn training_errors(model: &Model<'_>) -> Vec<f64> {
    let (shape, metadata) = (model.shape(), model.metadata());
    let [rmse, full_scale] = [metadata.training_rmse, metadata.full_scale]
        .map(|values| values.iter().map(f64::from).chain(std::iter::repeat(0.0)));
    let errors = rmse.zip(full_scale).map(|(rmse, full)| rmse.max(LEAST_ERROR * full));
    errors.take(shape.rows * shape.outputs).collect()
}

/// One network, and the presses that it can use. Outputs that never changed in training are left out of them.
struct Unit {
    network: Smooth,
    /// Training error of each output that counts, with the output's number.
    errors: Vec<(usize, f64)>,
    /// Number of each press.
    numbers: Vec<usize>,
    /// Inputs of each press, in spans.
    inputs: Vec<Vec<f64>>,
    /// True outputs of each press, in training errors.
    stated: Vec<Vec<f64>>,
}

/// What the presses say of one network.
struct Fit {
    shift: Vec<f64>,
    square_before: f64,
    square_after: f64,
    is_better: bool,
}

impl Unit {
    fn new(index: usize, model: &PreparedModel<'_>, inputs: &[f64], outputs: &Table) -> Self {
        let networks = model.networks();
        let network = Smooth::new(&networks[index]);
        let (width, count) = (network.shape.inputs, network.shape.outputs);
        let own = |values: &[f64], press: usize, width: usize| {
            let first = (press * networks.len() + index) * width;
            values[first..first + width].to_vec()
        };
        let errors = own(&training_errors(model.model()), 0, count).into_iter().enumerate();
        let errors = errors.filter(|(_, error)| *error > 0.0).collect();
        let mut unit = Self { network, errors, numbers: vec![], inputs: vec![], stated: vec![] };
        for press in 0..outputs.len() {
            let x = own(inputs, press, width);
            let scale = unit.network.zeros.iter().zip(&unit.network.per_unit);
            let x: Vec<f64> =
                x.iter().zip(scale).map(|(x, (zero, per_unit))| (x - zero) * per_unit).collect();
            let stated = unit.in_errors(&own(&outputs.values, press, count));
            let decoded = unit.in_errors(&unit.network.decode(&x));
            let near = |e: &f64| e.abs() <= MOST_ERRORS;
            let usable = x.iter().all(|x| x.abs() <= FARTHEST)
                && stated.iter().zip(&decoded).all(|(y, decoded)| near(&(decoded - y)));
            if usable {
                unit.numbers.push(press);
                unit.inputs.push(x);
                unit.stated.push(stated);
            }
        }
        unit
    }

    /// The `outputs` that count, in training errors.
    fn in_errors(&self, outputs: &[f64]) -> Vec<f64> {
        self.errors.iter().map(|(output, error)| outputs[*output] / error).collect()
    }

    /// Whether there are as many presses as unknowns, and different ones.
    fn is_excited(&self) -> bool {
        let count = self.stated.len();
        let means = mean_line(&self.stated);
        let squares = self.stated.iter().map(|line| mean_square(line, &means));
        count >= self.network.shape.inputs && squares.sum::<f64>() / count as f64 >= LEAST_VARIETY
    }

    fn recalibrate(&self) -> Fit {
        let all: Vec<usize> = (0..self.inputs.len()).collect();
        let shift = self.fit(&all);
        let none = vec![0.0; shift.len()];
        let before: Vec<f64> = all.iter().map(|press| self.square_decoded(&none, *press)).collect();
        let after = self.squares_after();
        let cost = |squares: &[f64]| squares.iter().map(|square| doubted(*square)).sum::<f64>();
        let mean = |squares: &[f64]| squares.iter().sum::<f64>() / squares.len() as f64;
        Fit {
            shift,
            square_before: mean(&before),
            square_after: mean(&after),
            is_better: cost(&after) < WORTH * cost(&before),
        }
    }

    /// Mean squared error of each press as a device decodes it, by the network that was fitted without this press and
    /// the others of its part.
    fn squares_after(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.inputs.len()];
        for part in 0..PARTS {
            let (judged, fitted): (Vec<_>, Vec<_>) =
                (0..squares.len()).partition(|press| press % PARTS == part);
            let shift = self.fit(&fitted);
            for press in judged {
                squares[press] = self.square_decoded(&shift, press);
            }
        }
        squares
    }

    /// Guesses the shift: the median difference of the inputs of these `presses` to those that the stated outputs should
    /// have had.
    fn guess(&self, presses: &[usize]) -> Vec<f64> {
        let (inputs, regressors) = (self.network.shape.inputs, self.errors.len());
        let centres: Vec<&[f64]> = self.network.centres.chunks_exact(inputs).collect();
        let outputs: Vec<Vec<f64>> =
            centres.iter().map(|x| self.in_errors(&self.network.infer(x, &mut []))).collect();
        let [centre, output] = [mean_line(&centres), mean_line(&outputs)];
        let mut triangle = vec![0.0; regressors * regressors];
        let mut projection = vec![0.0; regressors * inputs];
        rls::start(&mut triangle, regressors, RIDGE);
        for (x, y) in centres.iter().zip(&outputs) {
            let [mut y, mut x] = [difference(y, &output), difference(x, &centre)];
            rls::rotate(&mut triangle, &mut projection, &mut y, &mut x);
        }
        let mut parts = vec![0.0; regressors * inputs];
        rls::solve(&triangle, &projection, regressors, &mut parts);
        let mut differences: Vec<Vec<f64>> = vec![vec![]; inputs];
        for press in presses {
            let (x, stated) = (&self.inputs[*press], &self.stated[*press]);
            let mut left = difference(x, &centre);
            for (y, parts) in difference(stated, &output).iter().zip(parts.chunks_exact(inputs)) {
                left.iter_mut().zip(parts).for_each(|(left, part)| *left -= y * part);
            }
            differences.iter_mut().zip(left).for_each(|(all, left)| all.push(left));
        }
        let median = |mut values: Vec<f64>| {
            let middle = values.len() / 2;
            *values.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        differences.into_iter().map(median).collect()
    }

    /// The shift that explains these `presses` best, near the guess that they give.
    fn fit(&self, presses: &[usize]) -> Vec<f64> {
        let guess = &self.guess(presses)[..];
        let inputs = guess.len();
        let cost = |shift: &[f64]| {
            let errors = presses.iter().map(|press| doubted(self.square(shift, *press)));
            let from_guess: f64 = difference(shift, guess).iter().map(|d| d * d).sum();
            self.errors.len() as f64 / DOUBT * errors.sum::<f64>() + PRIOR.powi(2) * from_guess
        };
        let mut shift = guess.to_vec();
        let mut lowest = cost(&shift);
        let mut triangle = vec![0.0; inputs * inputs];
        let mut step = vec![0.0; inputs];
        for _ in 0..MOST_STEPS {
            rls::start(&mut triangle, inputs, PRIOR);
            let mut target = difference(guess, &shift);
            target.iter_mut().for_each(|target| *target *= PRIOR);
            for press in presses {
                self.rotate(&shift, *press, &mut triangle, &mut target);
            }
            rls::solve(&triangle, &target, inputs, &mut step);
            let mut is_lower = false;
            for _ in 0..MOST_HALVINGS {
                let next: Vec<f64> = shift.iter().zip(&step).map(|(s, step)| s + step).collect();
                let found = cost(&next);
                if found < lowest {
                    (shift, lowest, is_lower) = (next, found, true);
                    break;
                }
                step.iter_mut().for_each(|step| *step /= 2.0);
            }
            let longest = step.iter().fold(0.0_f64, |longest, step| longest.max(step.abs()));
            if !is_lower || longest < SMALLEST_STEP {
                break;
            }
        }
        shift
    }

    /// Rotates what a press says of a step from `shift` into the `triangle` and its `target`.
    fn rotate(&self, shift: &[f64], press: usize, triangle: &mut [f64], target: &mut [f64]) {
        let inputs = shift.len();
        let mut slopes = vec![0.0; inputs * self.network.shape.outputs];
        let values = self.network.infer(&difference(&self.inputs[press], shift), &mut slopes);
        let (values, stated) = (self.in_errors(&values), &self.stated[press]);
        let root_weight = (1.0 + DOUBT * mean_square(&values, stated)).sqrt().recip();
        for (((output, error), value), stated) in self.errors.iter().zip(values).zip(stated) {
            // A shift lowers the input.
            let slopes = &mut slopes[output * inputs..][..inputs];
            slopes.iter_mut().for_each(|slope| *slope *= root_weight / error);
            rls::rotate(triangle, target, slopes, &mut [(value - stated) * root_weight]);
        }
    }

    /// Mean squared error of a press with its inputs shifted, as a device decodes it.
    fn square_decoded(&self, shift: &[f64], press: usize) -> f64 {
        let values = self.network.decode(&difference(&self.inputs[press], shift));
        mean_square(&self.in_errors(&values), &self.stated[press])
    }

    /// Mean squared error of a press with its inputs shifted, by the smooth network.
    fn square(&self, shift: &[f64], press: usize) -> f64 {
        let values = self.network.infer(&difference(&self.inputs[press], shift), &mut []);
        mean_square(&self.in_errors(&values), &self.stated[press])
    }

    /// The `network` in its own number format, with its inputs shifted. Every format's words begin with the zeros.
    fn shifted(&self, network: &Network<'_>, shift: &[f64]) -> Result<FittedNetwork> {
        let mut words: Vec<u32> = match network {
            Network::F32(network) => network.parameters().words().collect(),
            Network::Fixed16(network) => network.block().to_vec(),
        };
        let scale = self.network.zeros.iter().zip(&self.network.per_unit);
        for ((word, (zero, per_unit)), shift) in words.iter_mut().zip(scale).zip(shift) {
            // An input that never changed in training stays.
            if *per_unit > 0.0 {
                *word = ((zero + shift / per_unit) as f32).to_bits();
            }
        }
        let (shape, affine) = (network.shape(), network.has_affine_tail());
        FittedNetwork::try_new(shape, network.format(), affine, words)
    }
}

/// Cost of a press with this mean squared error: little more for a large one.
fn doubted(square: f64) -> f64 {
    (DOUBT * square).ln_1p()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn mean_square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64
}

fn mean_line<L: AsRef<[f64]>>(lines: &[L]) -> Vec<f64> {
    let width = lines.first().map_or(0, |line| line.as_ref().len());
    let mean = |i: usize| lines.iter().map(|line| line.as_ref()[i]).sum::<f64>();
    (0..width).map(|i| mean(i) / lines.len() as f64).collect()
}

#[cfg(test)]
mod tests;

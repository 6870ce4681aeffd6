//! Recalibration: what a model's features take of readings, fitted to a sensor that has changed, from reference presses.
//!
//! Readings drift: channel by channel, by gain and by offset. Within the small range of readings that a press spans,
//! either is a shift of the channel. So recalibration finds one shift for each number that is taken: of the readings of a
//! row, of the features behind a projection, or of the levels at rest that a touch's shape and strength are told by.
//! Everything else stays as it was trained, and decoding costs the same.
//!
//! Shifts are in spans: the training range of a network's input, or the range of a reading in the presses; where it has a
//! threshold, and some presses are untouched, four standard errors of their mean. Errors are in training errors of each
//! output.
//!
//! 1. **Guess.** The level at rest is the mean of the presses whose outputs are 0, or else a quantile that hardly any touch
//!    reaches. Inputs of a network are shifted so that their range meets that of training at one end, at the other or
//!    between: each by the one of five shifts with which the presses' errors are least, one after the other, twice.
//! 2. **Fit.** The shift s minimises Σₚ (m/3)·ln(1 + 3eₚ²) + `PRIOR`²·‖s − s₀‖², with s₀ the guess and eₚ² the mean squared
//!    error of press p in its m outputs. The logarithm belongs to errors with Cauchy's distribution: a press that is far
//!    from explained, or whose outputs were misstated, says little. Gauss–Newton steps find the minimum, with slopes by
//!    differences of what a device decodes; each is halved until the sum falls.
//! 3. **Judge.** Guess and fit are repeated without a fifth of the presses, five times, and tell the error on presses
//!    that they have not seen. A network whose Σ ln(1 + 3eₚ²) falls by less than a tenth keeps what it takes.
//!
//! A reading model moves along (`statistics.rs`). docs/drift.md has what it reaches.

use taxel_core::blob::{Front, Model};
use taxel_core::rbf::Network;
use taxel_core::reading_model::ReadingModel;
use taxel_core::touch::{Touch, block_floats};
use taxel_data::{Table, columns};

use crate::error::{Error, Result, no_regression};
use crate::infer::{decode, is_missing};
use crate::packing::{ModelBlob, rebuild};
use crate::parallel;
use crate::prepared::PreparedModel;
use crate::rls::Rls;
use crate::train::{FittedNetwork, THRESHOLD};

mod statistics;

/// 1/σ: shifts are expected to be a quarter of a span from the guess.
const PRIOR: f64 = 4.0;
/// Weight of a squared error in the weight of its press.
const DOUBT: f64 = 3.0;
/// Error of a stated output that a device does not tell, as it tells no place of a weak touch.
const UNTOLD: f64 = 2.0;
/// Share of the presses beyond half of them that leave a reading as untouched as rest does, to either side.
const REST_SHARE: f64 = 0.3;
/// Step in spans by which slopes are told.
const STEP: f64 = 0.02;
/// Most Gauss–Newton steps of a fit, and most times that one is halved.
const MOST_STEPS: usize = 30;
const MOST_HALVINGS: i32 = 6;
/// Share of the sum by which a step must lower it to be followed by another.
const LEAST_GAIN: f64 = 1e-4;
/// Number of parts of the presses, of which each in turn is kept from a fit that is judged by it.
const PARTS: usize = 5;
/// Largest cost of a network that is better than before, relative to that before.
const WORTH: f64 = 0.9;
/// Least training error that counts, relative to the full scale of the output.
const LEAST_ERROR: f64 = 1e-3;
/// Fewest presses that a network is recalibrated by, and least mean variance of their outputs in squared training errors.
const FEWEST: usize = 10;
const LEAST_VARIETY: f64 = 0.05;

/// A model that was recalibrated, and what its presses say of it.
#[derive(Debug)]
pub struct Recalibrated {
    /// The model in its own number format.
    pub blob: ModelBlob,
    /// Number of presses that every network could use.
    pub presses: usize,
    /// Root mean square error of the model before, in training errors of each output.
    pub error_before: f64,
    /// Root mean square error of the recalibrated model, on presses that its fit has not seen.
    pub error_after: f64,
}

/// Checks that a `model` can be recalibrated.
///
/// # Errors
/// [`Error::Unfit`] with what stands against it.
pub fn check(model: &Model<'_>) -> Result<()> {
    let rows = model.shape().rows;
    let fault = if !model.whole_frames() && model.network_count() < rows {
        "rows share a network, but their channels drift differently: train a model with a network for each row"
    } else if training_errors(model).iter().all(|error| *error <= 0.0) {
        "it has no training errors: `train` writes them"
    } else {
        return Ok(());
    };
    Err(Error::unfit(format!("the model cannot be recalibrated: {fault}")))
}

/// Recalibrates a `model`, with its baseline if it needs one, by presses: their `readings`, NaN where missing, and what
/// the `outputs` truly were, each a line a press in the model's columns. Where nothing touches, outputs are 0, and places
/// may be NaN.
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
    assert_eq!(outputs.names.len(), training_errors(model.model()).len(), "the model's outputs");
    assert_eq!(readings.len(), outputs.len(), "outputs for each press");
    let units = Unit::all(model, readings, outputs);
    if let Some(network) = units.iter().position(|unit| !unit.is_excited()) {
        return Err(Error::failed(format!(
            "network {} of {} has fewer than {FEWEST} presses, or presses that are too similar; press other places",
            network + 1,
            units.len()
        )));
    }
    let fits = parallel::map(units.len(), &|unit| units[unit].recalibrate());
    if fits.iter().all(|(shift, _)| shift.is_none()) {
        let reason =
            "the presses give no better model; the model is as good, or the presses are wrong";
        return Err(Error::failed(reason));
    }
    let shifted = units.iter().zip(&fits).map(|(unit, (shift, _))| unit.shifted(shift.as_deref()));
    let (networks, blocks): (Vec<FittedNetwork>, Vec<Vec<f32>>) =
        shifted.collect::<Result<Vec<_>>>()?.into_iter().unzip();
    let networks: Vec<Network<'_>> = networks.iter().map(FittedNetwork::network).collect();
    let mut fronts: Vec<Front<'_>> = model.model().fronts().collect();
    for (front, block) in fronts.iter_mut().zip(&blocks) {
        let shifted = |touch: Touch<'_>| Touch::new(touch.kind(), block);
        front.touch = front.touch.map(|touch| shifted(touch).expect("levels that are finite"));
    }
    let [error_before, error_after] = [0, 1].map(|which| {
        mean(&fits.iter().map(|(_, squares)| squares[which]).collect::<Vec<_>>()).sqrt()
    });
    let own = model.model().reading_model();
    let block = match own {
        Some(own) => {
            let inputs = model.model_inputs(&readings.values);
            let shifts: Vec<_> = fits.into_iter().map(|(shift, _)| shift).collect();
            statistics::moved(model.model(), own, &inputs, &shifts, error_after)?
        }
        None => vec![],
    };
    let reading_model = own.map(|own| ReadingModel::new(own.sizes(), &block)).transpose();
    let reading_model = reading_model.map_err(|_| no_regression())?;
    Ok(Recalibrated {
        blob: rebuild(model.model(), &fronts, &networks, reading_model, model.model().tracker())?,
        presses: units.iter().map(|unit| unit.presses.len()).min().unwrap_or(0),
        error_before,
        error_after,
    })
}

/// Training error of each output of a `model`, in its unit; 0 if it never changed.
pub fn training_errors(model: &Model<'_>) -> Vec<f64> {
    let (shape, metadata) = (model.shape(), model.metadata());
    let [rmse, full_scale] = [metadata.training_rmse, metadata.full_scale]
        .map(|values| values.iter().map(f64::from).chain(std::iter::repeat(0.0)));
    let errors = rmse.zip(full_scale).map(|(rmse, full)| rmse.max(LEAST_ERROR * full));
    errors.take(shape.rows * shape.outputs).collect()
}

/// One network, and the presses that it can use.
#[derive(Clone)]
struct Unit<'m> {
    network: Network<'m>,
    /// What stands before the network, if it tells the shape of a touch: the levels at rest are shifted then, and else the
    /// network's inputs.
    front: Option<Front<'m>>,
    /// Training error of each output; 0 for one that does not count.
    errors: Vec<f64>,
    presses: Vec<Press>,
}

#[derive(Clone)]
struct Press {
    /// What is shifted: readings, or inputs of the network.
    taken: Vec<f64>,
    /// True outputs in their units.
    stated: Vec<f64>,
    is_untouched: bool,
}

impl<'m> Unit<'m> {
    /// All networks of a `model` in their order.
    fn all(model: &PreparedModel<'m>, readings: &Table, outputs: &Table) -> Vec<Self> {
        let parsed = model.model();
        let (fronts, all_errors) = (parsed.fronts().collect::<Vec<_>>(), training_errors(parsed));
        let inputs = model.model_inputs(&readings.values);
        let of_networks = model.inputs_of_networks(&readings.values);
        let mut outputs_before = 0;
        let unit = |(index, network): (usize, Network<'m>)| {
            let front = fronts.get(index).copied();
            let touch = front.and_then(|front| front.touch);
            let of_row = |row: &usize| parsed.network_of_row(*row) == Some(index);
            let row = (0..parsed.shape().rows).find(of_row).filter(|_| front.is_none());
            let count = network.shape().outputs;
            let from = row.map_or(outputs_before, |row| row * count);
            outputs_before += count;
            let is_shared = front.is_none() || touch.is_some();
            let table = if is_shared { &inputs[..] } else { &of_networks[index] };
            let width = touch.map_or(network.shape().inputs, |touch| touch.readings());
            let press = |(line, all): (&[f64], &[f64])| {
                let is_untouched = is_untouched(&outputs.names, all);
                let mut stated = all[from..from + count].to_vec();
                if is_untouched && front.is_some_and(|front| front.of_places().is_some()) {
                    stated.fill(f64::NAN);
                }
                let taken = line[row.unwrap_or(0) * width..][..width].to_vec();
                Press { taken, stated, is_untouched }
            };
            let lines = table.chunks_exact(table.len() / readings.len()).zip(outputs.lines());
            let is_usable = |press: &Press| !press.taken.iter().any(|it| is_missing(*it));
            Self {
                network,
                front: front.filter(|_| touch.is_some()),
                errors: all_errors[from..from + count].to_vec(),
                presses: lines.map(press).filter(is_usable).collect(),
            }
        };
        parsed.networks().enumerate().map(unit).collect()
    }

    /// Whether there are enough presses, and different ones.
    fn is_excited(&self) -> bool {
        let values = self.presses.iter().flat_map(|press| press.stated.clone()).collect();
        let stated = Table { names: vec![String::new(); self.errors.len()], values };
        let parts = stated.deviations().into_iter().zip(&self.errors);
        let variances = parts.filter(|it| *it.1 > 0.0).map(|(of, error)| (of / error).powi(2));
        let variances: Vec<f64> = variances.filter(|it| it.is_finite()).collect();
        self.presses.len() >= FEWEST && mean(&variances) >= LEAST_VARIETY
    }

    /// Shift, unless the network is no better with it, and mean squared errors before and after.
    fn recalibrate(&self) -> (Option<Vec<f64>>, [f64; 2]) {
        let shift = self.fit();
        let before = self.squares(&vec![0.0; shift.len()]);
        let mut after = before.clone();
        for part in 0..PARTS {
            let [judged, fitted] = [true, false].map(|is_judged| {
                let presses = self.presses.iter().enumerate();
                let kept = presses.filter(|(press, _)| (press % PARTS == part) == is_judged);
                Self { presses: kept.map(|(_, press)| press.clone()).collect(), ..self.clone() }
            });
            let squares = judged.squares(&fitted.fit());
            after.iter_mut().skip(part).step_by(PARTS).zip(squares).for_each(|(it, of)| *it = of);
        }
        let is_better = doubted(&after) < WORTH * doubted(&before);
        if is_better {
            (Some(shift), [mean(&before), mean(&after)])
        } else {
            (None, [mean(&before); 2])
        }
    }

    /// Errors of all presses as a device decodes them, with what is taken shifted: 0 for what is not stated.
    fn errors_at(&self, shift: &[f64]) -> Vec<f64> {
        let taken = self.presses.iter().flat_map(|press| press.taken.iter().zip(shift));
        let inputs: Vec<f64> = taken.map(|(it, shift)| it - shift).collect();
        let decoded = decode(self.front.as_slice(), &[self.network], &inputs);
        let stated = self.presses.iter().flat_map(|press| press.stated.iter().zip(&self.errors));
        let error = |(decoded, (stated, error)): (&f64, (&f64, &f64))| {
            if stated.is_nan() || *error <= 0.0 {
                0.0
            } else if decoded.is_nan() {
                UNTOLD
            } else {
                (decoded - stated) / error
            }
        };
        decoded.iter().zip(stated).map(error).collect()
    }

    /// Mean squared error of each press, with what is taken shifted.
    fn squares(&self, shift: &[f64]) -> Vec<f64> {
        let errors = self.errors_at(shift);
        errors.chunks_exact(self.errors.len()).map(mean_square).collect()
    }

    /// Shift from which a fit starts, and the span of each of its numbers.
    fn guess(&self) -> (Vec<f64>, Vec<f64>) {
        let numbers = 0..self.presses[0].taken.len();
        let quantile = |number: usize, share: f64| {
            let mut values: Vec<f64> = self.presses.iter().map(|it| it.taken[number]).collect();
            values.sort_by(f64::total_cmp);
            values[((values.len() - 1) as f64 * share).round() as usize]
        };
        // One in fifty at either end may be wrong.
        let range = |number: usize| [0.02, 0.98].map(|share| quantile(number, share));
        if let Some(touch) = self.front.and_then(|front| front.touch) {
            let usual = 0.5 - REST_SHARE * f64::from(touch.strengths().side);
            let of_reading = |number: usize| {
                let untouched = self.presses.iter().filter(|it| it.is_untouched);
                let rest: Vec<f64> = untouched.map(|it| it.taken[number]).collect();
                let ([low, high], [level, threshold]) =
                    (range(number), touch.pairs()[number].map(f64::from));
                // A mean at rest is as uncertain as noise leaves it, and may then move by so much.
                let noise = threshold / THRESHOLD / (rest.len() as f64).sqrt();
                match rest[..] {
                    [] => (quantile(number, usual) - level, high - low),
                    _ if noise > 0.0 => (mean(&rest) - level, PRIOR * noise),
                    _ => (mean(&rest) - level, high - low),
                }
            };
            return numbers.map(of_reading).unzip();
        }
        let of_input = |input: usize| {
            let ([low, high], [from, to]) = (range(input), self.network.training_range(input));
            let [from, to] = [from, to].map(f64::from);
            // An input that never changed in training stays.
            if to > from { ([low - from, high - to], to - from) } else { ([0.0; 2], 0.0) }
        };
        let (ends, spans): (Vec<[f64; 2]>, Vec<f64>) = numbers.clone().map(of_input).unzip();
        let between = |input: usize, share: f64| {
            let [low, high] = ends[input];
            low + share * (high - low)
        };
        let mut guess: Vec<f64> = numbers.clone().map(|input| between(input, 0.5)).collect();
        for input in numbers.clone().chain(numbers) {
            let tried = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| {
                guess[input] = between(input, share);
                (doubted(&self.squares(&guess)), guess[input])
            });
            guess[input] = tried.into_iter().fold(tried[0], |a, b| if b.0 < a.0 { b } else { a }).1;
        }
        (guess, spans)
    }

    /// The shift that explains the presses best, near the guess that they give.
    fn fit(&self) -> Vec<f64> {
        let (guess, spans) = self.guess();
        let outputs = self.errors.len();
        let at = |steps: &[f64]| -> Vec<f64> {
            let moved = guess.iter().zip(steps).zip(&spans);
            moved.map(|((guess, step), span)| guess + step * span).collect()
        };
        let cost = |steps: &[f64]| {
            let from_guess = PRIOR.powi(2) * steps.iter().map(|step| step * step).sum::<f64>();
            outputs as f64 / DOUBT * doubted(&self.squares(&at(steps))) + from_guess
        };
        let mut steps = vec![0.0; guess.len()];
        let mut lowest = cost(&steps);
        for _ in 0..MOST_STEPS {
            let errors = self.errors_at(&at(&steps));
            let moved = parallel::map(guess.len(), &|number| {
                let mut steps = steps.clone();
                steps[number] += STEP;
                self.errors_at(&at(&steps))
            });
            let mut rls = Rls::new([guess.len(), 1], PRIOR.powi(-2), 1.0).expect("a usual prior");
            for (index, error) in errors.iter().enumerate() {
                let of_press = &errors[index / outputs * outputs..][..outputs];
                let weight = (1.0 + DOUBT * mean_square(of_press)).sqrt().recip();
                let slope = |moved: &Vec<f64>| weight * (moved[index] - error) / STEP;
                let mut slopes: Vec<f64> = moved.iter().map(slope).collect();
                let before: f64 = slopes.iter().zip(&steps).map(|(slope, step)| slope * step).sum();
                // A press that decodes to more than any number says nothing.
                let _ = rls.update(&mut slopes, &mut [before - weight * error]);
            }
            let (best, before) = (rls.weights(), lowest);
            for halvings in 0..MOST_HALVINGS {
                let part =
                    |(step, best): (&f64, &f64)| step + 0.5_f64.powi(halvings) * (best - step);
                let next: Vec<f64> = steps.iter().zip(&best).map(part).collect();
                let found = cost(&next);
                if found < lowest {
                    (steps, lowest) = (next, found);
                    break;
                }
            }
            if lowest > (1.0 - LEAST_GAIN) * before {
                break;
            }
        }
        at(&steps)
    }

    /// The network, and the numbers of the touch before it, with what they take shifted.
    fn shifted(&self, shift: Option<&[f64]>) -> Result<(FittedNetwork, Vec<f32>)> {
        // Every format's words begin with the zeros of the inputs.
        let mut words: Vec<u32> = match &self.network {
            Network::F32(network) => network.parameters().words().collect(),
            Network::Fixed16(network) => network.block().to_vec(),
        };
        let mut block: Vec<f32> = vec![];
        let moved = |zero: f32, shift: f64| (f64::from(zero) + shift) as f32;
        let shift = shift.unwrap_or_default();
        if let Some(touch) = self.front.and_then(|front| front.touch) {
            block = touch.block().to_vec();
            let levels = block[block_floats(0)..].iter_mut().step_by(2);
            levels.zip(shift).for_each(|(level, shift)| *level = moved(*level, *shift));
        } else {
            let zeros = words.iter_mut().zip(shift);
            zeros.for_each(|(word, shift)| *word = moved(f32::from_bits(*word), *shift).to_bits());
        }
        let (shape, affine) = (self.network.shape(), self.network.has_affine_tail());
        Ok((FittedNetwork::try_new(shape, self.network.format(), affine, words)?, block))
    }
}

/// Whether a press states that nothing touches: all outputs that are no places are 0.
pub fn is_untouched(names: &[String], stated: &[f64]) -> bool {
    let amounts = names.iter().zip(stated).filter(|(name, _)| !columns::is_place(name));
    let mut amounts = amounts.map(|(_, stated)| *stated).peekable();
    amounts.peek().is_some() && amounts.all(|stated| stated == 0.0)
}

/// Sum over presses of the cost of their mean squared errors: little more for a large one.
fn doubted(squares: &[f64]) -> f64 {
    squares.iter().map(|square| (DOUBT * square).ln_1p()).sum()
}

fn mean_square(errors: &[f64]) -> f64 {
    errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

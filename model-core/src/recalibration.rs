//! Recalibration: fitting a model's inputs to a sensor that has changed, from reference presses.
//!
//! Readings drift: channel by channel, by gain and by offset. Within the small range of readings that a press spans,
//! either is a shift of the channel. So a shift of every network's inputs is what recalibration finds: of the readings
//! of a row, or of the features behind a projection. Weights and centres stay as they were trained.
//!
//! For each press the true outputs are known.
//!
//! - The first [`GUESSES`] presses guess: centres are inputs whose outputs the network tells, so a linear regression of
//!   centres on their outputs says which inputs the stated outputs should have had. The mean difference to those that
//!   were read is the shift to begin with. Behind a projection, inputs drift less, and none is needed.
//! - All others refine: the network's slopes tell how the shifts must change for its outputs to become the stated ones.
//!   This is extended recursive least squares, in the square-root form of [`rls`]. The network is taken as a smooth
//!   function without clamp (`rbf/smooth.rs`): a tenth more gain moves an input by a whole training range, where
//!   clamped inputs have no slope.
//!
//! A press counts 1/(1 + 3e²) with e its error, in training errors: one that is far from explained, whose slopes mean
//! little, or whose outputs were misstated, says little. Presses are forgotten by [`FORGETTING`], with leakage, so that
//! early slopes fade and unobserved shifts stay where they are.
//!
//! docs/recalibration.md has what it reaches, and what was tried besides.

use crate::blob::{Model, ModelShape};
use crate::projection::Projection;
use crate::rbf::{Network, Smooth};
use crate::relative::relative;
use crate::rls;

/// Forgetting factor λ from one press to the next.
pub const FORGETTING: f32 = 0.98;
/// 1/√δ: after the first guess, shifts are expected to be wrong by a quarter of a training range.
const DIAGONAL: f32 = 4.0;
/// Number of presses that guess.
pub const GUESSES: u16 = 20;
/// Most outputs of a network whose shifts are guessed.
const MOST_GUESSED: usize = 32;
/// Most centres that the regression takes, evenly spread: each costs an inference.
const MOST_CENTRES: usize = 64;
/// Root of the ridge penalty of the regression that guesses, for outputs in training errors.
const RIDGE: f32 = 3.0;
/// The same for its intercept, which is not to be penalised.
const NO_RIDGE: f32 = 1e-3;
/// How fast errors are averaged: over so many presses, once there are as many.
const WINDOW: f32 = 24.0;
/// Largest squared error of a network that is better than before, relative to that before.
const WORTH: f32 = 0.9;
/// Weight of a squared error in the weight of its press.
const DOUBT: f32 = 3.0;
/// Farthest that an input may be from the training range after its shift, in training ranges.
const FARTHEST: f32 = 8.0;
/// Largest usable error of an output, in training errors.
const MOST_ERRORS: f32 = 1e4;
/// Least training error that counts, relative to the full scale of the output.
const LEAST_ERROR: f32 = 1e-3;
/// Least mean variance of the stated outputs, in squared training errors, with which presses count as different.
pub const LEAST_VARIETY: f32 = 0.05;

/// Why a model cannot be recalibrated, or a press cannot be used, or no new model is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecalibrationError {
    /// Rows share a network, whose inputs can be shifted for all of them alone.
    #[error("rows of the model share a network; train one a row")]
    SharedNetworks,
    /// The model expands few components to its outputs, has a confidence, fills missing readings, or tells no training errors.
    #[error(
        "the model has an output rank, a confidence, a fill, or training errors of 0: train one without"
    )]
    Unsuitable,
    /// There is too little memory.
    #[error("recalibration of this model needs memory of {floats} numbers")]
    NoRoom {
        /// Number of `f32` that are needed.
        floats: usize,
    },
    /// A reading is missing or far beyond the training range, or a stated output is no possible one, in every row.
    #[error("a reading is missing or far out of range, or a stated output is impossible")]
    UnusablePress,
    /// Too few presses, or all alike.
    #[error("network {unit} has seen too few presses, or presses that are too alike")]
    NotExcited {
        /// Number of the row, or 0 behind a projection.
        unit: usize,
    },
    /// The model in force is as good.
    #[error("the recalibrated model is no better than the one in force")]
    NotBetter,
}

/// One reference press.
#[derive(Debug, Clone, Copy)]
pub struct Press<'p> {
    /// Readings in Ω, row after row; NaN is missing.
    pub readings_ohm: &'p [f32],
    /// [Reciprocals](crate::relative::reciprocal) of the baseline, for a model with relative inputs.
    pub reciprocals: &'p [f32],
    /// What the model in force decodes them to.
    pub decoded: &'p [f32],
    /// What the outputs truly are, in the model's units.
    pub stated: &'p [f32],
}

/// How far a recalibration is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Number of networks: rows, or 1 behind a projection.
    pub networks: usize,
    /// Number of networks that have seen enough different presses.
    pub excited: usize,
    /// Root mean square error of the model in force on the last presses, in training errors of each output.
    pub error_before: f32,
    /// The same of the recalibrated model, on each press before it was used.
    pub error_after: f32,
}

/// A recalibration that is going on, in memory that the caller lends.
///
/// All calls must be given the model that it was started for.
#[derive(Debug)]
pub struct Recalibration<'m> {
    memory: &'m mut [f32],
}

/// What is known of one network.
struct State<'s> {
    triangle: &'s mut [f32],
    /// Shift of each input, in spans.
    shift: &'s mut [f32],
    /// Mean of each stated output.
    mean: &'s mut [f32],
    totals: &'s mut [f32; TOTALS],
}

/// Number of presses, variety, and mean squared errors before and after.
const TOTALS: usize = 4;

/// The networks of a model: one a row, or one behind a projection.
#[derive(Clone, Copy)]
struct Units<'a> {
    model: Model<'a>,
    projection: Option<Projection<'a>>,
    count: usize,
    inputs: usize,
    outputs: usize,
}

impl<'a> Units<'a> {
    fn of(model: &Model<'a>) -> Result<Self, RecalibrationError> {
        let ModelShape { rows, inputs, outputs } = model.shape();
        let projection = model.projection();
        let (count, inputs, outputs) = match projection {
            Some(projection) => (1, projection.features(), rows.saturating_mul(outputs)),
            None => (rows, inputs, outputs),
        };
        let network = |row| model.network_of_row(row);
        let shared = |row: usize| (0..row).any(|before| network(before) == network(row));
        if projection.is_none() && (0..rows).any(shared) {
            return Err(RecalibrationError::SharedNetworks);
        }
        let units = Self { model: *model, projection, count, inputs, outputs };
        for unit in 0..count {
            let shape = units.network(unit).map(|network| network.shape());
            let fits =
                shape.is_some_and(|shape| (shape.inputs, shape.outputs) == (inputs, outputs));
            if !fits
                || model.expansion().is_some()
                || model.confidence().is_some()
                || model.fill().is_some()
                || !(0..outputs).any(|o| units.error_of(unit, o) > 0.0)
            {
                return Err(RecalibrationError::Unsuitable);
            }
        }
        Ok(units)
    }

    fn network(&self, unit: usize) -> Option<Network<'a>> {
        self.model.networks().nth(self.model.network_of_row(unit)?)
    }

    /// Training error of an output of a unit, in its unit; 0 if it never changed.
    fn error_of(&self, unit: usize, output: usize) -> f32 {
        let metadata = self.model.metadata();
        let place = unit.saturating_mul(self.outputs).saturating_add(output);
        let rmse = metadata.training_rmse.iter().nth(place).unwrap_or(0.0);
        let full_scale = metadata.full_scale.iter().nth(place).unwrap_or(0.0);
        rmse.max(LEAST_ERROR * full_scale)
    }

    /// Number of floats of one unit's state.
    fn floats(&self) -> usize {
        rls::triangle_values(self.inputs)
            .saturating_add(self.inputs)
            .saturating_add(self.outputs)
            .saturating_add(TOTALS)
    }

    /// Number of floats for the regression that guesses; 0 if there is none.
    fn guess_floats(&self) -> usize {
        if self.outputs > MOST_GUESSED {
            return 0;
        }
        let regressors = self.outputs + 1;
        // Triangle, targets, and one sample.
        rls::triangle_values(regressors) + regressors * self.inputs + regressors + self.inputs
    }

    /// Number of floats of working space for a press.
    fn scratch_floats(&self) -> usize {
        self.inputs.saturating_mul(5).saturating_add(1).saturating_add(self.guess_floats())
    }

    fn state<'s>(&self, memory: &'s mut [f32], unit: usize) -> Option<State<'s>> {
        let one = self.floats();
        let memory = memory.chunks_exact_mut(one.max(1)).nth(unit)?;
        let (triangle, rest) = memory.split_at_mut_checked(rls::triangle_values(self.inputs))?;
        let (shift, rest) = rest.split_at_mut_checked(self.inputs)?;
        let (mean, totals) = rest.split_at_mut_checked(self.outputs)?;
        Some(State { triangle, shift, mean, totals: totals.first_chunk_mut()? })
    }

    /// Writes the inputs of a unit's network for a press to `given`, in their units.
    fn give(&self, unit: usize, press: &Press<'_>, given: &mut [f32]) {
        let relative_inputs = self.model.metadata().relative_inputs;
        let reading = |place: usize| {
            let ohm = press.readings_ohm.get(place).copied().unwrap_or(f32::NAN);
            if relative_inputs {
                relative(ohm, press.reciprocals.get(place).copied().unwrap_or(f32::NAN))
            } else {
                ohm
            }
        };
        if let Some(projection) = self.projection {
            let mut lines = projection.block().chunks_exact(self.inputs.max(1));
            let start = lines.next().unwrap_or_default();
            given.iter_mut().zip(start).for_each(|(feature, start)| *feature = *start);
            for (place, parts) in lines.enumerate() {
                let reading = reading(place);
                given.iter_mut().zip(parts).for_each(|(feature, part)| *feature += part * reading);
            }
        } else {
            let first = unit.saturating_mul(self.inputs);
            for (i, place) in given.iter_mut().enumerate() {
                *place = reading(first.saturating_add(i));
            }
        }
    }
}

/// Working space for one press, cut from the caller's.
struct Room<'r> {
    /// For the regression that guesses; empty behind a projection.
    guess: &'r mut [f32],
    x: &'r mut [f32],
    difference: &'r mut [f32],
    target: &'r mut [f32],
    step: &'r mut [f32],
    values: &'r mut [f32],
    slopes: &'r mut [f32],
}

impl<'r> Room<'r> {
    /// Cuts room for the networks of `units`, and for as many outputs at once as there is room for.
    fn cut(scratch: &'r mut [f32], units: &Units<'_>) -> Option<Self> {
        let inputs = units.inputs;
        let (guess, rest) = scratch.split_at_mut_checked(units.guess_floats())?;
        let (x, rest) = rest.split_at_mut_checked(inputs)?;
        let (difference, rest) = rest.split_at_mut_checked(inputs)?;
        let (target, rest) = rest.split_at_mut_checked(inputs)?;
        let (step, rest) = rest.split_at_mut_checked(inputs)?;
        let at_once = rest.len() / inputs.saturating_add(1).max(1);
        let (values, rest) = rest.split_at_mut_checked(at_once)?;
        let slopes = rest.get_mut(..at_once.checked_mul(inputs)?)?;
        (at_once > 0).then_some(Self { guess, x, difference, target, step, values, slopes })
    }
}

impl<'m> Recalibration<'m> {
    /// Number of `f32` of memory that a recalibration of `model` takes. For 8 rows of 18 readings and 18 outputs:
    /// 1688.
    ///
    /// # Errors
    /// [`RecalibrationError`]: the model cannot be recalibrated.
    pub fn floats(model: &Model<'_>) -> Result<usize, RecalibrationError> {
        let units = Units::of(model)?;
        Ok(units.count.saturating_mul(units.floats()))
    }

    /// Number of `f32` of working space that a press needs at least. With more, it is faster. For 8 rows of 18 readings
    /// and 18 outputs: 660.
    ///
    /// # Errors
    /// [`RecalibrationError`]: the model cannot be recalibrated.
    pub fn scratch_floats(model: &Model<'_>) -> Result<usize, RecalibrationError> {
        Ok(Units::of(model)?.scratch_floats())
    }

    /// Starts with no shift, in the first of `memory`.
    ///
    /// # Errors
    /// [`RecalibrationError`]: the model cannot be recalibrated, or not in so little memory.
    pub fn start(model: &Model<'_>, memory: &'m mut [f32]) -> Result<Self, RecalibrationError> {
        let units = Units::of(model)?;
        let recalibration = Self::resume(model, memory)?;
        recalibration.memory.fill(0.0);
        for unit in 0..units.count {
            if let Some(state) = units.state(recalibration.memory, unit) {
                rls::start(state.triangle, units.inputs, DIAGONAL);
            }
        }
        Ok(recalibration)
    }

    /// Goes on with a recalibration of this `model` that was [started](Self::start) in this memory.
    ///
    /// # Errors
    /// [`RecalibrationError`]: the model cannot be recalibrated, or not in so little memory.
    pub fn resume(model: &Model<'_>, memory: &'m mut [f32]) -> Result<Self, RecalibrationError> {
        let floats = Self::floats(model)?;
        let memory = memory.get_mut(..floats).ok_or(RecalibrationError::NoRoom { floats })?;
        Ok(Self { memory })
    }

    /// Adds a press. Rows whose readings or outputs are unusable learn nothing from it. `scratch` is working space of
    /// [`scratch_floats`](Self::scratch_floats) or more.
    ///
    /// # Errors
    /// [`RecalibrationError::UnusablePress`]: no row could use it, and nothing changed;
    /// [`RecalibrationError::NoRoom`]: the scratch is too small.
    pub fn add(
        &mut self,
        model: &Model<'_>,
        press: &Press<'_>,
        scratch: &mut [f32],
    ) -> Result<(), RecalibrationError> {
        let units = Units::of(model)?;
        let floats = units.scratch_floats();
        let mut room = Room::cut(scratch, &units).ok_or(RecalibrationError::NoRoom { floats })?;
        let mut used = false;
        for unit in 0..units.count {
            let network = units.network(unit);
            if let (Some(network), Some(mut state)) = (network, units.state(self.memory, unit)) {
                used |= state.learn(&units, unit, &Smooth::of(&network), press, &mut room);
            }
        }
        if used { Ok(()) } else { Err(RecalibrationError::UnusablePress) }
    }

    /// How far the recalibration is.
    pub fn progress(&mut self, model: &Model<'_>) -> Progress {
        let mut progress =
            Progress { networks: 0, excited: 0, error_before: 0.0, error_after: 0.0 };
        let Ok(units) = Units::of(model) else { return progress };
        progress.networks = units.count;
        for unit in 0..units.count {
            let Some(state) = units.state(self.memory, unit) else { continue };
            let [_, _, before, after] = *state.totals;
            progress.excited += usize::from(state.is_excited(units.inputs));
            progress.error_before += before / units.count as f32;
            progress.error_after += after / units.count as f32;
        }
        progress.error_before = libm::sqrtf(progress.error_before);
        progress.error_after = libm::sqrtf(progress.error_after);
        progress
    }

    /// Ends the recalibration. Networks whose error has not fallen keep their inputs.
    ///
    /// # Errors
    /// [`RecalibrationError::NotExcited`], [`RecalibrationError::NotBetter`]: nothing changed, and more presses may
    /// be added.
    pub fn finish(&mut self, model: &Model<'_>) -> Result<(), RecalibrationError> {
        let units = Units::of(model)?;
        let mut any_better = false;
        for unit in 0..units.count {
            let state = units.state(self.memory, unit);
            let excited = state.as_ref().is_some_and(|state| state.is_excited(units.inputs));
            if !excited {
                return Err(RecalibrationError::NotExcited { unit });
            }
            any_better |= state.is_some_and(|state| state.is_better());
        }
        if !any_better {
            return Err(RecalibrationError::NotBetter);
        }
        for unit in 0..units.count {
            if let Some(state) = units.state(self.memory, unit).filter(|state| !state.is_better()) {
                state.shift.fill(0.0);
            }
        }
        Ok(())
    }

    /// Writes the shifted zeros of the inputs into `bytes`, which are those of the model's `blob` from `offset` on. The
    /// CRC at the blob's end is not changed. `offset` and the number of bytes must be multiples of four, but for the
    /// blob's last bytes.
    pub fn patch(&mut self, model: &Model<'_>, blob: &[u8], offset: usize, bytes: &mut [u8]) {
        let Ok(units) = Units::of(model) else { return };
        for unit in 0..units.count {
            let (Some(network), Some(state)) =
                (units.network(unit), units.state(self.memory, unit))
            else {
                continue;
            };
            let [zeros, ..] = network.block();
            // Both lie in the blob: this is where the network's block begins.
            let start = (zeros.as_ptr().addr()).wrapping_sub(blob.as_ptr().addr());
            let smooth = Smooth::of(&network);
            for (input, &shift) in state.shift.iter().enumerate() {
                let place = start.wrapping_add(4 * input).wrapping_sub(offset);
                let word = bytes.get_mut(place..).and_then(|rest| rest.first_chunk_mut::<4>());
                if let Some(word) = word {
                    *word = moved(smooth.scale_of(input), shift).to_le_bytes();
                }
            }
        }
    }
}

/// The zero of an input after a `shift` in spans. An input that never changed in training stays.
fn moved((zero, per_unit): (f32, f32), shift: f32) -> f32 {
    let moved = zero + shift / per_unit;
    if per_unit > 0.0 && moved.is_finite() { moved } else { zero }
}

impl State<'_> {
    /// Learns from a press; returns whether it could. Nothing changes if not.
    fn learn(
        &mut self,
        units: &Units<'_>,
        unit: usize,
        network: &Smooth<'_>,
        press: &Press<'_>,
        room: &mut Room<'_>,
    ) -> bool {
        units.give(unit, press, room.x);
        for (i, (x, shift)) in room.x.iter_mut().zip(&*self.shift).enumerate() {
            let (zero, per_unit) = network.scale_of(i);
            *x = (*x - zero) * per_unit - shift;
        }
        let first = unit.saturating_mul(units.outputs);
        let of_unit = |values: &[f32], output: usize| {
            values.get(first.saturating_add(output)).copied().unwrap_or(f32::NAN)
        };
        let near = room.x.iter().all(|x| x.abs() <= FARTHEST);
        let Some((before, after)) =
            near.then(|| Self::errors(units, unit, network, press, room)).flatten()
        else {
            return false;
        };

        // The stated outputs' mean and variance, by Welford's recursion.
        let [count, variety, mean_before, mean_after] = &mut *self.totals;
        *count += 1.0;
        let mut step = 0.0;
        for (o, mean) in self.mean.iter_mut().enumerate() {
            let error = units.error_of(unit, o);
            let (stated, old) = (of_unit(press.stated, o), *mean);
            *mean += (stated - old) / *count;
            if error > 0.0 {
                step += (stated - old) / error * ((stated - *mean) / error);
            }
        }
        *variety += (step / units.outputs as f32 - *variety) / *count;
        let share = (1.0 / *count).max(1.0 / WINDOW);
        *mean_before += (before - *mean_before) * share;
        *mean_after += (after - *mean_after) * share;

        if units.guess_floats() > 0 && *count <= f32::from(GUESSES) {
            let count = *count;
            self.guess(units, unit, network, press, room, count);
        } else {
            let root_weight = libm::sqrtf(1.0 / (1.0 + DOUBT * after));
            self.update(units, unit, network, press, room, root_weight);
        }
        true
    }

    /// Guesses the inputs that the stated outputs should have had, and takes the mean difference of `count` presses
    /// for the shift.
    ///
    /// The regressors of centre k are its outputs f(cₖ), less the stated ones, and 1; so the intercept is the guess.
    fn guess(
        &mut self,
        units: &Units<'_>,
        unit: usize,
        network: &Smooth<'_>,
        press: &Press<'_>,
        room: &mut Room<'_>,
        count: f32,
    ) {
        let Units { inputs, outputs, .. } = *units;
        let regressors = outputs + 1;
        let Room { guess, x, difference, target, values, .. } = room;
        let (triangle, rest) =
            guess.split_at_mut_checked(rls::triangle_values(regressors)).unwrap_or_default();
        let (projection, rest) = rest.split_at_mut_checked(regressors * inputs).unwrap_or_default();
        let (regressor, centre) = rest.split_at_mut_checked(regressors).unwrap_or_default();
        rls::start(triangle, regressors, RIDGE);
        triangle.iter_mut().rev().take(1).for_each(|intercept| *intercept = NO_RIDGE);
        projection.fill(0.0);
        let at_once = values.len().max(1);
        let every = network.centres().div_ceil(MOST_CENTRES).max(1);
        for k in (0..network.centres()).step_by(every) {
            for (i, place) in target.iter_mut().enumerate() {
                *place = network.centre(k, i);
            }
            centre.iter_mut().zip(&**target).for_each(|(place, x)| *place = *x);
            regressor.fill(1.0);
            for first in (0..outputs).step_by(at_once) {
                let Some(values) = values.get_mut(..at_once.min(outputs - first)) else { return };
                network.infer(target, first, values, &mut [], difference);
                for (o, value) in values.iter().enumerate() {
                    let error = units.error_of(unit, first + o);
                    let place = unit.saturating_mul(outputs).saturating_add(first + o);
                    let stated = press.stated.get(place).copied().unwrap_or(*value);
                    let scaled = if error > 0.0 { (value - stated) / error } else { 0.0 };
                    regressor.iter_mut().skip(first + o).take(1).for_each(|h| *h = scaled);
                }
            }
            if rls::is_usable(regressor) && rls::is_usable(centre) {
                rls::rotate(triangle, projection, regressor, centre);
            }
        }
        // The intercept is the last weight.
        let pivot = triangle.last().copied().unwrap_or(1.0);
        let intercepts = projection.chunks_exact(inputs.max(1)).next_back().unwrap_or_default();
        for ((shift, &x), z) in self.shift.iter_mut().zip(&**x).zip(intercepts) {
            // `x` has been shifted by the mean so far.
            let step = (x - z / pivot) / count;
            *shift += if step.is_finite() { step } else { 0.0 };
        }
    }

    /// Mean squared errors, in training errors, of the model in force and of the recalibrated one; `None` if one of
    /// them is out of range.
    fn errors(
        units: &Units<'_>,
        unit: usize,
        network: &Smooth<'_>,
        press: &Press<'_>,
        room: &mut Room<'_>,
    ) -> Option<(f32, f32)> {
        let (mut before, mut after, mut count) = (0.0, 0.0, 0.0_f32);
        let outputs = units.outputs;
        let all = unit.saturating_mul(outputs);
        let at_once = room.values.len().max(1);
        for first in (0..outputs).step_by(at_once) {
            let values = room.values.get_mut(..at_once.min(outputs - first))?;
            network.infer(room.x, first, values, &mut [], room.difference);
            for (o, value) in values.iter().enumerate() {
                let error = units.error_of(unit, first + o);
                let place = all.saturating_add(first + o);
                let (stated, decoded) = (*press.stated.get(place)?, *press.decoded.get(place)?);
                if error > 0.0 {
                    let errors = [(decoded - stated) / error, (value - stated) / error];
                    if !errors.iter().all(|error| error.abs() <= MOST_ERRORS) {
                        return None;
                    }
                    before += errors[0] * errors[0];
                    after += errors[1] * errors[1];
                    count += 1.0;
                } else if !stated.is_finite() {
                    return None;
                }
            }
        }
        Some((before / count, after / count))
    }

    /// Updates the shifts by one press.
    fn update(
        &mut self,
        units: &Units<'_>,
        unit: usize,
        network: &Smooth<'_>,
        press: &Press<'_>,
        room: &mut Room<'_>,
        root_weight: f32,
    ) {
        let Room { x, difference, target, step, values, slopes, .. } = room;
        let outputs = units.outputs;
        let all = unit.saturating_mul(outputs);
        let at_once = values.len().max(1);
        // z counts from the shifts so far, so that it is 0 before each press.
        target.fill(0.0);
        rls::forget(self.triangle, target, libm::sqrtf(FORGETTING));
        for first in (0..outputs).step_by(at_once) {
            let Some(values) = values.get_mut(..at_once.min(outputs - first)) else { return };
            network.infer(x, first, values, slopes, difference);
            let lines = slopes.chunks_exact_mut(units.inputs.max(1));
            for (o, (value, slopes)) in values.iter().zip(lines).enumerate() {
                let error = units.error_of(unit, first + o);
                let place = all.saturating_add(first + o);
                let Some(stated) = press.stated.get(place).filter(|_| error > 0.0) else {
                    continue;
                };
                // A shift lowers the input.
                let weight = root_weight / error;
                slopes.iter_mut().for_each(|slope| *slope *= weight);
                let residual = (value - stated) * weight;
                if rls::is_usable(slopes) && rls::is_usable(&[residual]) {
                    rls::rotate(self.triangle, target, slopes, &mut [residual]);
                }
            }
        }
        // What forgetting took, in favour of the shifts so far.
        let leak = libm::sqrtf(1.0 - FORGETTING) * DIAGONAL;
        for i in 0..units.inputs {
            step.fill(0.0);
            step.iter_mut().skip(i).take(1).for_each(|place| *place = leak);
            rls::rotate(self.triangle, target, step, &mut [0.0]);
        }
        rls::solve_triangle(self.triangle, target, units.inputs, step);
        if step.iter().all(|step| step.is_finite()) {
            self.shift.iter_mut().zip(&**step).for_each(|(shift, step)| *shift += step);
        } else {
            // Cannot be: leakage keeps R far from singular. But nothing may poison the state for good.
            rls::start(self.triangle, units.inputs, DIAGONAL);
        }
    }

    /// Whether there were as many presses as unknowns, and different ones.
    fn is_excited(&self, inputs: usize) -> bool {
        let [count, variety, ..] = *self.totals;
        count >= inputs as f32 && variety >= LEAST_VARIETY
    }

    /// Whether the error has fallen by more than chance makes it fall.
    fn is_better(&self) -> bool {
        let [.., before, after] = *self.totals;
        after < WORTH * before
    }
}

#[cfg(test)]
mod tests;

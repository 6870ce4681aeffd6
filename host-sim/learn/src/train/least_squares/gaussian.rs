//! Regressors of the network: Gaussian activations, affine tail, bias.

use std::borrow::Cow;
use std::ops::Range;

use super::Design;
use super::exp::exponentiate_non_positive;
use crate::train::squared_distance;
use taxel_data::widest;

/// Centres evaluated side by side.
const LANES: usize = 8;

/// Regressors that the output weights multiply: activations, then the scaled inputs if there is an
/// affine tail, then 1 for the bias.
#[derive(Debug, Clone, Copy)]
pub struct Regressors<'c> {
    /// Centres on scaled inputs, `centres × inputs`; empty for a linear decoder.
    pub centres: &'c [f64],
    /// Number of inputs.
    pub inputs: usize,
    /// Decays 1/(2σ²) of the Gaussians, on scaled inputs: one for all centres, or one for each.
    pub decays: &'c [f64],
    /// Whether the scaled inputs are regressors too.
    pub affine_tail: bool,
}

impl<'c> Regressors<'c> {
    /// Number of regressors.
    pub fn count(&self) -> usize {
        self.centres.len() / self.inputs + if self.affine_tail { self.inputs } else { 0 } + 1
    }

    /// Writes the regressors of one sample's `scaled` inputs into `values`, as far as there is room.
    pub fn evaluate(&self, scaled: &[f64], values: &mut [f64]) {
        let centres = self.centres.len() / self.inputs;
        let (activations, rest) = values.split_at_mut(centres);
        widest!({
            let gaussians = self.centres.chunks_exact(self.inputs).zip(self.decays.iter().cycle());
            for (place, (centre, decay)) in activations.iter_mut().zip(gaussians) {
                *place = -decay * squared_distance(scaled, centre);
            }
            activations.iter_mut().for_each(|x| *x = taxel_data::exp(*x));
        });
        let tail = if self.affine_tail { scaled } else { &[] };
        let values = tail.iter().copied().chain([1.0]);
        rest.iter_mut().zip(values).for_each(|(place, value)| *place = value);
    }

    /// Regressors of many samples, with `scaled` inputs (`samples × inputs`).
    pub fn of(&self, scaled: impl Into<Cow<'c, [f64]>>) -> Gaussians<'c> {
        let count = self.centres.len() / self.inputs;
        let mut lanes = vec![[0.0; LANES]; count.div_ceil(LANES) * self.inputs];
        for (k, centre) in self.centres.chunks_exact(self.inputs).enumerate() {
            let places = &mut lanes[k / LANES * self.inputs..];
            places.iter_mut().zip(centre).for_each(|(place, c)| place[k % LANES] = *c);
        }
        let mut decays = vec![[0.0; LANES]; count.div_ceil(LANES)];
        let places = decays.as_flattened_mut().iter_mut().take(count);
        places.zip(self.decays.iter().cycle()).for_each(|(place, decay)| *place = *decay);
        Gaussians { regressors: *self, scaled: scaled.into(), lanes, decays }
    }
}

/// [`Regressors`] of a set of samples, several centres at a time.
///
/// Values agree with [`Regressors::evaluate`] to within rounding (a few 1e-16).
#[derive(Debug, Clone)]
pub struct Gaussians<'s> {
    regressors: Regressors<'s>,
    scaled: Cow<'s, [f64]>,
    /// Centres in groups of [`LANES`], input after input; the last group is filled up with 0.
    lanes: Vec<[f64; LANES]>,
    /// Decays of the centres in each group.
    decays: Vec<[f64; LANES]>,
}

impl Design for Gaussians<'_> {
    fn regressors(&self) -> usize {
        self.regressors.count()
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let inputs = self.regressors.inputs;
        self.write(&self.scaled[samples.start * inputs..samples.end * inputs], values);
    }
}

impl Gaussians<'_> {
    /// Writes the regressors of other samples, with these `scaled` inputs, into `values` (`samples × n`, row-major).
    pub(crate) fn write(&self, scaled: &[f64], values: &mut [f64]) {
        let (inputs, n) = (self.regressors.inputs, self.regressors.count());
        let (lanes, decays) = (self.lanes.as_slice(), self.decays.as_slice());
        let centres = self.regressors.centres.len() / inputs;
        widest!({
            for (x, row) in scaled.chunks_exact(inputs).zip(values.chunks_exact_mut(n)) {
                let (activations, rest) = row.split_at_mut(centres);
                let groups = lanes.chunks_exact(inputs).zip(decays);
                for ((group, decays), places) in groups.zip(activations.chunks_mut(LANES)) {
                    let values = exponents(x, group, decays);
                    if let Some(whole) = places.first_chunk_mut() {
                        *whole = values;
                    } else {
                        places.copy_from_slice(&values[..places.len()]);
                    }
                }
                exponentiate_non_positive(activations);
                let tail = rest.len() - 1;
                rest[..tail].copy_from_slice(&x[..tail]);
                rest[tail] = 1.0;
            }
        });
    }
}

/// Exponents −decay·‖x − c‖² of a group of centres.
#[inline(always)]
fn exponents(x: &[f64], group: &[[f64; LANES]], decays: &[f64; LANES]) -> [f64; LANES] {
    let squares = squared_distances(x, group);
    std::array::from_fn(|l| -decays[l] * squares[l])
}

/// Squared distances of a point from those that lie side by side in lanes, coordinate after coordinate.
#[inline(always)]
pub(crate) fn squared_distances<const L: usize>(x: &[f64], lanes: &[[f64; L]]) -> [f64; L] {
    let mut sums = [0.0; L];
    for (x, c) in x.iter().zip(lanes) {
        for l in 0..L {
            sums[l] += (x - c[l]) * (x - c[l]);
        }
    }
    sums
}

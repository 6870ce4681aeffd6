//! How latents move: place and depth as smooth random motions about a mean, all others as slow random walks.
//!
//! A smooth motion is a Gaussian process with the covariance s²·(1 + λτ)·e^(−λτ) (Matérn's of order 3/2; Hartikainen and
//! Särkkä, "Kalman filtering and smoothing solutions to temporal Gaussian process regression models", 2010): value and rate
//! after a time dt are e^(−λdt)·[[1 + λdt, dt], [−λ²dt, 1 − λdt]] times those before.

use super::Contact;
use super::linear::{Square, cholesky, dot, sqrt};
use crate::exp::exp;

/// Number of latents.
pub const LATENTS: usize = 9;
/// Number of latents that move with a rate, the first ones: x, y and depth.
pub const RATES: usize = 3;
/// Numbers of the state: latents, and the rates of the first three.
pub const NUMBERS: usize = LATENTS + RATES;

/// Place along x and y, depth, radius in mm; shear along x and y over depth; and the form: ln a/2, b, ln p.
pub type Latents = [f32; LATENTS];

/// Share of the deepest depth below which a contact hardly touches, and of the deviations at a start that its form then has.
const LIGHT: f32 = 0.05;
const FORGOTTEN: f32 = 0.5;

/// A number for each of the state's.
pub type Vector = [f32; NUMBERS];

/// The latents among the numbers of a state.
pub fn latents(numbers: &Vector) -> &Latents {
    numbers.first_chunk().unwrap_or(&[0.0; LATENTS])
}

/// What is known of contacts before any reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Standard deviation of a reading's noise, as a share.
    pub noise: f32,
    /// λ in 1/s, standard deviation s and mean of x, y and depth.
    pub smooth: [[f32; 3]; RATES],
    /// Variance in a second of the other latents.
    pub walks: [f32; LATENTS - RATES],
    /// Standard deviation of each latent at a start by a network, and what those are that it does not tell: of radius, shear
    /// and form.
    pub start: [[f32; 2]; LATENTS],
    /// Least and greatest value of each latent.
    pub range: [[f32; 2]; LATENTS],
}

impl Settings {
    /// Number of floats.
    pub const FLOATS: usize = 1 + 3 * RATES + (LATENTS - RATES) + 4 * LATENTS;

    /// Settings of their floats, in the order of the fields.
    pub fn of_floats(floats: &[f32; Self::FLOATS]) -> Self {
        let mut rest = floats.iter().copied();
        let mut next = || rest.next().unwrap_or_default();
        let noise = next();
        let smooth = [(); RATES].map(|()| [next(), next(), next()]);
        let walks = [(); LATENTS - RATES].map(|()| next());
        let start = [(); LATENTS].map(|()| [next(), next()]);
        let range = [(); LATENTS].map(|()| [next(), next()]);
        Self { noise, smooth, walks, start, range }
    }

    /// The floats of these settings.
    pub fn floats(&self) -> [f32; Self::FLOATS] {
        let Self { noise, smooth, walks, start, range } = self;
        let all = [*noise].into_iter().chain(smooth.iter().flatten().copied());
        let all = all.chain(walks.iter().copied());
        let mut all = all.chain(start.iter().chain(range).flatten().copied());
        core::array::from_fn(|_| all.next().unwrap_or_default())
    }

    /// State that is expected `dt_s` later, or earlier.
    pub fn mean_after(&self, mean: &Vector, dt_s: f32) -> Vector {
        let mut later = *mean;
        for (axis, [rate, _, centre]) in self.smooth.into_iter().enumerate() {
            let now = [mean[axis], mean[LATENTS + axis]];
            [later[axis], later[LATENTS + axis]] = moved(now, centre, transition(rate, dt_s));
        }
        later
    }

    /// Lets a time pass over what is known.
    pub(super) fn predict(
        &self,
        contact: &mut Contact,
        dt_s: f32,
        covariance: &mut Square<NUMBERS>,
    ) {
        let Contact { mean, root, .. } = contact;
        for (axis, [rate, _, centre]) in self.smooth.into_iter().enumerate() {
            let (value, speed) = (axis, LATENTS + axis);
            let transition = transition(rate, dt_s);
            [mean[value], mean[speed]] = moved([mean[value], mean[speed]], centre, transition);
            let [[a, b], [c, d]] = transition;
            let (values, speeds) = (root[value], root[speed]);
            root[value] = core::array::from_fn(|at| a * values[at] + b * speeds[at]);
            root[speed] = core::array::from_fn(|at| c * values[at] + d * speeds[at]);
        }
        for row in 0..NUMBERS {
            for column in 0..=row {
                covariance[row][column] = dot(&root[row], &root[column]);
            }
        }
        for (axis, [rate, deviation, _]) in self.smooth.into_iter().enumerate() {
            let (value, speed) = (axis, LATENTS + axis);
            let [of_value, of_both, of_speed] = spread(rate, deviation, dt_s);
            covariance[value][value] += of_value;
            covariance[speed][value] += of_both;
            covariance[speed][speed] += of_speed;
        }
        for (place, walk) in (RATES..LATENTS).zip(self.walks) {
            covariance[place][place] += walk * dt_s;
        }
        cholesky(covariance);
        *root = *covariance;
    }

    /// Whether a contact hardly touches: readings tell nothing of its radius, shear and form.
    pub(super) fn is_light(&self, mean: &Vector) -> bool {
        mean[2] <= LIGHT * self.range[2][1]
    }

    /// Lets the next touch have another radius, shear and form.
    pub(super) fn widen_form(&self, root: &mut Square<NUMBERS>) {
        for (latent, (row, [deviation, _])) in
            root.iter_mut().zip(self.start).enumerate().skip(RATES)
        {
            *row = [0.0; NUMBERS];
            if let Some(diagonal) = row.get_mut(latent) {
                *diagonal = FORGOTTEN * deviation;
            }
        }
        // What rates had in common with these.
        for (rate, row) in root.iter_mut().enumerate().skip(LATENTS) {
            let mut variance = 0.0;
            for number in row.iter_mut().take(LATENTS).skip(RATES) {
                variance += *number * *number;
                *number = 0.0;
            }
            if let Some(diagonal) = row.get_mut(rate) {
                *diagonal = sqrt(*diagonal * *diagonal + variance);
            }
        }
    }

    /// Keeps latents in their ranges.
    pub(super) fn keep_in_range(&self, mean: &mut Vector) {
        for (latent, [least, most]) in mean.iter_mut().zip(self.range) {
            *latent = latent.max(least).min(most);
        }
    }
}

/// What a transition makes of a value and its rate, about the `centre`.
fn moved([value, rate]: [f32; 2], centre: f32, [[a, b], [c, d]]: [[f32; 2]; 2]) -> [f32; 2] {
    let value = value - centre;
    [centre + a * value + b * rate, c * value + d * rate]
}

/// What value and rate become of both after a time.
fn transition(rate: f32, dt_s: f32) -> [[f32; 2]; 2] {
    let turns = rate * dt_s;
    let fade = if turns > 0.0 { exp(-turns) } else { 1.0 / exp(turns) };
    [[fade * (1.0 + turns), fade * dt_s], [-fade * rate * turns, fade * (1.0 - turns)]]
}

/// Variance of the value, covariance, and variance of the rate that a time adds.
fn spread(rate: f32, deviation: f32, dt_s: f32) -> [f32; 3] {
    /// Below it, a series is more accurate than the difference.
    const SHORT: f32 = 0.3;
    let (u, variance) = (rate * dt_s, deviation * deviation);
    let faded = exp(-2.0 * u);
    let of_both = 2.0 * variance * rate * u * u * faded;
    if u > SHORT {
        let of_value = variance * (1.0 - faded * (1.0 + 2.0 * u + 2.0 * u * u));
        let of_speed = variance * rate * rate * (1.0 - faded * (1.0 - 2.0 * u + 2.0 * u * u));
        return [of_value, of_both, of_speed];
    }
    let of_value = 4.0 / 3.0 * variance * u * u * u * (1.0 - 1.5 * u + 1.2 * u * u);
    let of_speed = 4.0 * variance * rate * rate * u * (1.0 - 2.0 * u + 2.0 * u * u);
    [of_value, of_both, of_speed]
}

//! Recursive least squares in f32 against f64, through what a sensor does over months.

use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::rls::{self, Real, Rls};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const FORGETTING: Promise = Promise {
    name: "rls-forgetting",
    text: "λ < 1: f32 as f64 for ever; at rest: there",
    share: 4,
    check: forgetting,
};

pub const WITHOUT_FORGETTING: Promise = Promise {
    name: "rls-lambda-1",
    text: "λ = 1: f32 as f64, for up to 1e7 updates",
    share: 1,
    check: without_forgetting,
};

/// Gaussians on a line, and the bias.
pub const REGRESSORS: usize = 9;
/// Standard deviation of the targets' noise.
pub const NOISE: f64 = 0.05;
/// Updates of a case in the short form, and in the whole one: 28 hours at 100 Hz.
const UPDATES: [u64; 2] = [20_000, 10_000_000];
/// Places at which predictions are compared.
const PLACES: [f64; 11] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
/// Moments at which weights are looked at.
const LOOKS: u64 = 20;
/// Weights above this have grown without end: the true function is within ±1, and its weights within ±20.
const MOST_WEIGHT: f64 = 1e5;

/// What a sensor does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Life {
    /// Every place is pressed again and again.
    Rich,
    /// After a while at work it rests for good.
    Rest,
    /// It rests, and is pressed once in a hundred times.
    Burst,
    /// One in a hundred samples holds NaN or ∞.
    Missing,
    /// One in a hundred samples holds 1e20.
    Huge,
}

const LIVES: [Life; 5] = [Life::Rich, Life::Rest, Life::Burst, Life::Missing, Life::Huge];
const FACTORS: [f64; 4] = [0.9, 0.99, 0.999, 0.9999];

fn forgetting(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let (least, updates) = ((LIVES.len() * FACTORS.len()) as u64, updates(effort));
    Ok(effort.worst((least, 10 * least), (1.0, "noise"), |seed| {
        let life = LIVES[(seed % 5) as usize];
        let factor = FACTORS[(seed / 5 % 4) as usize];
        let worst = compare(life, factor, seed, updates);
        worst.map_err(|why| format!("{life:?}, λ = {factor}: {why}"))
    }))
}

fn without_forgetting(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let lives = [Life::Rich, Life::Missing, Life::Huge];
    let updates = updates(effort);
    Ok(effort.worst((3, 30), (2.0, "noise"), |seed| {
        let life = lives[(seed % 3) as usize];
        compare(life, 1.0, seed, updates).map_err(|why| format!("{life:?}: {why}"))
    }))
}

/// Number of updates of every case: few if there is no time beyond that for the least number of cases.
fn updates(effort: &Effort) -> u64 {
    if effort.is_over() { UPDATES[0] } else { UPDATES[1] }
}

/// Root mean square difference of what f32 and f64 predict, in units of the noise, at its worst over time.
fn compare(life: Life, factor: f64, seed: u64, updates: u64) -> Result<f64, String> {
    let single = over_time::<f32>(life, factor, seed, updates)?;
    let double = over_time::<f64>(life, factor, seed, updates)?;
    // A sensor that rests for good forgets all other places, and f32 need not forget as f64 does.
    let places: &[f64] = if life == Life::Rest { &[0.5] } else { &PLACES };
    let off = single.iter().zip(&double);
    let off = off.map(|(one, other)| difference(one, other, places) / NOISE);
    Ok(off.fold(0.0, f64::max))
}

/// A number that the recursion works in.
pub trait Number: Real {
    fn of(value: f64) -> Self;
    fn value(self) -> f64;
}

impl Number for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
}

impl Number for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
}

/// Weights at [`LOOKS`] moments.
pub fn over_time<T: Number>(
    life: Life,
    factor: f64,
    seed: u64,
    updates: u64,
) -> Result<Vec<Vec<f64>>, String> {
    let started = Rls::new([REGRESSORS, 1], T::of(1e6), T::of(factor));
    let mut recursion = started.map_err(|refusal| refusal.to_string())?;
    let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
    let mut all = Vec::new();
    for update in 1..=updates {
        let (h, y) = sample(life, update, &mut random);
        // What f32 refuses is kept from f64, too, which could take it.
        let is_usable = rls::is_usable(&h.map(|h| h as f32)) && rls::is_usable(&[y as f32]);
        let (mut h, mut y) = (h.map(T::of), [T::of(y)]);
        if size_of::<T>() == 4 || is_usable {
            let refused = recursion.update(&mut h, &mut y).is_err();
            if refused == is_usable {
                return Err(format!("update {update}: is refused: {refused}, usable: {is_usable}"));
            }
        }
        if update.is_multiple_of((updates / LOOKS).max(1)) {
            let weights: Vec<f64> = recursion.weights().into_iter().map(T::value).collect();
            if let Some(weight) = weights.iter().find(|w| w.is_nan() || w.abs() > MOST_WEIGHT) {
                return Err(format!("a weight is {weight:e} after {update} updates"));
            }
            all.push(weights);
        }
    }
    Ok(all)
}

/// Sample number `update`: regressors, and the target with noise.
pub fn sample(life: Life, update: u64, random: &mut Random) -> ([f64; REGRESSORS], f64) {
    let place = random.unit();
    let rests = match life {
        Life::Rest => update > 2000,
        Life::Burst => !update.is_multiple_of(100),
        _ => false,
    };
    let x = if rests { 0.5 } else { place };
    let mut h = regressors(x);
    let mut y = (6.0 * x).sin() + NOISE * random.normal();
    if update.is_multiple_of(100) {
        let which = random.below(REGRESSORS);
        match life {
            Life::Missing if which == 0 => y = f64::NAN,
            Life::Missing => {
                h[which] = if which.is_multiple_of(2) { f64::NAN } else { f64::INFINITY }
            }
            Life::Huge if which == 0 => y = 1e20,
            Life::Huge => h[which] = 1e20,
            _ => {}
        }
    }
    (h, y)
}

/// Gaussians at the place `x` from 0 to 1, and 1.
pub fn regressors(x: f64) -> [f64; REGRESSORS] {
    let mut h = [1.0; REGRESSORS];
    for (k, h) in h.iter_mut().take(REGRESSORS - 1).enumerate() {
        let from_centre = x - k as f64 / (REGRESSORS - 2) as f64;
        *h = (-from_centre * from_centre / (2.0 * 0.15 * 0.15)).exp();
    }
    h
}

/// Root mean square difference of two weights' predictions at `places`.
fn difference(one: &[f64], other: &[f64], places: &[f64]) -> f64 {
    let squares = places.iter().map(|place| {
        let h = regressors(*place);
        let off: f64 = h.iter().zip(one.iter().zip(other)).map(|(h, (a, b))| h * (a - b)).sum();
        off * off
    });
    (squares.sum::<f64>() / places.len() as f64).sqrt()
}

//! Recursive least squares in f32 and f64 through what a sensor does, against batch least squares of the same samples.

use taxel_data::{Purpose, Random, Stream};
use taxel_learn::rls::{Real, Rls};
use taxel_learn::train::least_squares::Factor;

use super::least_squares::Dense;
use crate::table::hold;

/// Gaussians on a line, and the bias. With their width the condition of the squares is beyond f64, where recursions of
/// the covariance diverge.
const REGRESSORS: usize = 17;
const WIDTH: f64 = 0.3;
/// Standard deviation of the targets' noise.
const NOISE: f64 = 0.05;
const UPDATES: usize = 20_000;

/// What a sensor does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Life {
    /// Every place is pressed again and again.
    Rich,
    /// After a while at work it rests for good.
    Rest,
    /// It rests, and is pressed once in a hundred times.
    Burst,
    /// One in a hundred samples holds NaN, an infinity or 1e20, which no number format takes.
    Unusable,
}

const LIVES: [Life; 4] = [Life::Rich, Life::Rest, Life::Burst, Life::Unusable];
const FORGETTING_FACTORS: [f64; 4] = [0.9, 0.99, 0.999, 1.0];
const COVARIANCES: [f64; 3] = [1e2, 1e4, 1e6];
const CASES: u64 = (LIVES.len() * FORGETTING_FACTORS.len() * COVARIANCES.len()) as u64;

/// A number that the recursion works in.
trait Number: Real + Into<f64> {
    fn of(value: f64) -> Self;
}

impl Number for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }
}

impl Number for f64 {
    fn of(value: f64) -> Self {
        value
    }
}

#[test]
fn the_recursion_in_f32_predicts_as_batch_least_squares_within_the_noise() {
    hold("recursion-f32", 1.0, CASES, |seed| Some(off::<f32>(seed)));
}

#[test]
fn the_recursion_in_f64_predicts_as_batch_least_squares() {
    hold("recursion-f64", 0.001, CASES, |seed| Some(off::<f64>(seed)));
}

/// Root mean square difference of what recursion and batch predict, in deviations of the noise.
fn off<T: Number>(seed: u64) -> f64 {
    let which = |count: usize, step: usize| seed as usize / step % count;
    let life = LIVES[which(LIVES.len(), 1)];
    let factor = FORGETTING_FACTORS[which(FORGETTING_FACTORS.len(), LIVES.len())];
    let covariance = COVARIANCES[which(COVARIANCES.len(), LIVES.len() * FORGETTING_FACTORS.len())];
    let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
    let mut recursion = Rls::new([REGRESSORS, 1], T::of(covariance), T::of(factor)).unwrap();
    let (mut design, mut targets) = (Dense { columns: REGRESSORS, values: vec![] }, vec![]);
    for update in 0..UPDATES {
        let (h, y) = sample(life, update, &mut random);
        let is_usable = h.iter().chain([&y]).all(|value| value.abs() <= f32::LARGEST.into());
        // Forgotten is as much as the recursion forgets by the end.
        let root = factor.powf((UPDATES - 1 - update) as f64 / 2.0);
        if is_usable {
            design.values.extend(h.map(|h| root * h));
            targets.push(root * y);
        }
        if is_usable || size_of::<T>() == size_of::<f32>() {
            let taken = recursion.update(&mut h.map(T::of), &mut [T::of(y)]).is_ok();
            assert_eq!(taken, is_usable, "{life:?}, update {update}");
        }
    }
    let weights = recursion.weights();
    let batch = Factor::new(&design, &targets, 1, covariance).weights();
    // A sensor that rests for good forgets all other places, and f32 need not forget as f64 does.
    let places = if life == Life::Rest && factor < 1.0 { 5..=5 } else { 0..=10 };
    let count = places.clone().count() as f64;
    let squares = places.map(|place| {
        let weights = weights.iter().zip(&batch).map(|(own, batch)| (*own).into() - batch);
        regressors(f64::from(place) / 10.0)
            .iter()
            .zip(weights)
            .map(|(h, w)| h * w)
            .sum::<f64>()
            .powi(2)
    });
    (squares.sum::<f64>() / count).sqrt() / NOISE
}

/// Sample number `update`: regressors, and the target with noise.
fn sample(life: Life, update: usize, random: &mut Random) -> ([f64; REGRESSORS], f64) {
    let place = random.unit();
    let rests = match life {
        Life::Rest => update > 2000,
        Life::Burst => !update.is_multiple_of(100),
        _ => false,
    };
    let x = if rests { 0.5 } else { place };
    let (mut h, mut y) = (regressors(x), (6.0 * x).sin() + NOISE * random.normal());
    if life == Life::Unusable && update.is_multiple_of(100) {
        let bad = [f64::NAN, f64::INFINITY, 1e20][random.below(3)];
        *[&mut h[random.below(REGRESSORS)], &mut y][random.below(2)] = bad;
    }
    (h, y)
}

/// Gaussians at the place `x` from 0 to 1, and 1.
fn regressors(x: f64) -> [f64; REGRESSORS] {
    std::array::from_fn(|k| {
        let from_centre = x - k as f64 / (REGRESSORS - 2) as f64;
        if k + 1 == REGRESSORS { 1.0 } else { (-(from_centre / WIDTH).powi(2) / 2.0).exp() }
    })
}

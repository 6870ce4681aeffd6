//! Recursive least squares through what a sensor does, against ridge regression.

use taxel_data::{Purpose, Random, Stream};
use taxel_learn::rls::{LARGEST, Rls};
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
    /// One in a hundred samples holds NaN, an infinity or 1e200, whose square is none.
    Unusable,
}

const LIVES: [Life; 4] = [Life::Rich, Life::Rest, Life::Burst, Life::Unusable];
const COVARIANCES: [f64; 3] = [1e2, 1e4, 1e6];
/// Places at which predictions are compared.
const PLACES: [f64; 11] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];

/// Samples that the recursion takes, weights that it ends with.
struct Run {
    design: Dense,
    targets: Vec<f64>,
    weights: Vec<f64>,
}

#[test]
fn recursion_without_forgetting_predicts_as_ridge_regression() {
    let cases = LIVES.len() * COVARIANCES.len();
    hold("recursion", 1.0, cases as u64, |seed| {
        let life = LIVES[seed as usize % LIVES.len()];
        let covariance = COVARIANCES[seed as usize / LIVES.len() % COVARIANCES.len()];
        let Run { design, targets, weights } = run(life, covariance, seed);
        let batch = Factor::new(&design, &targets, 1, covariance).weights();
        Some(difference(&weights, &batch) / 1e-6)
    });
}

fn run(life: Life, covariance: f64, seed: u64) -> Run {
    let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
    let mut recursion = Rls::new([REGRESSORS, 1], covariance, 1.0).unwrap();
    let (mut design, mut targets) = (Dense { columns: REGRESSORS, values: vec![] }, vec![]);
    for update in 0..UPDATES {
        let (h, y) = sample(life, update, &mut random);
        let is_usable = h.iter().chain([&y]).all(|value| value.abs() <= LARGEST);
        if is_usable {
            design.values.extend(h);
            targets.push(y);
        }
        let taken = recursion.update(&mut h.to_vec(), &mut [y]).is_ok();
        assert_eq!(taken, is_usable, "{life:?}, update {update}");
    }
    Run { design, targets, weights: recursion.weights() }
}

/// Root mean square difference of what two weights predict, in deviations of the noise.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    let square = |place: &f64| {
        let weights = one.iter().zip(other).map(|(one, other)| one - other);
        regressors(*place).iter().zip(weights).map(|(h, w)| h * w).sum::<f64>().powi(2)
    };
    (PLACES.iter().map(square).sum::<f64>() / PLACES.len() as f64).sqrt() / NOISE
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
        let bad = [f64::NAN, f64::INFINITY, 1e200][random.below(3)];
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

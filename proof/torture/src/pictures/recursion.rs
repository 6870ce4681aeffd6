//! Error of recursive least squares against the number of updates, for each form of it.

use model_core::rls::{self, Rls};
use taxel_data::random::{Purpose, Random, Stream};

use super::chart::{Chart, Line};
use crate::promises::rls::{Life, Number, REGRESSORS, regressors, sample};

const UPDATES: u64 = 1_000_000;
const FACTOR: f64 = 0.999;

/// Picture of a sensor that works for 2000 updates and rests from then on.
pub fn draw() -> String {
    let line =
        |name, colour, dashed, points| Line { name, colour, dashed, points, crosses: vec![] };
    let covariance = |name, colour, dashed, (points, ended): (Vec<[f64; 2]>, bool)| {
        let crosses = points.last().copied().filter(|_| ended).into_iter().collect();
        Line { name, colour, dashed, points, crosses }
    };
    let chart = Chart {
        title: "Error of recursive least squares against updates: work, and rest from 2000 on",
        x_label: "updates; f64 is dashed; beyond a cross there is NaN; errors above 1e6 are drawn at 1e6",
        y_label: "error of what is predicted over all places; the function is within ±1",
        x: [100.0, UPDATES as f64],
        y: [1e-3, 1e6],
        steps: [1, 2],
        lines: vec![
            line("f32 with leakage, δ = 1e6", 1, false, square_root::<f32>(1e6, true)),
            line("f32 with leakage, δ = 1e3", 3, false, square_root::<f32>(1e3, true)),
            line("f64 with leakage, δ = 1e6", 1, true, square_root::<f64>(1e6, true)),
            line("f32 without leakage", 2, false, square_root::<f32>(1e6, false)),
            line("f64 without leakage", 2, true, square_root::<f64>(1e6, false)),
            covariance("f32 covariance form", 4, false, by_covariance::<f32>()),
            covariance("f64 covariance form", 4, true, by_covariance::<f64>()),
        ],
    };
    chart.draw()
}

/// Updates after which the error is looked at: twelve for each power of ten.
fn is_looked_at(update: u64) -> bool {
    let step = |update: u64| (12.0 * (update as f64).log10()).floor();
    update >= 100 && (update == UPDATES || step(update) > step(update - 1))
}

/// Root mean square error of the prediction over all places, against the function itself.
fn error<T: Number>(weights: &[T]) -> f64 {
    let squares = (0..=50).map(|step| {
        let x = f64::from(step) / 50.0;
        let predicted: f64 = regressors(x).iter().zip(weights).map(|(h, w)| h * (*w).value()).sum();
        (predicted - (6.0 * x).sin()).powi(2)
    });
    (squares.sum::<f64>() / 51.0).sqrt()
}

/// The square-root form from initial covariance δ, with leakage or without.
fn square_root<T: Number>(delta: f64, leaks: bool) -> Vec<[f64; 2]> {
    let mut memory = [T::ZERO; Rls::<f64>::values(REGRESSORS, 1)];
    let mut plain = [T::ZERO; Rls::<f64>::values(REGRESSORS, 1)];
    let (triangle, rest) = plain.split_at_mut(rls::triangle_values(REGRESSORS));
    let projection = &mut rest[..REGRESSORS];
    rls::start(triangle, REGRESSORS, T::of(1.0 / delta.sqrt()));
    let Ok(mut recursion) = Rls::try_new(&mut memory, [REGRESSORS, 1], T::of(delta), T::of(FACTOR))
    else {
        return vec![];
    };
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let mut points = Vec::new();
    for update in 1..=UPDATES {
        let (h, y) = sample(Life::Rest, update, &mut random);
        let (mut h, mut y) = (h.map(T::of), [T::of(y)]);
        let mut weights = [T::ZERO; REGRESSORS];
        if leaks {
            // Every sample is usable.
            let _ = recursion.update(&mut h, &mut y);
            recursion.weights(&mut weights);
        } else {
            rls::forget(triangle, projection, T::of(FACTOR.sqrt()));
            rls::rotate(triangle, projection, &mut h, &mut y);
            rls::solve_triangle(triangle, projection, REGRESSORS, &mut weights);
        }
        if is_looked_at(update) {
            points.push([update as f64, error(&weights)]);
        }
    }
    points
}

/// The textbook's form, which updates the covariance P; and whether it ended in NaN.
fn by_covariance<T: Number>() -> (Vec<[f64; 2]>, bool) {
    let mut p = [[T::ZERO; REGRESSORS]; REGRESSORS];
    (0..REGRESSORS).for_each(|i| p[i][i] = T::of(1e6));
    let mut weights = [T::ZERO; REGRESSORS];
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let mut points = Vec::new();
    let factor = T::of(FACTOR);
    let dot = |a: &[T; REGRESSORS], b: &[T; REGRESSORS]| {
        a.iter().zip(b).fold(T::ZERO, |sum, (a, b)| sum + *a * *b)
    };
    for update in 1..=UPDATES {
        let (h, y) = sample(Life::Rest, update, &mut random);
        let h = h.map(T::of);
        let along = p.map(|line| dot(&line, &h));
        let scale = factor + dot(&along, &h);
        let innovation = T::of(y) - dot(&weights, &h);
        for i in 0..REGRESSORS {
            weights[i] = weights[i] + along[i] / scale * innovation;
            for j in 0..REGRESSORS {
                p[i][j] = (p[i][j] - along[i] * along[j] / scale) / factor;
            }
        }
        if is_looked_at(update) {
            let error = error(&weights);
            if !error.is_finite() {
                return (points, true);
            }
            points.push([update as f64, error]);
        }
    }
    (points, false)
}

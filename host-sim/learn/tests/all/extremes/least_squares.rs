//! Least squares of ill-conditioned matrices, judged by residual ratios as LAPACK's tests have them.
//!
//! Weights minimise ‖y − H·w‖² + ‖w‖²/δ where the gradient Hᵀ(y − H·w) − w/δ is zero. A stable method leaves a gradient
//! of a few rounding errors of what it is made of, whatever the condition of H. LAPACK's tests allow 30, here it is 1.

use std::ops::Range;

use taxel_data::{Purpose, Random, Stream};
use taxel_learn::train::least_squares::{Design, Factor};

use crate::table::hold;

/// Matrix with its rows one after the other.
pub struct Dense {
    pub columns: usize,
    pub values: Vec<f64>,
}

impl Design for Dense {
    fn regressors(&self) -> usize {
        self.columns
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        values.copy_from_slice(
            &self.values[samples.start * self.columns..samples.end * self.columns],
        );
    }
}

/// Kinds of matrices, as LAPACK's testers have them: singular values that fall steadily, one that is small, Hilbert's
/// matrix, powers, rows or columns of any size, equal columns, and entries near the ends of f64.
const KINDS: u64 = 9;

#[test]
fn weights_are_stationary_but_for_rounding_at_any_condition() {
    hold("least-squares", 1.0, 17 * KINDS, |seed| {
        // Every kind meets every power of ten.
        let condition = 10_f64.powi((seed / KINDS % 17) as i32);
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let (columns, rows) = (2 + random.below(30), 40 + random.below(200));
        let (design, scale) = matrix(seed % KINDS, condition, [rows, columns], &mut random);
        let targets: Vec<f64> = (0..rows).map(|_| scale * random.normal()).collect();
        let covariance = 10_f64.powf(random.between([2.0, 25.0])) / (scale * scale);
        let weights = Factor::new(&design, &targets, 1, covariance).weights();
        Some(ratio(&design, &targets, covariance, &weights))
    });
}

/// Matrix of a kind, and the size of its entries.
fn matrix(
    kind: u64,
    condition: f64,
    [rows, columns]: [usize; 2],
    random: &mut Random,
) -> (Dense, f64) {
    let share = |place: usize, count: usize| place as f64 / (count - 1) as f64;
    let mut values = vec![0.0; rows * columns];
    for column in 0..columns {
        let is_last = column + 1 == columns;
        values[column * (columns + 1)] = match kind {
            1 => {
                if is_last {
                    condition.recip()
                } else {
                    1.0
                }
            }
            _ => condition.powf(-share(column, columns)),
        };
    }
    for _ in 0..2 {
        reflect(&mut values, [rows, columns], random);
    }
    let scale = match kind {
        7 => 1e120,
        8 => 1e-120,
        _ => 1.0,
    };
    for (place, value) in values.iter_mut().enumerate() {
        let (row, column) = (place / columns, place % columns);
        *value = scale
            * match kind {
                2 => 1.0 / (1.0 + (row + column) as f64),
                3 => share(row, rows).powf(column as f64),
                4 => *value * condition.powf(-share(row, rows)),
                5 => *value * condition.powf(share(column, columns)),
                _ => *value,
            };
    }
    if kind == 6 {
        values.chunks_exact_mut(columns).for_each(|line| line[columns - 1] = line[0]);
    }
    (Dense { columns, values }, scale)
}

/// Reflects a matrix from both sides at random: singular values stay.
fn reflect(values: &mut [f64], [rows, columns]: [usize; 2], random: &mut Random) {
    let [left, right] = [rows, columns].map(|count| {
        let v: Vec<f64> = (0..count).map(|_| random.normal()).collect();
        let norm = norm(&v);
        v.into_iter().map(|v| v / norm).collect::<Vec<f64>>()
    });
    for column in 0..columns {
        let along: f64 =
            left.iter().zip(values.iter().skip(column).step_by(columns)).map(|(a, b)| a * b).sum();
        let lines = values.iter_mut().skip(column).step_by(columns);
        lines.zip(&left).for_each(|(value, left)| *value -= 2.0 * along * left);
    }
    for line in values.chunks_exact_mut(columns) {
        let along: f64 = line.iter().zip(&right).map(|(a, b)| a * b).sum();
        line.iter_mut().zip(&right).for_each(|(a, b)| *a -= 2.0 * along * b);
    }
}

/// Gradient at `weights`, in rounding errors of what it is made of.
fn ratio(design: &Dense, targets: &[f64], covariance: f64, weights: &[f64]) -> f64 {
    let lines = || design.values.chunks_exact(design.columns);
    let dot = |line: &[f64]| line.iter().zip(weights).map(|(h, w)| h * w).sum::<f64>();
    let left: Vec<f64> = lines().zip(targets).map(|(line, y)| y - dot(line)).collect();
    let gradient = (0..design.columns).map(|j| {
        let along: f64 = lines().zip(&left).map(|(line, r)| line[j] * r).sum();
        along - weights[j] / covariance
    });
    let gradient = norm(&gradient.collect::<Vec<f64>>());
    let scale = norm(&design.values) * (norm(&left) + norm(&design.values) * norm(weights))
        + norm(weights) / covariance;
    gradient / (scale * f64::EPSILON * targets.len() as f64)
}

/// Root of the sum of squares, each of which may be beyond f64.
fn norm(values: &[f64]) -> f64 {
    let largest = values.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()));
    largest * values.iter().map(|v| (v / largest).powi(2)).sum::<f64>().sqrt()
}

//! Least squares of the trainer, by residual ratios as LAPACK's tests have them.
//!
//! Weights minimise ‖y − H·w‖² + ‖w‖²/δ where the gradient Hᵀ(y − H·w) − w/δ is zero. A stable method leaves a gradient
//! of a few rounding errors of what it is made of, whatever the condition of H. LAPACK's tests allow 30; here it is 1.

use std::ops::Range;

use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::train::least_squares::{Design, Factor};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const RESIDUAL: Promise = Promise {
    name: "least-squares",
    text: "gradient of rounding alone, condition 1 to 1e16",
    share: 2,
    check: residual,
};

/// Largest ratio.
const THRESHOLD: f64 = 1.0;

/// Kinds of matrices, as LAPACK's testers have them.
const KINDS: [&str; 10] = [
    "geometric",
    "one-small",
    "hilbert",
    "vandermonde",
    "graded-rows",
    "graded-columns",
    "läuchli",
    "duplicates",
    "near-overflow",
    "near-underflow",
];

/// Matrix with its rows one after the other.
struct Dense {
    columns: usize,
    values: Vec<f64>,
}

impl Design for Dense {
    fn regressors(&self) -> usize {
        self.columns
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let of = samples.start * self.columns..samples.end * self.columns;
        values.copy_from_slice(&self.values[of]);
    }
}

fn residual(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let least = 17 * KINDS.len() as u64;
    Ok(effort.worst((least, 100_000), (THRESHOLD, "ratio"), |seed| {
        let kind = KINDS[(seed % KINDS.len() as u64) as usize];
        // Every kind meets every power of ten.
        let condition = 10_f64.powi((seed / KINDS.len() as u64 % 17) as i32);
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let (columns, rows) = (2 + random.below(30), 40 + random.below(200));
        let (design, scale) = matrix(kind, condition, [rows, columns], &mut random);
        let targets: Vec<f64> = (0..rows).map(|_| scale * random.normal()).collect();
        let covariance = 10_f64.powf(random.between([2.0, 25.0])) / (scale * scale);
        let weights = Factor::new(&design, &targets, 1, covariance).weights();
        let ratio = ratio(&design, &targets, covariance, &weights);
        let refused =
            || Err(format!("{kind}, condition {condition:e}, {rows} × {columns}: {ratio:e}"));
        if ratio.is_finite() { Ok(ratio) } else { refused() }
    }))
}

/// Matrix of a kind, and the size of its entries.
fn matrix(
    kind: &str,
    condition: f64,
    [rows, columns]: [usize; 2],
    random: &mut Random,
) -> (Dense, f64) {
    let share = |j: usize, count: usize| j as f64 / (count - 1) as f64;
    let mut scale = 1.0;
    let mut values = match kind {
        "hilbert" => (0..rows * columns)
            .map(|at| 1.0 / (1.0 + (at / columns) as f64 + (at % columns) as f64))
            .collect(),
        "vandermonde" => (0..rows * columns)
            .map(|at| share(at / columns, rows).powf((at % columns) as f64))
            .collect(),
        "läuchli" => (0..rows * columns)
            .map(|at| match at / columns {
                0 => 1.0,
                row if row == at % columns + 1 => condition.sqrt().recip(),
                _ => 0.0,
            })
            .collect(),
        "one-small" => {
            let singular = |j: usize| if j + 1 == columns { 1.0 / condition } else { 1.0 };
            of_singular_values(singular, [rows, columns], random)
        }
        _ => {
            let singular = |j: usize| condition.powf(-share(j, columns));
            of_singular_values(singular, [rows, columns], random)
        }
    };
    let at = |values: &mut Vec<f64>, factor: &dyn Fn(usize, usize) -> f64| {
        for (place, value) in values.iter_mut().enumerate() {
            *value *= factor(place / columns, place % columns);
        }
    };
    match kind {
        "graded-rows" => at(&mut values, &|row, _| condition.powf(-share(row, rows))),
        "graded-columns" => at(&mut values, &|_, column| condition.powf(share(column, columns))),
        "duplicates" => {
            for line in values.chunks_exact_mut(columns) {
                line[columns - 1] = line[0];
            }
        }
        "near-overflow" => scale = 1e120,
        "near-underflow" => scale = 1e-120,
        _ => {}
    }
    at(&mut values, &|_, _| scale);
    (Dense { columns, values }, scale)
}

/// Matrix U·Σ·Vᵀ with singular values as given, and U and V of random reflections.
fn of_singular_values(
    singular: impl Fn(usize) -> f64,
    [rows, columns]: [usize; 2],
    random: &mut Random,
) -> Vec<f64> {
    let mut values = vec![0.0; rows * columns];
    (0..columns).for_each(|j| values[j * columns + j] = singular(j));
    for _ in 0..2 {
        let mut unit = |count: usize| {
            let v: Vec<f64> = (0..count).map(|_| random.normal()).collect();
            let norm = norm(v.iter().copied());
            v.into_iter().map(|v| v / norm).collect::<Vec<f64>>()
        };
        let (left, right) = (unit(rows), unit(columns));
        for j in 0..columns {
            let along: f64 = (0..rows).map(|i| left[i] * values[i * columns + j]).sum();
            (0..rows).for_each(|i| values[i * columns + j] -= 2.0 * along * left[i]);
        }
        for line in values.chunks_exact_mut(columns) {
            let along: f64 = line.iter().zip(&right).map(|(a, b)| a * b).sum();
            line.iter_mut().zip(&right).for_each(|(a, b)| *a -= 2.0 * along * b);
        }
    }
    values
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
    let gradient = norm(gradient);
    let [of_design, of_left] = [norm(design.values.iter().copied()), norm(left.iter().copied())];
    let of_weights = norm(weights.iter().copied());
    let scale = of_design * (of_left + of_design * of_weights) + of_weights / covariance;
    gradient / (scale * f64::EPSILON * targets.len() as f64)
}

/// Root of the sum of squares, which may be beyond f64.
fn norm(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let largest = values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * values.iter().map(|v| (v / largest).powi(2)).sum::<f64>().sqrt()
}

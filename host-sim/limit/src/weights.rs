//! Importance weights: their effective number, and tempering.

use taxel_data::{exp, widest};

/// Weights proportional to the exponentials of `logarithms`, with a sum of 1; all 0 if no logarithm is finite.
pub fn normalised(logarithms: &[f64]) -> Vec<f64> {
    let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return vec![0.0; logarithms.len()];
    }
    let mut weights = logarithms.to_vec();
    widest!(weights.iter_mut().for_each(|weight| *weight = exp((*weight - most).min(0.0))));
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    weights
}

/// Logarithm of the sum of the exponentials of `logarithms`.
pub fn log_sum(logarithms: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logarithms.clone().fold(f64::NEG_INFINITY, f64::max);
    if most.is_finite() {
        most + logarithms.map(|log| (log - most).exp()).sum::<f64>().ln()
    } else {
        most
    }
}

/// Effective sample size of `weights`: (Σw)²/Σw² (Kong, 1992).
pub fn effective(weights: &[f64]) -> f64 {
    let [sum, squares] = weights.iter().fold([0.0, 0.0], |[s, q], w| [s + w, q + w * w]);
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}

/// Logarithms of the weights when the likelihood is raised to `power`; `prior` is that over the proposal.
pub fn tempered(prior: &[f64], likelihood: &[f64], power: f64) -> Vec<f64> {
    prior.iter().zip(likelihood).map(|(prior, likelihood)| prior + power * likelihood).collect()
}

/// Largest power of the likelihood, up to 1, at which at least `wanted` samples are effective.
///
/// `prior` and `likelihood` are logarithms. Where hardly any power is small enough, the result is nearly 0.
pub fn largest_power(prior: &[f64], likelihood: &[f64], wanted: f64) -> f64 {
    let is_enough =
        |power: f64| effective(&normalised(&tempered(prior, likelihood, power))) >= wanted;
    if is_enough(1.0) {
        return 1.0;
    }
    let [mut low, mut high] = [-40.0, 0.0]; // logarithms of the power
    for _ in 0..16 {
        let middle = f64::midpoint(low, high);
        *if is_enough(f64::exp(middle)) { &mut low } else { &mut high } = middle;
    }
    f64::exp(low)
}

//! Adaptive importance sampling: a population that moves from the prior to the posterior.
//!
//! Population Monte Carlo (Cappé et al., 2004) with a tempered likelihood. In each round, samples are weighted by the
//! prior times a power of the likelihood; a mixture is fitted to them, and the next samples are drawn from it. The
//! power is the largest that leaves enough effective samples. Once it is 1, samples are kept. Their weight is
//! likelihood × prior / proposal, whatever the earlier rounds did.

use nalgebra::DVector;
use taxel_data::{LANES, Lanes, Random};

use crate::maps::Maps;
use crate::mixture::Mixture;
use crate::samples::{Samples, resampled};
use crate::slopes::tops;
use crate::target::Target;
use crate::weights::{effective, largest_power, log_sum, normalised, tempered};

/// Earlier rounds whose samples are weighted again with those of the last one.
const REMEMBERED: usize = 3;

/// Logarithm of a share of the posterior below which a kind of motion is left out.
const NEGLIGIBLE_MASS: f64 = -15.0;

/// Samples of the prior from which tops of the posterior are looked for.
const STARTS: usize = 32;

/// Work that is done for one posterior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Number of samples of a round, a multiple of [`LANES`].
    pub round: usize,
    /// Effective sample size from which a proposal is fitted.
    pub fitted: f64,
    /// Effective sample size at which sampling ends.
    pub wanted: f64,
    /// Largest number of rounds of the population.
    pub rounds: usize,
    /// Largest number of rounds of draws that are solved for, where the population does not arrive. A quarter of them, if
    /// they have less than a tenth of the effective samples.
    pub solved: usize,
}

impl Effort {
    /// Effort for so many `latents`: a covariance needs several samples for each.
    pub fn new(latents: usize) -> Self {
        let round = (25 * latents * latents).max(1024).next_multiple_of(LANES);
        let fitted = (10 * latents / 3).max(10) as f64;
        Self { round, fitted, wanted: 100.0, rounds: 16, solved: 400 }
    }
}

/// Moments of a posterior.
#[derive(Debug, Clone, PartialEq)]
pub struct Moments {
    /// Effective sample size.
    pub effective: f64,
    /// Mean of each output.
    pub mean: Vec<f64>,
    /// Variance of each output.
    pub variance: Vec<f64>,
    /// Fourth central moment of each output.
    pub fourth: Vec<f64>,
}

/// Samples the posterior of each kind of motion, its `target`, from samples of its prior with their likelihoods.
///
/// The result has the latest samples at the power 1: none of a kind that the readings rule out, and too few of one whose
/// posterior stayed too thin.
pub fn sample<T: Target>(
    targets: &[T],
    priors: &[Samples],
    effort: &Effort,
    random: &mut Random,
    memory: &mut T::Memory,
) -> Vec<Samples> {
    let kinds = || targets.iter().zip(priors);
    let mut kept: Vec<Samples> =
        kinds().map(|(target, prior)| populate(target, prior, effort, random, memory)).collect();
    let mut thin = Vec::new();
    for (kind, (target, prior)) in kinds().enumerate().filter(|(kind, _)| kept[*kind].is_empty()) {
        let tops = tops(target, &starts(prior, effort, random), memory);
        thin.push((kind, Maps::new(target, tops, memory)));
    }
    let log_mass = |(kind, maps): &(usize, Maps)| priors[*kind].log_share + maps.log_mass();
    let masses = kept.iter().map(|it| log_sum(it.log_weights())).chain(thin.iter().map(log_mass));
    let least = masses.fold(f64::NEG_INFINITY, f64::max) + NEGLIGIBLE_MASS;
    thin.retain(|it| log_mass(it) >= least);
    if thin.is_empty() {
        return kept;
    }
    for round in 1..=effort.solved {
        for (kind, maps) in &thin {
            kept[*kind].append(&maps.draw(&targets[*kind], random, memory));
        }
        let found = effective(&weights(&kept));
        let is_hopeless = 4 * round >= effort.solved && 10.0 * found < effort.wanted;
        if found >= effort.wanted || is_hopeless {
            break;
        }
    }
    kept
}

/// Samples the posterior `target` by a population. None if it does not arrive: the posterior is too thin, or bent, for a
/// mixture of one shape.
fn populate<T: Target>(
    target: &T,
    prior: &Samples,
    effort: &Effort,
    random: &mut Random,
    memory: &mut T::Memory,
) -> Samples {
    let none = Samples::new(target.latents(), prior.log_share);
    let (mut population, mut kept) = (none.clone(), none.clone());
    for _ in 0..effort.rounds {
        // Samples of the prior are too far apart to be of use later.
        let from = if population.is_empty() { prior } else { &population };
        let power = largest_power(&from.log_prior, &from.log_likelihood, effort.fitted);
        let log = tempered(&from.log_prior, &from.log_likelihood, power);
        let mixture = Mixture::fit(from, &normalised(&log), random);
        let drawn = draw(target, &mixture, effort.round, random, memory);
        if power < 1.0 {
            population.append(&drawn);
            population.keep_last(REMEMBERED * effort.round);
            continue;
        }
        kept.append(&drawn);
        if effective(&weights(std::slice::from_ref(&kept))) >= effort.wanted {
            return kept;
        }
        population = kept.clone();
    }
    none
}

/// Weights of all samples, those of one kind after those of another.
pub fn weights(kinds: &[Samples]) -> Vec<f64> {
    normalised(&kinds.iter().flat_map(Samples::log_weights).collect::<Vec<_>>())
}

/// Samples of the prior near which tops of the posterior are looked for.
pub fn starts(prior: &Samples, effort: &Effort, random: &mut Random) -> Vec<DVector<f64>> {
    let power = largest_power(&prior.log_prior, &prior.log_likelihood, effort.fitted);
    let weights = normalised(&tempered(&prior.log_prior, &prior.log_likelihood, power));
    let mut numbers = resampled(&weights, STARTS, random);
    numbers.dedup();
    numbers.into_iter().map(|it| DVector::from_column_slice(prior.place(it))).collect()
}

fn draw<T: Target>(
    target: &T,
    mixture: &Mixture,
    count: usize,
    random: &mut Random,
    memory: &mut T::Memory,
) -> Samples {
    let mut samples = Samples::new(target.latents(), 0.0);
    let mut latents = vec![[0.0; LANES]; target.latents()];
    for first in (0..count).step_by(LANES) {
        mixture.draw(first, random, &mut latents);
        samples.log_prior.extend(mixture.log_prior_over_density(&latents));
        samples.log_likelihood.extend(target.log_likelihood(&latents, memory));
        for lane in 0..LANES {
            samples.places.extend(latents.iter().map(|latent| latent[lane]));
        }
    }
    samples
}

/// Posterior mean, variance and fourth moment of every output of `target`, from weighted `samples`
/// of each kind of motion.
///
/// The variance is that of the weights times n/(n − 1), with the effective sample size n.
pub fn moments<T: Target>(targets: &[T], kinds: &[Samples], memory: &mut T::Memory) -> Moments {
    let weights = weights(kinds);
    let outputs = targets[0].output_count();
    let mut sums = vec![[0.0; 2]; outputs];
    // Powers of what lies beyond a value of the posterior: fourth powers of the values themselves would cancel out.
    let (mut origins, mut powers) = (None::<Vec<f64>>, vec![[0.0; 4]; outputs]);
    let mut values = vec![[0.0; LANES]; outputs];
    let blocks = targets.iter().zip(kinds).flat_map(|(target, samples)| {
        samples.places.chunks_exact(LANES * samples.latents).map(move |it| (target, it))
    });
    for ((target, places), weights) in blocks.zip(weights.chunks_exact(LANES)) {
        if weights.iter().all(|weight| *weight < NEGLIGIBLE) {
            continue;
        }
        let mut latents: Vec<Lanes> = vec![[0.0; LANES]; target.latents()];
        for (lane, place) in places.chunks_exact(latents.len()).enumerate() {
            latents.iter_mut().zip(place).for_each(|(latent, x)| latent[lane] = *x);
        }
        target.outputs(&latents, memory, &mut values);
        let origins = origins.get_or_insert_with(|| values.iter().map(|lanes| lanes[0]).collect());
        let sums = sums.iter_mut().zip(&mut powers);
        for ((([sum, squares], powers), values), origin) in sums.zip(&values).zip(origins) {
            for (weight, value) in weights.iter().zip(values) {
                *sum += weight * value;
                *squares += weight * value * value;
                let mut term = *weight;
                for power in &mut *powers {
                    term *= value - *origin;
                    *power += term;
                }
            }
        }
    }
    let effective = effective(&weights);
    let unbiased = if effective > 1.0 { effective / (effective - 1.0) } else { f64::NAN };
    let variance = |[mean, squares]: &[f64; 2]| (squares - mean * mean).max(0.0) * unbiased;
    let fourth = |[a, b, c, d]: &[f64; 4]| d - 4.0 * a * c + 6.0 * a * a * b - 3.0 * a.powi(4);
    Moments {
        effective,
        mean: sums.iter().map(|[mean, _]| *mean).collect(),
        variance: sums.iter().map(variance).collect(),
        fourth: powers.iter().map(fourth).collect(),
    }
}

/// Share of a weight in the sum below which it is left out.
const NEGLIGIBLE: f64 = 1e-14;

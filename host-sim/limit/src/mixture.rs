//! Proposals: a mixture of Student-t kernels around weighted samples, and the prior.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::{PI, TAU};

use nalgebra::{Cholesky, DMatrix};
use taxel_data::{LANES, Lanes, Random, ln, widest};

use crate::samples::{Samples, resampled};
use crate::weights::effective;

/// Degrees of freedom of the kernels: tails heavier than the posterior's, but with a variance. It is even, which
/// makes χ² a logarithm of uniform numbers.
const FREEDOM: usize = 4;
/// Number of kernels.
const KERNELS: usize = 128;
/// Every so many draws, one is from the prior. It bounds each weight by this number times the likelihood.
const PRIOR_EVERY: usize = 16;

/// Mixture of kernels of one shape.
///
/// Kernels stand at samples that were drawn by weight. Their covariance is that of all samples, narrowed, and they
/// are moved towards the mean, so that the mixture keeps the samples' mean and covariance (West, 1993).
pub struct Mixture {
    mean: Vec<f64>,
    /// Lower triangle L of the covariance L·Lᵀ, row after row.
    shape: Vec<f64>,
    /// Inverse of L, row after row.
    whitening: Vec<f64>,
    /// Centres of the kernels on whitened latents, kernel after kernel.
    centres: Vec<f64>,
    /// Width of the kernels on whitened latents.
    width: f64,
    /// Natural logarithm of a kernel's peak density over the number of kernels.
    log_peak: f64,
}

impl Mixture {
    /// Fits a mixture to `samples` with these `weights`, whose sum is 1.
    pub fn fit(samples: &Samples, weights: &[f64], random: &mut Random) -> Self {
        let n = samples.latents;
        let lines = || samples.lines().zip(weights).filter(|(_, weight)| **weight > 0.0);
        let mut mean = vec![0.0; n];
        for (sample, weight) in lines() {
            mean.iter_mut().zip(sample).for_each(|(mean, x)| *mean += weight * x);
        }
        let mut covariance = DMatrix::zeros(n, n);
        for (sample, weight) in lines() {
            for j in 0..n {
                let off = weight * (sample[j] - mean[j]);
                for i in j..n {
                    covariance[(i, j)] += off * (sample[i] - mean[i]);
                }
            }
        }
        covariance.fill_upper_triangle_with_lower_triangle();
        // Few samples tell a covariance that is too narrow in some direction.
        covariance *= 1.0 + 2.0 * n as f64 / effective(weights).max(1.0);
        let shape = factor(&covariance);
        let inverse = shape.clone().try_inverse().unwrap_or_else(|| DMatrix::identity(n, n));
        let width = width(n);
        let by_rows = |matrix: &DMatrix<f64>| matrix.transpose().as_slice().to_vec();
        let mut mixture = Self {
            mean,
            log_peak: log_peak(n, width) - shape.diagonal().iter().map(|x| x.ln()).sum::<f64>(),
            shape: by_rows(&shape),
            whitening: by_rows(&inverse),
            centres: Vec::with_capacity(KERNELS * n),
            width,
        };
        let towards_mean = (1.0 - width * width).sqrt();
        for number in resampled(weights, KERNELS, random) {
            let whitened = mixture.whiten(samples.place(number));
            mixture.centres.extend(whitened.iter().map(|x| towards_mean * x));
        }
        mixture
    }

    fn whiten(&self, sample: &[f64]) -> Vec<f64> {
        let n = self.mean.len();
        let entry = |i: usize| {
            let row = &self.whitening[i * n..=i * n + i];
            row.iter().zip(sample).zip(&self.mean).map(|((w, x), mean)| w * (x - mean)).sum()
        };
        (0..n).map(entry).collect()
    }

    /// Draws the latents of samples `first` to `first` + [`LANES`] of a round. Kernels take turns.
    pub fn draw(&self, first: usize, random: &mut Random, latents: &mut [Lanes]) {
        let n = self.mean.len();
        let mut whitened = vec![0.0; n];
        for lane in 0..LANES {
            let number = first + lane;
            if number.is_multiple_of(PRIOR_EVERY) {
                latents.iter_mut().for_each(|latent| latent[lane] = random.normal());
                continue;
            }
            let product: f64 = (0..FREEDOM / 2).map(|_| 1.0 - random.unit()).product();
            let chi_squared = -2.0 * ln(product);
            let scale = self.width * (FREEDOM as f64 / chi_squared.max(1e-12)).sqrt();
            let kernel = number % KERNELS;
            for (x, centre) in whitened.iter_mut().zip(&self.centres[kernel * n..]) {
                *x = centre + scale * random.normal();
            }
            for (i, latent) in latents.iter_mut().enumerate() {
                let row = &self.shape[i * n..=i * n + i];
                let off: f64 = row.iter().zip(&whitened).map(|(l, x)| l * x).sum();
                latent[lane] = self.mean[i] + off;
            }
        }
    }

    /// Natural logarithm of the prior's density over the mixture's, at the `latents` of each lane.
    pub fn log_prior_over_density(&self, latents: &[Lanes]) -> Lanes {
        widest!(self.log_prior_over_density_in_lanes(latents))
    }

    #[inline(always)]
    fn log_prior_over_density_in_lanes(&self, latents: &[Lanes]) -> Lanes {
        let n = self.mean.len();
        let mut whitened = vec![[0.0; LANES]; n];
        for i in 0..n {
            for j in 0..=i {
                let (factor, mean) = (self.whitening[i * n + j], self.mean[j]);
                for lane in 0..LANES {
                    whitened[i][lane] += factor * (latents[j][lane] - mean);
                }
            }
        }
        let per_square = 1.0 / (FREEDOM as f64 * self.width * self.width);
        let mut sum = [0.0; LANES];
        for centre in self.centres.chunks_exact(n) {
            let mut far = [1.0; LANES]; // 1 + distance²/(ν·width²)
            for (x, centre) in whitened.iter().zip(centre) {
                for lane in 0..LANES {
                    let off = x[lane] - centre;
                    far[lane] += per_square * off * off;
                }
            }
            add_powers(n, &far, &mut sum);
        }
        let share = 1.0 / PRIOR_EVERY as f64;
        let mut log = [0.0; LANES];
        for lane in 0..LANES {
            let squares: f64 = latents.iter().map(|latent| latent[lane] * latent[lane]).sum();
            let log_prior = -0.5 * (squares + n as f64 * TAU.ln());
            let log_kernels = self.log_peak + sum[lane].max(f64::MIN_POSITIVE).ln();
            // −ln(share + (1 − share)·kernels/prior), whichever of the two is larger.
            let [a, b] = [share.ln(), (1.0 - share).ln() + log_kernels - log_prior];
            log[lane] = -(a.max(b) + (a.min(b) - a.max(b)).exp().ln_1p());
        }
        log
    }
}

/// Adds far^(−(ν + n)/2) to `sum`, by squaring.
#[inline(always)]
fn add_powers(n: usize, far: &Lanes, sum: &mut Lanes) {
    let mut base = [0.0; LANES];
    let mut power = [1.0; LANES];
    for lane in 0..LANES {
        base[lane] = 1.0 / far[lane];
    }
    if n % 2 == 1 {
        for lane in 0..LANES {
            power[lane] = base[lane].sqrt();
        }
    }
    let mut left = usize::midpoint(FREEDOM, n);
    while left > 0 {
        if left % 2 == 1 {
            for lane in 0..LANES {
                power[lane] *= base[lane];
            }
        }
        for lane in 0..LANES {
            base[lane] *= base[lane];
        }
        left /= 2;
    }
    for lane in 0..LANES {
        sum[lane] += power[lane];
    }
}

/// Width of kernels on `n` whitened latents, by Silverman's rule.
fn width(n: usize) -> f64 {
    let n = n as f64;
    (KERNELS as f64 * (n + 2.0) / 4.0).powf(-1.0 / (n + 4.0)).min(0.95)
}

/// Natural logarithm of the peak density of a kernel on `n` whitened latents, over the number of kernels.
fn log_peak(n: usize, width: f64) -> f64 {
    let (n, freedom) = (n as f64, FREEDOM as f64);
    libm::lgamma(0.5 * (freedom + n))
        - libm::lgamma(0.5 * freedom)
        - 0.5 * n * (freedom * PI).ln()
        - n * width.ln()
        - (KERNELS as f64).ln()
}

/// Lower triangle of a `covariance`, made slightly larger until it is positive.
fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let mut added = 1e-9 * (covariance.trace() / n as f64).max(1e-12);
    loop {
        let lifted = covariance + DMatrix::identity(n, n) * added;
        if let Some(factor) = Cholesky::new(lifted) {
            return factor.unpack();
        }
        added *= 10.0;
    }
}

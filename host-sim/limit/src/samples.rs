//! Samples of latents, with what their weights are made of.

use taxel_data::Random;

/// Samples of the latents.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Number of latents of a sample.
    pub latents: usize,
    /// Natural logarithm of the share that its kind of motion has in the prior.
    pub log_share: f64,
    /// Latents, sample after sample.
    pub places: Vec<f64>,
    /// Natural logarithm of prior over proposal, of each sample.
    pub log_prior: Vec<f64>,
    /// Natural logarithm of the likelihood, of each sample.
    pub log_likelihood: Vec<f64>,
}

impl Samples {
    /// No samples of so many `latents`, of a kind of motion with this share in the prior.
    pub fn new(latents: usize, log_share: f64) -> Self {
        let (places, log_prior, log_likelihood) = (Vec::new(), Vec::new(), Vec::new());
        Self { latents, log_share, places, log_prior, log_likelihood }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.log_prior.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.log_prior.is_empty()
    }

    /// Latents of a sample.
    pub fn place(&self, number: usize) -> &[f64] {
        &self.places[number * self.latents..][..self.latents]
    }

    /// Latents of each sample.
    pub fn lines(&self) -> impl Iterator<Item = &[f64]> {
        self.places.chunks_exact(self.latents)
    }

    /// Natural logarithms of the weights, whose sum is the mass of prior times likelihood in its kind of motion.
    pub fn log_weights(&self) -> impl Iterator<Item = f64> + Clone {
        let constant = self.log_share - (self.len() as f64).ln();
        let logs = self.log_prior.iter().zip(&self.log_likelihood);
        logs.map(move |(prior, likelihood)| constant + prior + likelihood)
    }

    /// Appends samples.
    pub fn append(&mut self, next: &Self) {
        self.places.extend(&next.places);
        self.log_prior.extend(&next.log_prior);
        self.log_likelihood.extend(&next.log_likelihood);
    }

    /// Keeps only the last `count` samples.
    pub fn keep_last(&mut self, count: usize) {
        let dropped = self.len().saturating_sub(count);
        self.places.drain(..dropped * self.latents);
        self.log_prior.drain(..dropped);
        self.log_likelihood.drain(..dropped);
    }
}

/// Numbers of `count` samples, drawn by `weights` whose sum is 1: one uniform number, then equal steps through the sum.
pub fn resampled(weights: &[f64], count: usize, random: &mut Random) -> Vec<usize> {
    let step = 1.0 / count as f64;
    let (mut sum, mut next) = (0.0, step * random.unit());
    let mut drawn = Vec::with_capacity(count);
    for (number, weight) in weights.iter().enumerate() {
        sum += weight;
        while next < sum && drawn.len() < count {
            drawn.push(number);
            next += step;
        }
    }
    let last = drawn.last().copied().unwrap_or(0);
    drawn.resize(count, last); // rounding may leave the sum below 1
    drawn
}

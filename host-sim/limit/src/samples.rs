//! Samples of latents, with what their weights are made of.

/// Samples of the latents.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Number of latents of a sample.
    pub latents: usize,
    /// Latents, sample after sample.
    pub places: Vec<f64>,
    /// Natural logarithm of prior over proposal, of each sample.
    pub log_prior: Vec<f64>,
    /// Natural logarithm of the likelihood, of each sample.
    pub log_likelihood: Vec<f64>,
}

impl Samples {
    /// No samples of so many `latents`.
    pub fn new(latents: usize) -> Self {
        Self { latents, places: Vec::new(), log_prior: Vec::new(), log_likelihood: Vec::new() }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.log_prior.len()
    }

    /// Latents of each sample.
    pub fn lines(&self) -> impl Iterator<Item = &[f64]> {
        self.places.chunks_exact(self.latents)
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

//! Interface of what is sampled: latents with a standard normal prior, a likelihood, and outputs.

use taxel_data::Lanes;

/// Posterior distribution of independent standard normal latents, given data.
pub trait Target: Sync {
    /// Working memory of one thread.
    type Memory;

    /// Number of latents.
    fn latents(&self) -> usize;

    /// Number of readings that the likelihood is of.
    fn readings(&self) -> usize;

    /// Number of outputs whose posterior mean is wanted.
    fn output_count(&self) -> usize;

    /// Natural logarithm of the data's likelihood at the `latents` of each lane, but for a constant.
    fn log_likelihood(&self, latents: &[Lanes], memory: &mut Self::Memory) -> Lanes;

    /// Writes how far each reading is off what the `latents` of each lane give, in its standard deviations. Returns the
    /// natural logarithm of the likelihood, but for a constant.
    fn residuals(
        &self,
        latents: &[Lanes],
        memory: &mut Self::Memory,
        residuals: &mut [Lanes],
    ) -> Lanes;

    /// Writes the outputs at the `latents` of each lane, one entry an output.
    fn outputs(&self, latents: &[Lanes], memory: &mut Self::Memory, outputs: &mut [Lanes]);
}

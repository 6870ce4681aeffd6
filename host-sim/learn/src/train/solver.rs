//! Solver of output weights, and the settings of the recursion.

use taxel_data::{BadValue, require};

/// How output weights are computed. Both ways give the same weights, but for rounding.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Solver {
    /// Blocked QR decomposition of all samples, which several penalties share.
    #[default]
    Qr,
    /// Recursive least squares: one sample after another.
    Rls(Recursive),
}

impl Solver {
    /// Name, as options and scenes have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Qr => "qr",
            Self::Rls(_) => "rls",
        }
    }
}

/// Settings of recursive least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recursive {
    /// Forgetting factor λ. A sample's weight is multiplied by it at each sample after it, so that 1 forgets nothing.
    pub forgetting_factor: f64,
    /// Initial covariance δ. `None` is the one that a penalty asks for, by
    /// [`Options::initial_covariance`](super::Options::initial_covariance).
    pub initial_covariance: Option<f64>,
}

impl Default for Recursive {
    fn default() -> Self {
        Self { forgetting_factor: 1.0, initial_covariance: None }
    }
}

impl Recursive {
    /// Checks both numbers.
    ///
    /// # Errors
    /// [`BadValue`] for a factor beyond 0.5 to 1, or a covariance beyond 1e-15 to 1e15.
    pub fn check(&self) -> Result<(), BadValue> {
        let factor = self.forgetting_factor;
        require((0.5..=1.0).contains(&factor), "forgetting_factor", format!("{factor:?}"), || {
            "give a number from 0.5 to 1, such as 0.9999, which remembers 10000 samples; 1 forgets nothing".into()
        })?;
        let Some(covariance) = self.initial_covariance else { return Ok(()) };
        let is_covariance = (1e-15..=1e15).contains(&covariance);
        require(is_covariance, "initial_covariance", format!("{covariance:?}"), || {
            "give a number from 1e-15 to 1e15, such as 1e6".into()
        })
    }
}

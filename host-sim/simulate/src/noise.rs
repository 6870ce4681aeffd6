//! White Gaussian noise on readings.

use serde::Deserialize;

/// White Gaussian noise on the readings, with a standard normal n for every reading of every frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Meaning of the level.
    pub kind: NoiseKind,
    /// Noise level p, as a fraction: 0.005 is 0.5 %.
    pub level: f64,
}

/// Meaning of a noise level p, for a standard normal n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// Noise relative to the reading: R·(1 + p·n).
    Relative,
    /// Noise relative to the channel's span over the scene: R + p·(maximum − minimum)·n.
    Span,
}

impl NoiseKind {
    /// Name of the kind in scenes and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Relative => "relative",
            Self::Span => "span",
        }
    }
}

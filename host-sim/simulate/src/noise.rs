//! Gaussian noise on readings: a white part, and a part with a memory.

use serde::{Deserialize, Serialize};
use taxel_data::exp;

/// Gaussian noise on the readings: a standard normal n for every reading of every frame, and first-order autoregressive
/// noise of variance 1.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Table")]
pub struct Noise {
    /// Meaning of the levels.
    pub kind: NoiseKind,
    /// Level p of the white part: a fraction (0.005 is 0.5 %), or in Ω for absolute noise.
    pub level: f64,
    /// Level of the part with a memory.
    pub correlated_level: f64,
    /// Time in ms after which the correlation of that part has fallen to 1/e.
    pub time_constant_ms: f64,
}

/// Noise as it stands in a scene, where levels in Ω have names of their own.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    kind: NoiseKind,
    level: Option<f64>,
    level_ohm: Option<f64>,
    correlated_level: Option<f64>,
    correlated_level_ohm: Option<f64>,
    #[serde(default)]
    time_constant_ms: f64,
}

impl TryFrom<Table> for Noise {
    type Error = String;

    fn try_from(table: Table) -> Result<Self, String> {
        let Table { kind, time_constant_ms, .. } = table;
        let fractions = [table.level, table.correlated_level];
        let in_ohm = [table.level_ohm, table.correlated_level_ohm];
        let (own, others) = match kind {
            NoiseKind::Absolute => (in_ohm, fractions),
            NoiseKind::Relative | NoiseKind::Span => (fractions, in_ohm),
        };
        let unit = kind.unit_of_fields();
        if others.iter().any(Option::is_some) {
            return Err(format!(
                "{} noise has level{unit} and correlated_level{unit} instead",
                kind.name()
            ));
        }
        let level = own[0].ok_or_else(|| format!("missing field `level{unit}`"))?;
        Ok(Self { kind, level, correlated_level: own[1].unwrap_or(0.0), time_constant_ms })
    }
}

impl Noise {
    /// White noise.
    pub fn white(kind: NoiseKind, level: f64) -> Self {
        Self { kind, level, correlated_level: 0.0, time_constant_ms: 0.0 }
    }

    /// Whether there is no noise.
    pub fn is_none(&self) -> bool {
        self.level == 0.0 && self.correlated_level == 0.0
    }

    /// This noise with a white part of another level.
    #[must_use]
    pub fn with_level(self, level: f64) -> Self {
        Self { level, ..self }
    }

    /// Level of both parts together: that of a single reading.
    pub fn total_level(&self) -> f64 {
        if self.correlated_level == 0.0 {
            return self.level;
        }
        (self.level * self.level + self.correlated_level * self.correlated_level).sqrt()
    }

    /// Correlation of the part with a memory after so long.
    pub fn correlation(&self, after_s: f64) -> f64 {
        if self.time_constant_ms > 0.0 {
            exp(-1000.0 * after_s / self.time_constant_ms)
        } else {
            0.0
        }
    }

    /// Noise of means of so many `samples`, one every `spacing_s`: white noise falls with the root of their number, the
    /// other part by the exact variance of such means. Its time constant is kept: a mean changes as slowly.
    #[must_use]
    pub fn averaged(self, samples: usize, spacing_s: f64) -> Self {
        let left = left_of_mean(samples, self.correlation(spacing_s));
        Self {
            level: self.level / (samples as f64).sqrt(),
            correlated_level: self.correlated_level * left.sqrt(),
            ..self
        }
    }
}

/// Share of an AR(1) variance that is left of it in the mean of so many `samples`, of which neighbours have the correlation
/// `decay`: (n + 2·Σ (n − k)·decayᵏ)/n², with k from 1 to n − 1.
fn left_of_mean(samples: usize, decay: f64) -> f64 {
    let (mut power, mut sum) = (1.0, samples as f64);
    for apart in 1..samples {
        power *= decay;
        sum += 2.0 * (samples - apart) as f64 * power;
    }
    sum / (samples as f64).powi(2)
}

/// Meaning of a noise level p, for a standard normal n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// Noise relative to the reading: R·(1 + p·n).
    Relative,
    /// Noise relative to the channel's span over the scene: R + p·(maximum − minimum)·n.
    Span,
    /// Additive noise of p in Ω, as the paper's thermal noise: R + p·n.
    Absolute,
}

impl NoiseKind {
    /// Name of the kind in scenes and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Relative => "relative",
            Self::Span => "span",
            Self::Absolute => "absolute",
        }
    }

    /// End of the names of fields that have levels of this kind, such as `noise.level_ohm`: empty for fractions.
    pub fn unit_of_fields(self) -> &'static str {
        match self {
            Self::Relative | Self::Span => "",
            Self::Absolute => "_ohm",
        }
    }

    /// Level of this kind with its unit: `0.5 %`, or `0.5 Ω`.
    pub fn in_words(self, level: f64) -> String {
        match self {
            // Rounding first, since 0.07 · 100 is not 7.
            Self::Relative | Self::Span => format!("{} %", (level * 1e8).round() / 1e6),
            Self::Absolute => format!("{level} Ω"),
        }
    }
}

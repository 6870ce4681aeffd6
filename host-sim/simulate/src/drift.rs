//! Drift of the gain between sessions: one factor for all readings of a trajectory.

use serde::Deserialize;
use taxel_data::{LANES, Lanes, Purpose};

use crate::motion::Draws;

/// Drift of the gain between sessions, such as that of temperature or of a reference voltage.
///
/// A session is a trajectory. One factor multiplies all its readings after their noise, and those of its baseline.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drift {
    /// Largest relative change: the factor is uniform on [1 − gain, 1 + gain]. 0.02 is ±2 %.
    pub gain: f64,
}

impl Drift {
    /// Draws the factors on the readings of trajectories, one a lane.
    pub(crate) fn factors(self, draws: &mut Draws) -> Lanes {
        let mut factors = [[0.0; LANES]];
        let range = [1.0 - self.gain, 1.0 + self.gain];
        draws.of(Purpose::Drift, 0).between([range], &mut factors);
        factors[0]
    }
}

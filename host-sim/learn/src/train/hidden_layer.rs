//! Gaussians of a network: centres, and widths by a rule. One for all centres, or one for each by the distance to its
//! neighbours.

use serde::{Deserialize, Serialize};
use taxel_core::rbf::Format;
use taxel_data::BadValue;

use super::squared_distance;
use crate::parallel;

/// Neighbours of a centre whose distances give its width, P.
pub const NEIGHBOURS: usize = 2;
/// Least width of a centre, over the mean width: centres that coincide would have none.
const LEAST: f64 = 1e-3;

/// Rule that gives the centres of a network their widths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Widths {
    /// The spread is the width of all centres.
    #[default]
    Common,
    /// The width of a centre is in proportion to the root mean square of its distances to the [`NEIGHBOURS`] nearest
    /// other centres, and the spread is the mean width (Moody & Darken, Neural Computation 1, 1989: P nearest
    /// neighbours).
    Neighbours,
}

impl Widths {
    /// All rules.
    pub const ALL: [Self; 2] = [Self::Common, Self::Neighbours];

    /// Name of the rule, in options and scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Common => "common",
            Self::Neighbours => "neighbours",
        }
    }

    /// What the rule does, in a few words.
    pub fn description(self) -> &'static str {
        match self {
            Self::Common => "The spread is the width of all centres",
            Self::Neighbours => {
                "In proportion to the distance to the two nearest centres; the spread is the mean. In f32-direct alone"
            }
        }
    }

    /// Widths of the `centres` (`centres × inputs`) over the spread; empty if all have the spread itself.
    pub(super) fn relative(self, centres: &[f64], inputs: usize) -> Vec<f64> {
        let count = centres.len() / inputs;
        if self == Self::Common || count < 2 {
            return Vec::new();
        }
        let distances = parallel::map(count, &|k| distance_to_neighbours(centres, inputs, k));
        let mean = distances.iter().sum::<f64>() / count as f64;
        distances
            .into_iter()
            .map(|distance| if mean > 0.0 { (distance / mean).max(LEAST) } else { 1.0 })
            .collect()
    }
}

/// Hidden layer of a network: its Gaussians.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenLayer {
    /// Centres on inputs scaled to [0, 1], `centres × inputs`.
    pub centres: Vec<f64>,
    /// Width σ of all Gaussians, on that scale; their mean width if each has its own.
    pub spread: f64,
    /// Width of each centre over the spread; empty if all have the spread itself.
    pub relative_widths: Vec<f64>,
}

impl HiddenLayer {
    /// Widths σ: one for all centres, or one for each.
    pub fn widths(&self) -> Vec<f64> {
        match self.relative_widths.as_slice() {
            [] => vec![self.spread],
            relative => relative.iter().map(|width| self.spread * width).collect(),
        }
    }

    /// Hidden layer at `centres` with these `widths`: one for all, or one for each.
    pub(super) fn with_widths(centres: Vec<f64>, widths: &[f64]) -> Self {
        if let [spread] = *widths {
            return Self { centres, spread, relative_widths: vec![] };
        }
        let spread = widths.iter().sum::<f64>() / widths.len() as f64;
        Self { centres, spread, relative_widths: widths.iter().map(|w| w / spread).collect() }
    }
}

/// Refusal of a `format` that holds one width alone.
pub(super) fn not_held(format: Format) -> BadValue {
    let rule = format!(
        "the format {} holds one width for all centres; give the format f32-direct, or {} widths",
        format.name(),
        Widths::Common.name()
    );
    BadValue::new("widths", Widths::Neighbours.name(), rule)
}

/// Root mean square of the distances from centre number `k` to the nearest other ones.
fn distance_to_neighbours(centres: &[f64], inputs: usize, k: usize) -> f64 {
    let own = &centres[k * inputs..(k + 1) * inputs];
    let others = centres.chunks_exact(inputs).enumerate().filter(|(other, _)| *other != k);
    let mut squares: Vec<f64> = others.map(|(_, centre)| squared_distance(own, centre)).collect();
    squares.sort_unstable_by(f64::total_cmp);
    squares.truncate(NEIGHBOURS);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_in_proportion_to_the_distances_of_the_nearest_centres() {
        // On a line at 0, 1, 3 and 7: root mean squares of (1, 3), (1, 2), (2, 3) and (4, 6).
        let found = Widths::Neighbours.relative(&[0.0, 1.0, 3.0, 7.0], 1);
        let expected = [5.0_f64, 2.5, 6.5, 26.0].map(f64::sqrt);
        let mean = expected.iter().sum::<f64>() / 4.0;
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected / mean).abs() < 1e-12, "{found}");
        }
        assert!((found.iter().sum::<f64>() / 4.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn centres_that_coincide_or_stand_alone_have_a_width_too() {
        assert_eq!(Widths::Neighbours.relative(&[0.3, 0.4], 2), [0.0; 0]);
        assert_eq!(Widths::Neighbours.relative(&[0.5; 8], 2), [1.0; 4]);
        let found = Widths::Neighbours.relative(&[0.0, 0.0, 0.0, 1.0], 1);
        assert_eq!(found[..3], [LEAST; 3]);
        assert_eq!(Widths::Common.relative(&[0.0, 1.0, 3.0], 1), [0.0; 0]);
    }
}

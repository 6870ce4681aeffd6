//! Candidates for selection, and what lies beyond them.

use serde::Serialize;
use taxel_data::BadValue;
use taxel_learn::Options;
use taxel_learn::train::{check_penalty, check_spread};

use super::Scored;

/// Values of each setting that selection tries, in all combinations.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidates {
    /// Numbers of centres, K.
    pub centres: Vec<usize>,
    /// Widths σ on scaled inputs.
    pub spreads: Vec<f64>,
    /// Penalties on squared weights, for each frame; `None` for the usual one.
    pub penalties: Vec<Option<f64>>,
    /// Most values that spreads are extended by, while the best one is the smallest or largest of at least two.
    /// Numbers of centres are never extended, because a device pays for them.
    pub most_spreads: usize,
    /// Most values that penalties are extended by likewise, but only to larger ones. Smaller ones hardly differ, and
    /// look best wherever a held-out frame has a twin in training.
    pub most_penalties: usize,
}

/// Setting whose best value is the smallest or largest of those tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Edge {
    /// Name of the setting in [`Options`].
    pub setting: &'static str,
    /// Best value.
    pub value: f64,
    /// Whether it is the largest; otherwise it is the smallest.
    pub largest: bool,
}

impl Candidates {
    /// Checks every candidate by itself, and each number of centres by `check`.
    pub(super) fn check(
        &self,
        check: impl Fn(Options) -> Result<(), BadValue>,
        options: &Options,
    ) -> Result<(), BadValue> {
        for &centres in &self.centres {
            check(Options { centres, ..*options })?;
        }
        self.spreads.iter().try_for_each(|spread| check_spread("spread", *spread))?;
        self.penalties.iter().flatten().try_for_each(|penalty| check_penalty(*penalty))
    }

    /// Adds one value beyond the edge that the `best` candidate is at: the spread and penalty to try next. `None` if it
    /// is at no edge, the steps are used up, or nothing lies beyond.
    pub(super) fn grow(&mut self, best: &Scored) -> Option<(f64, Option<f64>)> {
        let penalties = self.numbers();
        if self.most_penalties > 0
            && let Some(penalty) = best.penalty.and_then(|best| beyond(&penalties, best))
            && Some(penalty) > best.penalty
            && check_penalty(penalty).is_ok()
        {
            self.most_penalties -= 1;
            self.penalties.push(Some(penalty));
            return Some((best.spread, Some(penalty)));
        }
        self.most_spreads = self.most_spreads.checked_sub(1)?;
        let spread = beyond(&self.spreads, best.spread)?;
        check_spread("spread", spread).ok()?;
        self.spreads.push(spread);
        Some((spread, best.penalty))
    }

    /// Edges that the `best` candidate is at.
    pub(super) fn edges(&self, best: &Scored) -> Vec<Edge> {
        let centres: Vec<f64> = self.centres.iter().map(|k| *k as f64).collect();
        let penalties = self.numbers();
        let settings = [
            ("centres", centres.as_slice(), Some(best.centres as f64)),
            ("spread", self.spreads.as_slice(), Some(best.spread)),
            ("penalty", penalties.as_slice(), best.penalty),
        ];
        let at = |(setting, values, value): (&'static str, &[f64], Option<f64>)| {
            let (value, [low, high]) = (value?, range(values)?);
            let is_edge = value <= low || value >= high;
            is_edge.then_some(Edge { setting, value, largest: value >= high })
        };
        settings.into_iter().filter_map(at).collect()
    }

    /// Penalties that are given as numbers.
    fn numbers(&self) -> Vec<f64> {
        self.penalties.iter().flatten().copied().collect()
    }
}

/// Smallest and largest of at least two different values.
fn range(values: &[f64]) -> Option<[f64; 2]> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low < high).then_some([low, high])
}

/// Value that follows the `best` one, if that is at an edge of `values`: as many times larger or smaller as the edge is
/// than its neighbour.
fn beyond(values: &[f64], best: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    match sorted.as_slice() {
        [first, second, ..] if best <= *first => Some(first * (first / second)),
        [.., second, last] if best >= *last => Some(last * (last / second)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(most: usize) -> Candidates {
        Candidates {
            centres: vec![32, 64],
            spreads: vec![0.2, 0.4, 0.8],
            penalties: [1e-8, 1e-7, 1e-6].map(Some).to_vec(),
            most_spreads: most,
            most_penalties: most,
        }
    }

    fn best(centres: usize, spread: f64, penalty: f64) -> Scored {
        Scored { centres, spread, penalty: Some(penalty), rmse: vec![], score: 0.0 }
    }

    #[test]
    fn a_grid_grows_beyond_its_best_edge_one_value_at_a_time() {
        let mut grid = Candidates { most_spreads: 1, ..candidates(2) };
        let near = |(spread, penalty): (f64, Option<f64>), wanted: (f64, f64)| {
            let penalty = penalty.unwrap();
            assert!((spread / wanted.0 - 1.0).abs() < 1e-9, "{spread}");
            assert!((penalty / wanted.1 - 1.0).abs() < 1e-9, "{penalty}");
            penalty
        };
        let penalty = near(grid.grow(&best(32, 0.8, 1e-6)).unwrap(), (0.8, 1e-5));
        near(grid.grow(&best(32, 0.8, penalty)).unwrap(), (0.8, 1e-4));
        // The penalty is no longer at an edge, the spread is.
        near(grid.grow(&best(32, 0.8, penalty)).unwrap(), (1.6, 1e-5));
        assert_eq!(grid.grow(&best(32, 1.6, 1e-5)), None, "no step is left");
        assert_eq!(candidates(3).grow(&best(32, 0.4, 1e-7)), None, "no edge");
        assert_eq!(candidates(3).grow(&best(32, 0.4, 1e-8)), None, "no smaller penalties");
    }

    #[test]
    fn the_best_candidate_at_an_edge_is_named_and_no_other() {
        let grid = candidates(0);
        let named = |best: &Scored| -> Vec<(&str, bool)> {
            grid.edges(best).iter().map(|edge| (edge.setting, edge.largest)).collect()
        };
        assert_eq!(named(&best(64, 0.2, 1e-7)), [("centres", true), ("spread", false)]);
        assert_eq!(named(&best(32, 0.4, 1e-6)), [("centres", false), ("penalty", true)]);
        let single = Candidates { centres: vec![32], ..grid };
        assert_eq!(single.edges(&best(32, 0.4, 1e-7)), []);
    }
}

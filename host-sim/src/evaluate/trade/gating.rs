//! Points behind a gate: rows at rest are not decoded but take the outputs at rest.

use super::super::gate::{BASELINE_FRAMES, Gate, gated, share};
use crate::dataset::Table;
use crate::scene::Scene;

/// Which rows of the test frames are at rest, for every k: a matter of readings alone, whatever decodes them.
pub(super) struct Gates {
    /// The line of readings that rows at rest are answered for.
    pub baseline: Table,
    gates: Vec<AtRest>,
}

/// The rows at rest for one k.
pub(super) struct AtRest {
    /// Tolerance in standard deviations of a reading's noise.
    pub k: f64,
    /// Share of rows at rest.
    pub share: f64,
    rows: Vec<bool>,
}

impl Gates {
    /// Those of rows, or of the whole array, of `averaged`, whose noise is that of its averaged readings, for the `readings` of its test frames.
    pub fn new(averaged: &Scene, readings: &Table, k: &[f64], whole_array: bool) -> Self {
        let gate = Gate::new(averaged, BASELINE_FRAMES, whole_array);
        let at_rest = |&k: &f64| {
            let rows = gate.at_rest(readings, k * averaged.noise.level);
            AtRest { k, share: share(&rows), rows }
        };
        Self { gates: k.iter().map(at_rest).collect(), baseline: gate.baseline }
    }

    /// One for each k.
    pub fn iter(&self) -> impl Iterator<Item = &AtRest> {
        self.gates.iter()
    }
}

impl AtRest {
    /// The `estimate` of all rows, with `rest_outputs` in the places of rows at rest.
    pub fn gated(&self, estimate: &[f64], rest_outputs: &[f64]) -> Vec<f64> {
        gated(estimate, rest_outputs, &self.rows)
    }
}

//! Points behind a gate: rows at rest are not decoded but take the outputs at rest.

use taxel_data::table::Table;
use taxel_simulate::Synthesis;

use super::super::gate::{BASELINE_FRAMES, Gate, gated, share};

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
    /// Gates of rows, or of the whole array, for the `readings` of test frames with this noise level.
    pub fn new(
        frames: &Synthesis<'_>,
        noise_level: f64,
        readings: &Table,
        k: &[f64],
        whole_array: bool,
    ) -> Self {
        let gate = Gate::new(frames.clone(), BASELINE_FRAMES, whole_array);
        let at_rest = |&k: &f64| {
            let rows = gate.at_rest(readings, k * noise_level);
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

//! Points behind a gate: untouched rows are not decoded but take the outputs of the baseline.

use taxel_data::table::Table;
use taxel_simulate::Synthesis;

use super::super::gate::{BASELINE_FRAMES, Gate, gated, share};

/// Untouched rows of the test frames for every k. They depend on the readings alone, not on the decoder.
pub(super) struct Gates {
    /// Baseline: the line of readings whose outputs untouched rows take.
    pub baseline: Table,
    gates: Vec<AtRest>,
}

/// Untouched rows for one k.
pub(super) struct AtRest {
    /// Tolerance in standard deviations of a reading's noise.
    pub k: f64,
    /// Share of untouched rows.
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

    /// Untouched rows for each k.
    pub fn iter(&self) -> impl Iterator<Item = &AtRest> {
        self.gates.iter()
    }
}

impl AtRest {
    /// Estimate of all rows, with `rest_outputs` in the places of untouched rows.
    pub fn gated(&self, estimate: &[f64], rest_outputs: &[f64]) -> Vec<f64> {
        gated(estimate, rest_outputs, &self.rows)
    }
}

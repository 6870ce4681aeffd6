//! Points behind a gate: untouched rows are not decoded but take the outputs of the baseline.

use taxel_data::BadValue;
use taxel_data::dataset::Dataset;
use taxel_data::table::Table;
use taxel_learn::relative;
use taxel_simulate::Synthesis;

use super::super::gate::{BASELINE_FRAMES, Gate, Rest, gated, has_sessions, share};
use crate::measurements::Measurements;

/// Untouched rows of the test frames for every k. They depend on the readings alone, not on the decoder.
pub(super) struct Gates {
    /// Inputs of a model at rest, whose outputs untouched rows take: one line, or one for each test frame.
    pub rest_inputs: Table,
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
    /// Gates of rows, or of the whole array, for the `readings` in Ω of test frames with this noise level.
    /// `relative_inputs` tells what models take.
    pub fn new(
        frames: &Synthesis<'_>,
        noise_level: f64,
        readings: &Table,
        k: &[f64],
        (whole_array, relative_inputs): (bool, bool),
    ) -> Self {
        let sessions = has_sessions(frames.world(), relative_inputs).then_some(readings.len());
        let gate = Gate::new(frames, BASELINE_FRAMES, whole_array, sessions);
        Self::behind(gate, noise_level, readings, k, relative_inputs)
    }

    /// Gates of measured test frames with these tolerances `k`.
    pub fn measured(data: &Measurements, k: &[f64], whole_array: bool) -> Result<Self, BadValue> {
        let rest = Rest::new(data, k)?;
        let gate = Gate::at(rest.baseline, data.test.rows, whole_array);
        let relative_inputs = data.test.relative_inputs;
        Ok(Self::behind(gate, rest.noise_level, &data.test_readings, k, relative_inputs))
    }

    fn behind(
        gate: Gate,
        noise_level: f64,
        readings: &Table,
        k: &[f64],
        relative_inputs: bool,
    ) -> Self {
        let at_rest = |&k: &f64| {
            let rows = gate.at_rest(readings, k * noise_level);
            AtRest { k, share: share(&rows), rows }
        };
        let gates = k.iter().map(at_rest).collect();
        let rest_inputs = if relative_inputs {
            relative::inputs(&gate.baseline, &gate.baseline)
        } else {
            gate.baseline
        };
        Self { rest_inputs, gates }
    }

    /// No gate, for frames with the columns of `test`.
    pub fn none(test: &Dataset) -> Self {
        let rest_inputs = Table { names: test.inputs.names.clone(), values: vec![] };
        Self { rest_inputs, gates: vec![] }
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

//! Points behind a gate: untouched rows are not decoded but take the outputs of the baseline.

use std::borrow::Cow;

use taxel_data::BadValue;
use taxel_data::dataset::Dataset;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::relative;
use taxel_simulate::Synthesis;
use taxel_simulate::noise::Noise;

use super::super::gate::{BASELINE_FRAMES, Gate, GateRest, gated, has_sessions, share};
use crate::subject::Subject;

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
    /// Gates of rows, or of the whole array, with these tolerances `k`, for the `test` frames of a subject whose readings
    /// have this noise.
    pub fn new(
        subject: &Subject,
        (test, noise): (&Dataset, Option<Noise>),
        k: &[f64],
        whole_array: bool,
    ) -> Result<Self, BadValue> {
        if k.is_empty() {
            let rest_inputs = Table { names: test.inputs.names.clone(), values: vec![] };
            return Ok(Self { rest_inputs, gates: vec![] });
        }
        let relative_inputs = test.relative_inputs;
        let (gate, noise_level, readings) = match subject {
            Subject::Scene(scene) => {
                let noise = noise.unwrap_or(scene.world.noise);
                let synthesis = Synthesis::new(&scene.world).noise(noise);
                // The gate compares readings in Ω.
                let readings = if relative_inputs {
                    Cow::Owned(synthesis.frames(Stream::Test, test.frames()).inputs)
                } else {
                    Cow::Borrowed(&test.inputs)
                };
                let sessions = has_sessions(&scene.world, relative_inputs).then_some(test.frames());
                let gate = Gate::new(&synthesis, BASELINE_FRAMES, whole_array, sessions);
                (gate, noise.total_level(), readings)
            }
            Subject::Measured(data) => {
                let rest = GateRest::new(data, k)?;
                let gate = Gate::at(rest.baseline, test.rows, whole_array);
                (gate, rest.noise_level, Cow::Borrowed(&data.test_readings))
            }
        };
        let at_rest = |&k: &f64| {
            let rows = gate.at_rest(&readings, k * noise_level);
            AtRest { k, share: share(&rows), rows }
        };
        let gates = k.iter().map(at_rest).collect();
        let rest_inputs = if relative_inputs {
            relative::inputs(&gate.baseline, &gate.baseline)
        } else {
            gate.baseline
        };
        Ok(Self { rest_inputs, gates })
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

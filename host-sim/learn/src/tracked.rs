//! Decoders that track a contact, bit for bit as a device does, and the shares that a tracker needs of a sensor.

use nalgebra::{DMatrix, DVector};
use taxel_core::filter::{self, Settings};
use taxel_core::track::{Frame, State, TERMS, Tracker};
use taxel_core::{Estimate, RowStatus};
use taxel_data::Table;

use crate::decoder::{Estimates, FrameDecoder, Frames, Timing};
use crate::filtered::filter_frames;
use crate::prepared::PreparedModel;
use crate::relative::reciprocals;

/// Model whose estimates its tracker corrects, wherever it explains the readings. Outputs are rounded to f32. Frames whose
/// times are not known stay as they are decoded. Deviations and novelty stay those of each frame.
#[derive(Debug, Clone)]
pub struct Tracked<'b> {
    model: PreparedModel<'b>,
    tracker: Tracker<'b>,
    /// One over the baseline of each reading; 1 of those that are relative to it already.
    reciprocals: Option<Vec<f32>>,
    /// Time in µs from the start of a frame for which outputs are expected.
    ahead_us: f32,
    name: String,
}

impl<'b> Tracked<'b> {
    /// The `tracker` of a `model` behind it, whose outputs are those expected `ahead_us` after the start of each frame. A model
    /// that takes readings as they are may have a `baseline` for its tracker, as on a device: one in their units for each.
    pub fn new(
        model: PreparedModel<'b>,
        tracker: Tracker<'b>,
        baseline: Option<&[f64]>,
        ahead_us: f32,
    ) -> Self {
        let name = format!("{}, tracked", model.name());
        let ratios = model.model().metadata().relative_inputs;
        let ones = ratios.then(|| vec![1.0; model.inputs()]);
        let reciprocals = ones.or_else(|| baseline.map(reciprocals));
        Self { model, tracker, reciprocals, ahead_us, name }
    }

    /// Writes over the `values` that a decoder has made of `frames`, wherever the tracker explains them.
    fn track(&self, state: &mut State, frames: Frames<'_>, values: &mut [f64]) {
        let Some(Timing { start_us, reading_offset_us }) = frames.timing else {
            state.restart();
            return;
        };
        let sizes = self.tracker.sizes();
        let row_us: Vec<f32> = (0..sizes.rows)
            .map(|row| reading_offset_us.get(row * sizes.columns).map_or(0.0, |us| *us as f32))
            .collect();
        let outputs = values.len().checked_div(start_us.len()).unwrap_or(0).max(1);
        let lines = values.chunks_exact_mut(outputs);
        let readings = frames.readings.chunks_exact(sizes.cells().max(1));
        for ((values, readings), start_us) in lines.zip(readings).zip(start_us) {
            let readings: Vec<f32> = readings.iter().map(|reading| *reading as f32).collect();
            let mut outputs: Vec<f32> = values.iter().map(|value| *value as f32).collect();
            let mut status = vec![RowStatus::Decoded; sizes.rows];
            let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
            let frame = Frame {
                readings_ohm: &readings,
                reciprocals: self.reciprocals.as_deref(),
                start_us: *start_us,
                row_us: &row_us,
            };
            let ahead_us = self.ahead_us - frame.middle().0;
            self.tracker.track(state, &frame, ahead_us, &mut estimate);
            values.iter_mut().zip(outputs).for_each(|(value, output)| *value = f64::from(output));
        }
    }
}

impl FrameDecoder for Tracked<'_> {
    type State = State;

    fn name(&self) -> &str {
        &self.name
    }

    fn inputs(&self) -> usize {
        self.model.inputs()
    }

    fn decode(&self, state: &mut Self::State, frames: Frames<'_>) -> Estimates {
        let mut estimates = self.model.decode(&mut (), frames);
        self.track(state, frames, &mut estimates.values);
        estimates
    }
}

/// Frames one after the other, whose readings are taken at once.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    /// Start of each frame in µs.
    pub start_us: &'a [u64],
    /// Places of readings among those of all frames that were not measured: they are missing, or filled.
    pub faulty: &'a [usize],
    /// Baseline of each reading, for the tracker of a model that takes readings as they are.
    pub baseline: Option<&'a [f64]>,
}

/// Outputs of the `model` for one trajectory of `readings` in their units, as of a device: through a `filter` that is on, else
/// behind the model's tracker, if it has one. They are those expected the lead after each frame.
pub fn decode_series(
    model: &PreparedModel<'_>,
    readings: &Table,
    Series { start_us, faulty, baseline }: Series<'_>,
    filter: Settings,
) -> Table {
    let mut estimates = model.decode_table(readings);
    if filter.is_on() {
        let mut state = filter::State::new(vec![[0.0; 2]; estimates.names.len()]);
        filter_frames(&mut state, filter, start_us, &mut estimates.values);
    } else if let Some(tracker) = model.model().tracker() {
        let tracked = Tracked::new(model.clone(), tracker, baseline, filter.lead_us as f32);
        let mut measured = model.model_inputs(&readings.values).into_owned();
        faulty.iter().for_each(|place| measured[*place] = f64::NAN);
        let timing = Some(Timing { start_us, reading_offset_us: &[] });
        let measured = Frames { readings: &measured, timing };
        tracked.track(&mut State::default(), measured, &mut estimates.values);
    }
    estimates
}

/// Shares of one electrode and one column ([`taxel_core::track`]): the quadratic form that fits `change` best, in the mean over
/// these deformations in mm. `change` is that of the cell's conductance by each deformation, over the conductance at rest.
pub struct Shares {
    /// Pseudo-inverse of the terms of all deformations.
    inverse: DMatrix<f64>,
}

impl Shares {
    /// Fits to these deformations.
    ///
    /// # Panics
    /// If they are fewer than the terms, or lie in one plane.
    pub fn new(deformations_mm: &[[f64; 3]]) -> Self {
        let terms = |[x, y, z]: &[f64; 3]| [*x, *y, *z, x * x, x * y, x * z, y * y, y * z, z * z];
        let rows: Vec<f64> = deformations_mm.iter().flat_map(terms).collect();
        let matrix = DMatrix::from_row_slice(deformations_mm.len(), TERMS, &rows);
        let inverse = matrix.pseudo_inverse(1e-12).expect("a tolerance that is not negative");
        Self { inverse }
    }

    /// Shares of a cell with these changes, one for each deformation.
    pub fn fit(&self, changes: Vec<f64>) -> [f32; TERMS] {
        let shares = &self.inverse * DVector::from_vec(changes);
        std::array::from_fn(|term| shares[term] as f32)
    }
}

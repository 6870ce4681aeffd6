//! Decoders that track a contact, bit for bit as a device does, and the shares that a tracker needs of a sensor.

use nalgebra::{DMatrix, DVector};
use taxel_core::track::{Frame, State, TERMS, Tracker};
use taxel_core::{Estimate, RowStatus};
use taxel_data::Table;

use crate::decoder::{Estimates, FrameDecoder, Frames, Timing};
use crate::prepared::PreparedModel;

/// Decoder whose estimates a tracker corrects, wherever it explains the readings. Outputs are rounded to f32. Frames whose
/// times are not known stay as they are decoded. Deviations and novelty stay those of each frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked<'b, D> {
    decoder: D,
    tracker: Tracker<'b>,
    /// Whether readings are relative to the baseline.
    relative_inputs: bool,
    /// Time in µs from the start of a frame for which outputs are expected.
    ahead_us: f32,
    name: String,
}

impl<'b, D: FrameDecoder> Tracked<'b, D> {
    /// A `tracker` behind `decoder`, whose outputs are those expected `ahead_us` after the start of each frame.
    pub fn new(decoder: D, tracker: Tracker<'b>, relative_inputs: bool, ahead_us: f32) -> Self {
        let name = format!("{}, tracked", decoder.name());
        Self { decoder, tracker, relative_inputs, ahead_us, name }
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
        let ones = vec![1.0; sizes.cells()];
        let reciprocals = self.relative_inputs.then_some(&ones[..]);
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
                reciprocals,
                start_us: *start_us,
                row_us: &row_us,
            };
            let ahead_us = self.ahead_us - frame.middle().0;
            self.tracker.track(state, &frame, ahead_us, &mut estimate);
            values.iter_mut().zip(outputs).for_each(|(value, output)| *value = f64::from(output));
        }
    }
}

impl<D: FrameDecoder> FrameDecoder for Tracked<'_, D> {
    type State = (D::State, State);

    fn name(&self) -> &str {
        &self.name
    }

    fn inputs(&self) -> usize {
        self.decoder.inputs()
    }

    fn decode(&self, (decoder, state): &mut Self::State, frames: Frames<'_>) -> Estimates {
        let mut estimates = self.decoder.decode(decoder, frames);
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
}

/// Outputs of the `model` behind its `tracker`, for one trajectory of `readings` in their units. Outputs are those expected
/// `ahead_us` after each frame.
pub fn track_table(
    model: &PreparedModel<'_>,
    tracker: Tracker<'_>,
    readings: &Table,
    Series { start_us, faulty }: Series<'_>,
    ahead_us: f32,
) -> Table {
    let relative_inputs = model.model().metadata().relative_inputs;
    let tracked = Tracked::new(model.clone(), tracker, relative_inputs, ahead_us);
    let mut measured = model.model_inputs(&readings.values).into_owned();
    faulty.iter().for_each(|place| measured[*place] = f64::NAN);
    let timing = Some(Timing { start_us, reading_offset_us: &[] });
    let mut estimates = model.decode_table(readings);
    let measured = Frames { readings: &measured, timing };
    tracked.track(&mut State::default(), measured, &mut estimates.values);
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

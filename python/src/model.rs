//! Models: what a blob says, and what it makes of readings.
#![expect(clippy::needless_pass_by_value, reason = "arguments come from Python by value")]

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use self_cell::self_cell;
use taxel_core::{Decoder, Estimate, Frame, RowStatus, relative};
use taxel_learn::reading_model::Extent;
use taxel_learn::{ModelBlob, PreparedModel};

use crate::call::with_threads;

/// Most rows of a model, as many as the blob format has numbers for.
const MOST_ROWS: usize = 255;

/// Most lines that the calling thread decodes by itself.
const FEW_LINES: usize = 64;

/// Ways to decode with a blob.
struct Ways<'b> {
    tables: PreparedModel<'b>,
    frames: Decoder<'b, MOST_ROWS>,
}

self_cell!(
    struct Loaded {
        owner: ModelBlob,
        #[covariant]
        dependent: Ways,
    }
);

/// A weight blob, loaded.
#[pyclass(frozen, module = "taxel._native")]
pub struct Blob(Loaded);

fn refused(cause: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(cause.to_string())
}

impl Blob {
    fn ways(&self) -> &Ways<'_> {
        self.0.borrow_dependent()
    }

    fn counts(&self) -> (usize, usize) {
        let shape = self.ways().frames.shape();
        (shape.rows * shape.inputs, shape.rows * shape.outputs)
    }

    /// Model that divides by this baseline, if its inputs are relative to one.
    fn model(&self, baseline: Option<PyReadonlyArray1<'_, f64>>) -> PyResult<PreparedModel<'_>> {
        let model = self.ways().tables.clone();
        let Some(baseline) = baseline else { return Ok(model) };
        let (baseline, inputs) = (baseline.as_slice()?, self.counts().0);
        if baseline.len() != inputs {
            let found = baseline.len();
            return Err(refused(format!(
                "baseline: {found} numbers instead of {inputs}, one a reading"
            )));
        }
        Ok(model.with_baseline(baseline))
    }
}

/// Readings line after line, whose number of columns must be the model's.
fn lines<'a>(readings: &'a PyReadonlyArray2<'_, f64>, inputs: usize) -> PyResult<&'a [f64]> {
    let columns = readings.shape()[1];
    if columns != inputs {
        return Err(refused(format!("X has {columns} features, but the model takes {inputs}")));
    }
    Ok(readings.as_slice()?)
}

fn two_dimensional(
    py: Python<'_>,
    values: Vec<f64>,
    columns: usize,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let lines = values.len() / columns;
    PyArray1::from_vec(py, values).reshape([lines, columns])
}

#[pymethods]
impl Blob {
    #[new]
    fn new(bytes: &[u8]) -> PyResult<Self> {
        let blob = ModelBlob::of_bytes(bytes).map_err(refused)?;
        let loaded = Loaded::try_new(blob, |blob| {
            let tables = blob.prepare();
            Decoder::new(blob.parse()).map(|frames| Ways { tables, frames })
        });
        loaded.map(Self).map_err(refused)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.0.borrow_owner().bytes())
    }

    #[getter]
    fn input_names(&self) -> Vec<&str> {
        self.ways().frames.metadata().input_names.iter().collect()
    }

    #[getter]
    fn output_names(&self) -> Vec<&str> {
        self.ways().frames.metadata().output_names.iter().collect()
    }

    #[getter]
    fn crc(&self) -> u32 {
        self.ways().frames.model_crc()
    }

    /// Number of rows, and of inputs and outputs of each.
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        let shape = self.ways().frames.shape();
        (shape.rows, shape.inputs, shape.outputs)
    }

    #[getter]
    fn centres(&self) -> usize {
        let networks = self.ways().frames.model().networks();
        networks.map(|network| network.shape().centres).max().unwrap_or(0)
    }

    #[getter]
    fn formats(&self) -> Vec<&'static str> {
        self.ways().frames.model().networks().map(|network| network.format().name()).collect()
    }

    #[getter]
    fn relative_inputs(&self) -> bool {
        self.ways().frames.metadata().relative_inputs
    }

    #[getter]
    fn reading_model(&self) -> Option<&'static str> {
        let model = self.ways().frames.model();
        model.reading_model().map(|it| Extent::ALL[usize::from(it.assesses())].name())
    }

    /// Decodes readings (frames × inputs) to outputs (frames × outputs) on so many threads; 0 is one a core.
    #[pyo3(signature = (readings, baseline=None, threads=0))]
    fn decode<'py>(
        &self,
        py: Python<'py>,
        readings: PyReadonlyArray2<'py, f64>,
        baseline: Option<PyReadonlyArray1<'py, f64>>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (inputs, outputs) = self.counts();
        let (readings, model) = (lines(&readings, inputs)?, self.model(baseline)?);
        let decode = || {
            let filled = model.filled(readings, None);
            model.decode_lines(filled.as_ref().map_or(readings, |(filled, _)| filled))
        };
        // Few lines take less time than to wake a thread.
        let is_few = readings.len() <= FEW_LINES * inputs;
        let values =
            py.detach(|| if is_few { Ok(decode()) } else { with_threads(threads, decode) })?;
        two_dimensional(py, values, outputs)
    }

    /// Standard deviations (frames × outputs) and novelty (frames), in nats; None without a full reading model.
    #[pyo3(signature = (readings, baseline=None, threads=0))]
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn assess<'py>(
        &self,
        py: Python<'py>,
        readings: PyReadonlyArray2<'py, f64>,
        baseline: Option<PyReadonlyArray1<'py, f64>>,
        threads: usize,
    ) -> PyResult<Option<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)>> {
        let (inputs, outputs) = self.counts();
        let (readings, model) = (lines(&readings, inputs)?, self.model(baseline)?);
        let assess = || {
            let filled = model.filled(readings, None);
            model.assess(filled.as_ref().map_or(readings, |(filled, _)| filled))
        };
        let assessed = py.detach(|| with_threads(threads, assess))?;
        let Some((deviations, novelty)) = assessed else { return Ok(None) };
        Ok(Some((two_dimensional(py, deviations, outputs)?, PyArray1::from_vec(py, novelty))))
    }

    /// Readings (frames × inputs) with missing ones filled, as far as the model can.
    fn filled<'py>(
        &self,
        py: Python<'py>,
        readings: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = self.counts().0;
        let given = lines(&readings, inputs)?;
        let filled = py.detach(|| with_threads(0, || self.ways().tables.filled(given, None)))?;
        two_dimensional(py, filled.map_or_else(|| given.to_vec(), |(filled, _)| filled), inputs)
    }

    /// Reciprocals of a baseline, as a device computes them.
    #[staticmethod]
    fn reciprocals<'py>(
        py: Python<'py>,
        baseline: PyReadonlyArray1<'py, f32>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let reciprocals = baseline.as_slice()?.iter().copied().map(relative::reciprocal);
        Ok(PyArray1::from_vec(py, reciprocals.collect()))
    }

    /// Decodes one frame as a device does, into `outputs` and `status`; missing readings in `readings` are filled if the model
    /// can. Returns whether an input was clamped, the number of readings that were filled, and novelty (NaN if the model
    /// does not tell it); `deviations` are then written too.
    fn decode_frame(
        &self,
        mut readings: PyReadwriteArray1<'_, f32>,
        reciprocals: PyReadonlyArray1<'_, f32>,
        mut outputs: PyReadwriteArray1<'_, f32>,
        mut status: PyReadwriteArray1<'_, u8>,
        mut deviations: PyReadwriteArray1<'_, f32>,
    ) -> PyResult<(bool, usize, f32)> {
        let decoder = &self.ways().frames;
        let mut scratch = vec![0.0; decoder.scratch_floats()];
        let filled = decoder.fill(readings.as_slice_mut()?, reciprocals.as_slice()?, &mut scratch);
        let frame =
            Frame { readings_ohm: readings.as_slice()?, reciprocals: reciprocals.as_slice()? };
        let status = status.as_slice_mut()?;
        let mut rows = vec![RowStatus::MissingReading; status.len()];
        let mut estimate = Estimate { outputs: outputs.as_slice_mut()?, status: &mut rows };
        let clamped = decoder.decode_into(frame, &mut scratch, &mut estimate).map_err(refused)?;
        status.iter_mut().zip(&rows).for_each(|(status, row)| *status = *row as u8);
        let novelty = decoder.assess_into(frame, &mut scratch, deviations.as_slice_mut()?);
        Ok((clamped, filled, novelty.map_err(refused)?.unwrap_or(f32::NAN)))
    }
}

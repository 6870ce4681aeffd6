//! Recordings (.mcap), read.

use std::path::Path;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use taxel_recording::{Column, Reader};

/// Readings, estimates and true outputs (frames × columns; None where there are none), times in s, and names of readings and
/// of outputs.
type Recording<'py> = (
    Bound<'py, PyArray2<f32>>,
    [Option<Bound<'py, PyArray2<f32>>>; 2],
    Bound<'py, PyArray1<f64>>,
    [Vec<String>; 2],
);

/// Reads a recording whole.
#[pyfunction]
pub fn read_recording<'py>(py: Python<'py>, path: &str) -> PyResult<Recording<'py>> {
    let refused = |cause: taxel_recording::Error| PyValueError::new_err(format!("{path}: {cause}"));
    let reader = Reader::open(Path::new(path)).map_err(refused)?;
    let layout = reader.layout().clone();
    let (width, outputs) = (layout.readings.len(), layout.outputs.len());
    let (mut readings, mut times_s) = (Vec::new(), Vec::new());
    let mut values: [Vec<f32>; 2] = [const { Vec::new() }; 2];
    let mut are_known = [false; 2];
    for frame in reader {
        py.check_signals()?;
        let frame = frame.map_err(refused)?;
        readings.extend(frame.readings);
        times_s.push(frame.time_us as f64 * 1e-6);
        for (at, found) in [frame.outputs, frame.truth].into_iter().enumerate() {
            are_known[at] |= found.is_some();
            values[at].extend(found.unwrap_or_else(|| vec![f32::NAN; outputs]));
        }
    }
    let count = times_s.len();
    let array = |values, width| PyArray1::from_vec(py, values).reshape([count, width]);
    let [estimates, truth] = values;
    let known = |values, is_known: bool| is_known.then(|| array(values, outputs)).transpose();
    let names = |columns: Vec<Column>| columns.into_iter().map(|column| column.name).collect();
    Ok((
        array(readings, width)?,
        [known(estimates, are_known[0])?, known(truth, are_known[1])?],
        PyArray1::from_vec(py, times_s),
        [names(layout.readings), names(layout.outputs)],
    ))
}

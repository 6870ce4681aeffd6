//! Scenes: a sensor, what may happen to it, and how a model is trained for it.

use std::path::Path;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use taxel_data::random::Stream;
use taxel_evaluate::experiment::Experiment;
use taxel_simulate::Synthesis;
use toml::{Table, Value};

use crate::call::apart;

/// A scene, with its text.
#[pyclass(frozen, module = "taxel._native")]
pub struct Scene {
    #[pyo3(get)]
    name: String,
    /// The scene as a scene file has it.
    #[pyo3(get)]
    text: String,
    experiment: Arc<Experiment>,
}

fn refused(cause: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(cause.to_string())
}

fn parsed(name: String, text: String) -> PyResult<Scene> {
    let experiment = Arc::new(Experiment::parse(&name, &text).map_err(refused)?);
    Ok(Scene { name, text, experiment })
}

/// Readings, outputs, and the names of both.
type Frames<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Vec<String>, Vec<String>);

#[pymethods]
impl Scene {
    /// Scene of this name, or in this file.
    #[new]
    fn new(name_or_path: &str) -> PyResult<Self> {
        let text = Experiment::text(name_or_path).map_err(refused)?;
        let name =
            Path::new(name_or_path).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        parsed(name.unwrap_or_default(), text.into_owned())
    }

    #[staticmethod]
    fn of_text(name: String, text: String) -> PyResult<Self> {
        parsed(name, text)
    }

    /// Scene with other values: each a field's name, with its tables before it (`noise.level`), and what stands behind its
    /// `=` in a scene file.
    fn with_values(&self, values: Vec<(String, String)>) -> PyResult<Self> {
        let mut table: Table = toml::from_str(&self.text).map_err(refused)?;
        for (field, text) in values {
            let value: Table = toml::from_str(&format!("value = {text}")).map_err(refused)?;
            let value = value.get("value").cloned().unwrap_or(Value::Boolean(false));
            let mut names: Vec<&str> = field.split('.').collect();
            let last = names.pop().unwrap_or_default();
            let mut place = &mut table;
            for name in names {
                let inner = place.entry(name).or_insert_with(|| Value::Table(Table::new()));
                place = inner
                    .as_table_mut()
                    .ok_or_else(|| refused(format!("{name} is not a table of the scene")))?;
            }
            place.insert(last.into(), value);
        }
        let text = toml::to_string(&table).map_err(refused)?;
        parsed(self.name.clone(), text)
    }

    #[getter]
    fn rows(&self) -> usize {
        self.experiment.world.sensor.row_wires
    }

    #[getter]
    fn columns(&self) -> usize {
        self.experiment.world.sensor.column_wires
    }

    #[getter]
    fn output_names(&self) -> Vec<String> {
        self.experiment.world.output_names()
    }

    /// Frames of the scene's still contacts.
    fn frames<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        seed: Option<u64>,
        training: bool,
    ) -> PyResult<Frames<'py>> {
        let mut experiment = (*self.experiment).clone();
        experiment.world.seed = seed.unwrap_or(experiment.world.seed);
        experiment.world.check_frames("n", count).map_err(refused)?;
        let stream = if training { Stream::Training } else { Stream::Test };
        let dataset = apart(py, &Arc::default(), 0, move || {
            let synthesis = Synthesis::new(&experiment.world);
            experiment.dataset(&synthesis, stream, count)
        })?;
        let array = |table: taxel_data::table::Table| {
            let columns = table.names.len();
            PyArray1::from_vec(py, table.values.into_vec())
                .reshape([count, columns])
                .map(|it| (it, table.names))
        };
        let (inputs, input_names) = array(dataset.inputs)?;
        let (outputs, output_names) = array(dataset.outputs)?;
        Ok((inputs, outputs, input_names, output_names))
    }
}

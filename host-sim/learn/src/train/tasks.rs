//! Outputs that are missing in some lines: each is learnt from the lines that have it.
//!
//! Outputs that are missing in the same lines make a *task*. Its weights are fitted by themselves, for the regressors
//! that all tasks share. Where nothing is missing, all outputs are one task with all lines.

use std::ops::Range;

use taxel_data::error::quoted;
use taxel_data::{BadValue, Table, require};

use super::least_squares::{Design, Factor, Targets};
use super::samples::Samples;

/// Outputs that are missing in the same lines.
pub(crate) struct Task {
    pub columns: Vec<usize>,
    /// Lines that have these outputs.
    pub lines: Vec<usize>,
}

impl Task {
    /// Tasks of `outputs`, on these `lines`.
    pub fn all(outputs: &Table, lines: &[usize]) -> Vec<Self> {
        let of_columns = |columns: Vec<usize>| {
            let has = |line: &usize| !outputs.line(*line)[columns[0]].is_nan();
            let lines = lines.iter().copied().filter(has).collect();
            Self { columns, lines }
        };
        outputs.missing_together().into_iter().map(of_columns).collect()
    }
}

/// Writes the regressors of lines of readings (`lines × inputs`) into a slice, line after line.
pub(crate) type Write<'h> = Box<dyn Fn(&[f64], &mut [f64]) + Sync + 'h>;

/// Samples of a task, each times the factor on its error.
pub(crate) struct Weighed<'s> {
    pub samples: &'s Samples<'s>,
    /// What is subtracted from each output.
    pub means: &'s [f64],
    pub task: &'s Task,
    /// Number of regressors, and what writes them.
    pub regressors: usize,
    pub write: Write<'s>,
}

impl Design for Weighed<'_> {
    fn regressors(&self) -> usize {
        self.regressors
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let (lines, inputs) = (&self.task.lines[samples], &self.samples.table.inputs);
        let readings: Vec<f64> =
            lines.iter().flat_map(|line| inputs.line(*line)).copied().collect();
        (self.write)(&readings, values);
        for (line, values) in lines.iter().zip(values.chunks_exact_mut(self.regressors)) {
            let weight = self.samples.weight(*line);
            values.iter_mut().for_each(|value| *value *= weight);
        }
    }
}

impl Targets for Weighed<'_> {
    fn count(&self) -> usize {
        self.task.lines.len() * self.task.columns.len()
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let columns = &self.task.columns;
        let places = values.chunks_exact_mut(columns.len());
        for (line, places) in self.task.lines[samples].iter().zip(places) {
            let weight = self.samples.weight(*line);
            for (place, column) in places.iter_mut().zip(columns) {
                *place = (self.samples.target(*line, *column) - self.means[*column]) * weight;
            }
        }
    }
}

/// Factors of all tasks of a network, with the columns of each.
#[derive(Debug, Clone)]
pub(crate) struct Factors(pub Vec<(Vec<usize>, Factor)>);

impl Factors {
    /// Weights of all outputs, `regressors × outputs`.
    pub fn weights(&self) -> Vec<f64> {
        self.together(|factor, _| factor.weights())
    }

    /// Transformed targets of all outputs, `regressors × outputs`.
    pub fn projection(&self) -> Vec<f64> {
        self.together(|factor, _| factor.projection.clone())
    }

    /// Puts together `of_task`: what it makes of the factor and the columns of each task, `lines × columns`.
    pub fn together(&self, of_task: impl Fn(&Factor, &[usize]) -> Vec<f64>) -> Vec<f64> {
        let outputs: usize = self.0.iter().map(|(columns, _)| columns.len()).sum();
        let mut all = Vec::new();
        for (columns, factor) in &self.0 {
            let values = of_task(factor, columns);
            all.resize(values.len() / columns.len() * outputs, 0.0);
            let lines = all.chunks_exact_mut(outputs).zip(values.chunks_exact(columns.len()));
            for (line, values) in lines {
                columns.iter().zip(values).for_each(|(column, value)| line[*column] = *value);
            }
        }
        all
    }
}

/// Checks that more lines have each of the `outputs` than there are `centres`.
pub(super) fn check(outputs: &Table, centres: usize) -> Result<(), BadValue> {
    for (name, count) in outputs.names.iter().zip(outputs.counts()) {
        require(centres < count, "centres", centres, || {
            format!(
                "there must be fewer than the {count} training frames that have the output {}; lower it, add data, or \
                 leave that output out",
                quoted(name)
            )
        })?;
    }
    Ok(())
}

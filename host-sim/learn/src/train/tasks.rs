//! Outputs that are missing in some lines: each is learnt from the lines that have it.
//!
//! Outputs that are missing in the same lines make a *task*. Its weights are fitted by themselves, for the regressors
//! that all tasks share. Where nothing is missing, all outputs are one task with all lines.

use std::borrow::Cow;

use taxel_data::error::quoted;
use taxel_data::{BadValue, Dataset, Table, require};

use super::least_squares::Factor;

/// Task with its lines.
pub(crate) struct Task<'t> {
    pub columns: Vec<usize>,
    /// Lines that have these outputs.
    pub table: Cow<'t, Dataset>,
    /// What weights are fitted to, `lines × columns`.
    pub targets: Cow<'t, [f64]>,
}

impl<'t> Task<'t> {
    /// Tasks of `table`, with `targets` for its outputs: missing ones are missing there too.
    pub fn all(table: &'t Dataset, targets: &'t Table) -> Vec<Self> {
        let of_columns = |columns: Vec<usize>| {
            let lines = targets.lines_with(&columns);
            if columns.len() == targets.names.len() && lines.len() == targets.len() {
                let targets = Cow::Borrowed(targets.values.as_slice());
                return Self { columns, table: Cow::Borrowed(table), targets };
            }
            let outputs = table.outputs.part(&lines, &columns);
            let targets = Cow::Owned(targets.part(&lines, &columns).values);
            let table = Cow::Owned(Dataset { outputs, ..table.subset(&lines) });
            Self { columns, table, targets }
        };
        targets.missing_together().into_iter().map(of_columns).collect()
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

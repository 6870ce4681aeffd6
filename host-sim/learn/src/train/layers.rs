//! The layers of networks before their output weights: projection and Gaussians.

use std::borrow::Cow;

use rayon::prelude::*;
use taxel_data::dataset::Dataset;

use super::hidden_layer::HiddenLayer;
use super::{Options, Samples, memory, projection, view};
use crate::error::Result;

/// All that stands before the output weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Parameters of the projection in front of the one network of all rows; see [`projection`].
    pub projection: Option<Vec<f32>>,
    /// Gaussians of the row-wires' networks in order, or of the one network behind the projection.
    pub hidden: Vec<HiddenLayer>,
}

impl Layers {
    /// Layers as the paper has them: K-means centres of the frames, and widths by a rule; for the whole array behind a
    /// projection by regression.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for data without a projection, or training that takes more memory than is allowed.
    pub fn start(dataset: &Dataset, options: &Options) -> Result<Self> {
        memory::check(dataset, options, None)?;
        let fit = || projection::fit(dataset, options.features);
        let projection = options.whole_array.then(fit).transpose()?;
        let start = Self { projection, hidden: vec![] };
        Ok(start.with_centres(dataset, options))
    }

    /// K-means centres behind this projection.
    #[must_use]
    pub fn with_centres(self, dataset: &Dataset, options: &Options) -> Self {
        let seen = self.seen(dataset);
        let of_row = |row: usize| {
            let table = seen.row_table(row);
            let samples = Samples::new(&table);
            samples.layer(samples.centres(options, row), options)
        };
        let hidden = (0..seen.rows).into_par_iter().map(of_row).collect();
        Self { hidden, ..self }
    }

    /// What the networks are given of the frames of `dataset`.
    ///
    /// # Panics
    /// If the projection is one of other readings.
    pub fn seen<'d>(&self, dataset: &'d Dataset) -> Cow<'d, Dataset> {
        match &self.projection {
            Some(parameters) => Cow::Owned(projection::apply(view(parameters, dataset), dataset)),
            None => Cow::Borrowed(dataset),
        }
    }
}

//! The layers of networks before their output weights: projection and Gaussians.

use std::borrow::Cow;

use taxel_data::Dataset;

use super::{HiddenLayer, Options, Samples, memory, projection};
use crate::error::Result;
use crate::parallel;

/// All that stands before the output weights, and what it makes of the frames that it was found on.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers<'d> {
    /// Parameters of the projection in front of the one network of all rows; see [`projection`].
    pub projection: Option<Vec<f32>>,
    /// What the networks are given of the frames: these themselves, or their features behind the projection.
    pub seen: Cow<'d, Dataset>,
    /// Gaussians of the row-wires' networks in order, or of the one network behind the projection.
    pub hidden: Vec<HiddenLayer>,
}

impl<'d> Layers<'d> {
    /// Layers as the paper has them: K-means centres of the frames; for one network of all rows behind a projection by
    /// regression.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for data without a projection, or training that takes more memory than is allowed.
    pub fn start(dataset: &'d Dataset, options: &Options) -> Result<Self> {
        memory::check(dataset, options, None)?;
        let fit = || projection::fit(dataset, options.features);
        Ok(Self::behind(options.projects(dataset).then(fit).transpose()?, dataset, options))
    }

    /// K-means centres behind a given projection, or none.
    ///
    /// # Panics
    /// If the projection is one of other readings.
    pub fn behind(projection: Option<Vec<f32>>, dataset: &'d Dataset, options: &Options) -> Self {
        let seen = projection::seen(projection.as_deref(), dataset);
        let of_row = |row: usize| {
            let table = seen.row_table(row);
            let samples = Samples::new(&table);
            samples.layer(samples.centres(options, row), options)
        };
        let hidden = parallel::map(seen.rows, &of_row);
        Self { projection, seen, hidden }
    }
}

//! Networks of the paper that no blob holds: standard ones, with a centre for every frame, and networks in f64. Their errors
//! stand beside those of the others in Table 1.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use taxel_data::{Dataset, Purpose, Random, Stream, columns};
use taxel_learn::Decoder;
use taxel_learn::decoders::standard::{self, StandardNetwork};
use taxel_learn::decoders::textbook::Textbook;
use taxel_learn::decoders::{RowDecoder, Rows};
use taxel_learn::train::kmeans::Search;

use crate::experiment::Table1;
use crate::metrics::{self, Errors, LimitSummary, Measure};

/// Name of the network in f64.
pub const TEXTBOOK: &str = "textbook";

/// Initial covariance of standard networks in f64: the penalty is too small to be felt.
const INTERPOLATING: f64 = 1e12;

/// Effort of the search for centres of Table 1.
pub fn search() -> Search {
    Search { most_points: 4096, restarts: 1, ..Search::default() }
}

/// Networks of a scene's Table 1 that no blob holds, with Gaussians of this `spread`: the standard one, unless its
/// interpolation matrix is singular; with a textbook covariance, both in f64.
pub fn fit(settings: &Table1, seed: u64, spread: f64, training: &Dataset) -> Vec<Box<dyn Decoder>> {
    let few: Vec<usize> = (0..settings.standard_frames).collect();
    let few = training.subset(&few);
    let Some(covariance) = settings.textbook_covariance else {
        let standard = |row| StandardNetwork::fit(&few.row_table(row), spread);
        let rows = (0..few.rows).into_par_iter().map(standard).collect::<Option<Vec<_>>>();
        return rows.map(|rows| joined(standard::NAME, &few, rows)).into_iter().collect();
    };
    let in_f64 = |name, frames: &Dataset, centres, covariance| {
        let of_row = |row: usize| {
            let table = frames.row_table(row);
            let mut random = Random::new(seed, Stream::Training, Purpose::Centres, 0, row as u64);
            let hidden = Arc::new(Textbook::new(&table, centres, &mut random));
            hidden.fit(&table, spread, covariance)
        };
        let rows = (0..frames.rows).into_par_iter().map(of_row).collect();
        joined(name, frames, rows)
    };
    vec![
        in_f64(TEXTBOOK, training, settings.centres, covariance),
        in_f64(standard::NAME, &few, settings.standard_frames, INTERPOLATING),
    ]
}

fn joined<D: RowDecoder + Send + 'static>(
    name: &'static str,
    training: &Dataset,
    rows: Vec<D>,
) -> Box<dyn Decoder> {
    Box::new(Rows::new(name, training, rows))
}

/// Errors of one decoder at one noise level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    pub decoder: String,
    /// Width σ on scaled inputs, for decoders that have one.
    pub spread: Option<f64>,
    pub errors: Vec<Errors>,
    /// Largest |e|/(H − Δz) of a row's electrodes, mean over rows and frames, in per cent; for compressions alone.
    pub largest_positional_percent: Option<f64>,
}

impl Entry {
    /// Errors of the decoder with this name and spread, which makes these `estimates` of the frames of `test`.
    pub fn new(
        (decoder, spread): (&str, Option<f64>),
        estimates: &[f64],
        test: &Dataset,
        measure: &Measure,
    ) -> Self {
        Self {
            decoder: decoder.into(),
            spread,
            errors: metrics::by_group(&test.outputs, estimates, measure),
            largest_positional_percent: largest_positional_percent(test, estimates, measure),
        }
    }
}

/// What one spread at one noise level gives in Table 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Baselines, the network, and what [`fit`] gives.
    pub entries: Vec<Entry>,
    pub limit: LimitSummary,
}

/// Largest |e|/(H − Δz) of a row's electrodes, mean over rows and frames, in per cent.
fn largest_positional_percent(test: &Dataset, estimates: &[f64], measure: &Measure) -> Option<f64> {
    let thickness_mm = measure.thickness_mm?;
    let names = &test.outputs.names;
    let of_a_row = names.len() / test.rows.max(1);
    let groups = columns::groups(names);
    let (_, along_z) = groups.iter().find(|(group, _)| columns::is_compression(group))?;
    let mut sum = 0.0;
    for (truth, estimate) in test.outputs.lines().zip(estimates.chunks_exact(names.len())) {
        for row in along_z.chunk_by(|a, b| a / of_a_row == b / of_a_row) {
            let positional =
                |i: &usize| (estimate[*i] - truth[*i]).abs() / (thickness_mm - truth[*i]);
            sum += row.iter().map(positional).fold(0.0, f64::max);
        }
    }
    Some(100.0 * sum / (test.outputs.len() * test.rows) as f64)
}

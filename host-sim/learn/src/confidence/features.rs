//! Features that the density of frames is modelled in: directions of the largest variance, and what they leave out.

use nalgebra::DMatrix;
use taxel_core::confidence::project;
use taxel_data::Table;

use crate::parallel;
use crate::train::principal;

/// Frames whose products are summed before the sum is added to those of others.
const FRAMES_AT_ONCE: usize = 1024;

/// Standardisation of readings, and directions that they are projected to; all numbers are those of the blob.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Features {
    pub mean: Vec<f32>,
    /// One over each reading's standard deviation; 0 for a reading that never changes.
    pub scale: Vec<f32>,
    /// Part of each reading in every direction, `readings × directions`.
    pub parts: Vec<f32>,
}

impl Features {
    /// Features of these `readings`, with so many `directions`, at most as many as there are readings.
    pub fn new(readings: &Table, directions: usize) -> Self {
        let mean: Vec<f32> = readings.means().iter().map(|mean| *mean as f32).collect();
        let per_deviation = |deviation: &f64| {
            let scale = (1.0 / deviation) as f32;
            if scale.is_finite() { scale } else { 0.0 }
        };
        let scale: Vec<f32> = readings.deviations().iter().map(per_deviation).collect();
        let start = Self { mean, scale, parts: vec![] };
        let found = principal::directions(start.covariance(readings), directions);
        // Row by row.
        let parts = found.transpose().as_slice().iter().map(|part| *part as f32).collect();
        Self { parts, ..start }
    }

    /// Number of directions.
    pub fn directions(&self) -> usize {
        self.parts.len() / self.mean.len()
    }

    /// Number of features: one more than there are directions.
    pub fn count(&self) -> usize {
        self.directions() + 1
    }

    fn standardised<'f>(&'f self, frame: &'f [f64]) -> impl Iterator<Item = f64> + 'f {
        let places = self.mean.iter().zip(&self.scale);
        frame
            .iter()
            .zip(places)
            .map(|(r, (mean, scale))| (r - f64::from(*mean)) * f64::from(*scale))
    }

    /// Mean products of standardised readings.
    fn covariance(&self, readings: &Table) -> DMatrix<f64> {
        let size = self.mean.len();
        let products = |frames: &[f64]| {
            let lines = frames.chunks_exact(size).flat_map(|frame| self.standardised(frame));
            let z = DMatrix::from_iterator(size, frames.len() / size, lines);
            &z * z.transpose()
        };
        let sums = parallel::pieces(&readings.values, FRAMES_AT_ONCE * size, &products);
        let sum = sums.into_iter().fold(DMatrix::zeros(size, size), |sum, piece| sum + piece);
        sum / readings.len() as f64
    }

    /// Features of every line of `readings`, `lines × features`: the bits that a device computes. Where directions leave
    /// nothing out, the last feature is rounding alone.
    pub fn apply(&self, readings: &[f64]) -> Vec<f64> {
        let size = self.mean.len();
        let projection = [&vec![0.0; self.directions()], &self.parts[..]].concat();
        let of_frame = |frame: &[f64]| {
            let (mut z, mut features) = (vec![0.0; size], vec![0.0; self.count()]);
            let frame = frame.iter().map(|reading| *reading as f32);
            project(frame, [&self.mean, &self.scale], &projection, &mut z, &mut features);
            features.into_iter().map(f64::from)
        };
        let of_piece =
            |frames: &[f64]| -> Vec<f64> { frames.chunks_exact(size).flat_map(of_frame).collect() };
        parallel::pieces(readings, FRAMES_AT_ONCE * size, &of_piece).concat()
    }
}

//! Factors that readings have in common, by maximum likelihood.
//!
//! Readings are a few common factors and noise of each reading's own. Given the noise, the factors are principal components
//! of readings in units of it; given the factors, noise is what they leave of each variance (Lawley and Maxwell, *Factor
//! analysis as a statistical method*, 1971).

use nalgebra::DMatrix;
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_data::Table;

use crate::error::{Error, Result};
use crate::parallel;
use crate::train::{principal, projection};

/// Most rounds of the fit.
const ROUNDS: usize = 30;
/// Change of any reading's noise, relative to its variance, below which rounds stop.
const ENOUGH: f64 = 1e-4;
/// Least variance of a reading's own noise, relative to the reading's variance.
const NOISE_FLOOR: f64 = 1e-6;
/// Largest sum of the squares of a reading's parts, which is below 1 in f32, too.
const MOST_COMMON: f64 = 1.0 - 1e-6;
/// Frames that a thread takes at a time.
const FRAMES_AT_ONCE: usize = 1024;

/// Factors of a table of readings: the numbers of a [`ReadingModel`] that fills missing readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors {
    sizes: Sizes,
    pub(super) block: Vec<f32>,
}

impl Factors {
    /// Fits so many `factors` to `readings`.
    ///
    /// # Errors
    /// [`Error::Unfit`] for readings that are no numbers.
    pub fn fit(readings: &Table, factors: usize) -> Result<Self> {
        let no_numbers = || Error::unfit("some readings are not numbers (reading model)");
        let sizes = Sizes { readings: readings.names.len(), factors, components: 0, outputs: 1 };
        let block = fit(readings, factors).ok_or_else(no_numbers)?;
        ReadingModel::new(sizes, &block).map_err(|_| no_numbers())?;
        Ok(Self { sizes, block })
    }

    /// Reading model of the factors, without components.
    pub fn model(&self) -> ReadingModel<'_> {
        ReadingModel::of_array(self.sizes, &self.block)
    }

    /// Features of every line of `readings`, `lines × features`: the bits that a device computes.
    pub fn features(&self, readings: &[f64]) -> Vec<f64> {
        let size = self.sizes.readings;
        let of_piece = |frames: &[f64]| {
            let (mut z, mut features) = (vec![0.0; size], vec![0.0; self.sizes.features()]);
            let mut all = Vec::new();
            for frame in frames.chunks_exact(size) {
                let frame: Vec<f32> = frame.iter().map(|reading| *reading as f32).collect();
                self.model().features(&frame, None, &mut z, &mut features);
                all.extend(features.iter().map(|feature| f64::from(*feature)));
            }
            all
        };
        parallel::pieces(readings, FRAMES_AT_ONCE * size, &of_piece).concat()
    }
}

/// Numbers of a reading model without components, in the order of [`ReadingModel::new`].
fn fit(readings: &Table, factors: usize) -> Option<Vec<f32>> {
    let count = readings.names.len();
    let means = readings.means();
    let deviations = readings.deviations();
    let products = products(readings, &means);
    let all = readings.len() as f64;
    // Correlations: readings that never change are nothing but noise.
    let usable = |i: usize| deviations[i] > 0.0;
    let correlations =
        DMatrix::from_fn(count, count, |i, j| match (i == j, usable(i) && usable(j)) {
            (true, _) => 1.0,
            (_, true) => {
                products[i.min(j) * count + i.max(j)] / all / deviations[i] / deviations[j]
            }
            (_, false) => 0.0,
        });
    if !correlations.iter().all(|value| value.is_finite()) {
        return None;
    }
    // Start: what the other readings leave of each, by their regression.
    let ridge = DMatrix::identity(count, count) * NOISE_FLOOR;
    let inverse = (&correlations + ridge).cholesky()?.inverse();
    let mut noise: Vec<f64> =
        inverse.diagonal().iter().map(|d| (1.0 / d).clamp(NOISE_FLOOR, 1.0)).collect();
    for _ in 0..ROUNDS {
        let loadings = loadings(&correlations, &noise, factors).0;
        let mut change = 0.0_f64;
        for (i, noise) in noise.iter_mut().enumerate() {
            let common: f64 = loadings.row(i).iter().map(|l| l * l).sum::<f64>() * *noise;
            let next = (1.0 - common).clamp(NOISE_FLOOR, 1.0);
            change = change.max((next - *noise).abs());
            *noise = next;
        }
        if change < ENOUGH {
            break;
        }
    }
    let (loadings, variances) = loadings(&correlations, &noise, factors);
    let mut block: Vec<f32> = means.iter().map(|mean| *mean as f32).collect();
    let scale = |i: usize| if usable(i) { 1.0 / (deviations[i] * noise[i].sqrt()) } else { 0.0 };
    block.extend((0..count).map(|i| scale(i) as f32));
    block.extend(vec![0.0; factors]);
    for i in 0..count {
        let row = loadings.row(i);
        let parts: Vec<f64> = row.iter().zip(&variances).map(|(part, v)| part / v.sqrt()).collect();
        let common: f64 = parts.iter().map(|part| part * part).sum();
        let within = (MOST_COMMON / common).min(1.0).sqrt();
        block.extend(parts.iter().map(|part| (part * within) as f32));
    }
    Some(block)
}

/// Parts of readings in each of the `factors`, in units of the readings' own `noise` (a variance), and the variance of
/// all readings along each, in the same unit: 1 of it is noise.
fn loadings(
    correlations: &DMatrix<f64>,
    noise: &[f64],
    factors: usize,
) -> (DMatrix<f64>, Vec<f64>) {
    let scale: Vec<f64> = noise.iter().map(|noise| 1.0 / noise.sqrt()).collect();
    let in_noise = DMatrix::from_fn(noise.len(), noise.len(), |i, j| {
        correlations[(i, j)] * scale[i] * scale[j]
    });
    let directions = principal::directions(in_noise.clone(), factors);
    let mut parts = directions.clone();
    let mut variances = Vec::with_capacity(factors);
    for (factor, direction) in directions.column_iter().enumerate() {
        let variance = (direction.transpose() * &in_noise * direction)[(0, 0)].max(1.0);
        parts.column_mut(factor).scale_mut((variance - 1.0).sqrt());
        variances.push(variance);
    }
    (parts, variances)
}

/// Sums Σ zᵢ·zⱼ over all frames for every i ≤ j, with z the readings about their means. Pieces are added in their order,
/// whatever the number of threads.
fn products(readings: &Table, means: &[f64]) -> Vec<f64> {
    let count = means.len();
    let of_piece = |lines: &[f64]| {
        let mut sums = vec![0.0; count * count];
        for line in lines.chunks_exact(count) {
            let z: Vec<f64> = line.iter().zip(means).map(|(value, mean)| value - mean).collect();
            projection::add_products(&z, count, &mut sums);
        }
        sums
    };
    projection::sum(&parallel::pieces(&readings.values, FRAMES_AT_ONCE * count, &of_piece))
}

//! Filling of missing readings: fitting of what [`taxel_core::fill`] fills them by.
//!
//! Factor analysis by maximum likelihood: readings are a few common factors and noise of each reading's own. Given the
//! noise, the factors are principal components of readings in units of it; given the factors, noise is what they leave
//! of each variance (Lawley and Maxwell, *Factor analysis as a statistical method*, 1971).

use nalgebra::DMatrix;
use taxel_core::fill::Fill;
use taxel_data::{Dataset, Table};

use crate::error::{Error, Result};
use crate::packing::ModelBlob;
use crate::parallel;
use crate::train::principal;
use crate::train::projection;

/// Number of factors, where there are enough readings.
const FACTORS: usize = 16;
/// Least number of frames for each reading. With fewer, what is fitted is chance: sound wires then look as if they touched.
const FRAMES_A_READING: usize = 10;
/// Rounds of the fit.
const ROUNDS: usize = 30;
/// Least variance of a reading's own noise, relative to the reading's variance.
const NOISE_FLOOR: f64 = 1e-6;
/// Least number of readings of which some can be told from the others.
const LEAST_READINGS: usize = 4;
/// Frames whose products are summed before the sum is added to those of others.
const FRAMES_AT_ONCE: usize = 1024;

/// Checks before long work that a model which is trained on `frames` can fill missing readings.
///
/// # Errors
/// [`Error`] for readings relative to the baseline, or fewer than four; or for fewer than ten frames a reading.
pub fn check(frames: &Dataset) -> Result<()> {
    check_readings(frames.relative_inputs, &frames.inputs)
}

fn check_readings(are_relative: bool, readings: &Table) -> Result<()> {
    let (frames, count) = (readings.len(), readings.names.len());
    if are_relative {
        return Err(no_fill("its inputs are relative to the baseline"));
    }
    if count < LEAST_READINGS {
        return Err(no_fill("it has fewer than four readings"));
    }
    let least = FRAMES_A_READING * count;
    if frames >= least {
        return Ok(());
    }
    Err(Error::unfit(format!(
        "{frames} frames are too few to learn how to fill {count} missing readings (fill): give {least} or more, or leave \
         the fill out"
    )))
}

fn no_fill(why: &str) -> Error {
    Error::unfit_for("fill", format!("the model cannot fill missing readings: {why}"))
}

/// Adds to the model in `blob` a fill of missing readings, fitted to `readings`.
///
/// # Errors
/// [`Error`] for a model that takes readings relative to the baseline, or has fewer than four; for readings that are no
/// numbers, or too few frames; and for a model beyond what the format holds.
pub fn add(blob: &ModelBlob, readings: &Table) -> Result<ModelBlob> {
    let count = readings.names.len();
    check_readings(blob.parse().metadata().relative_inputs, readings)?;
    let factors = FACTORS.min(count / 2);
    let no_numbers = || no_fill("readings are no numbers");
    let block = fit(readings, factors).ok_or_else(no_numbers)?;
    let fill = Fill::new(count, factors, &block).map_err(|_| no_numbers())?;
    blob.with_fill(fill)
}

/// Numbers of a fill, in the order of [`Fill::new`]; `None` for readings that are no numbers.
pub(crate) fn fit(readings: &Table, factors: usize) -> Option<Vec<f32>> {
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
        for (i, noise) in noise.iter_mut().enumerate() {
            let common: f64 = loadings.row(i).iter().map(|l| l * l).sum::<f64>() * *noise;
            *noise = (1.0 - common).clamp(NOISE_FLOOR, 1.0);
        }
    }
    let (loadings, variances) = loadings(&correlations, &noise, factors);
    let mut block: Vec<f32> = means.iter().map(|mean| *mean as f32).collect();
    let scale = |i: usize| if usable(i) { 1.0 / (deviations[i] * noise[i].sqrt()) } else { 0.0 };
    block.extend((0..count).map(|i| scale(i) as f32));
    for i in 0..count {
        let parts = loadings.row(i);
        block.extend(parts.iter().zip(&variances).map(|(part, v)| (part / v.sqrt()) as f32));
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

#[cfg(test)]
mod tests;

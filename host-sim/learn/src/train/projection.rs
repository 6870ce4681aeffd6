//! Projection of all readings of a frame to a few features: those directions that tell most about the
//! outputs.
//!
//! Reduced-rank regression (Izenman, J. Multivariate Anal. 5, 1975): let B be the least-squares
//! solution, and V the first F eigenvectors of Bᵀ·Σxx·B, the covariance of its predictions. Of all
//! matrices of rank F, B·V·Vᵀ then predicts the outputs with the least squared error.
//!
//! The features are x·B·V, in the outputs' unit. Principal components would also spend directions on
//! common changes of the readings that no output needs. `docs/features.md` has measurements.
//!
//! Few outputs have few such directions, and readings tell more of them than any linear map: where a contact is, is a
//! ratio of sums. So with fewer outputs than features, their products are regressed on as well.

use std::borrow::Cow;

use nalgebra::DMatrix;
use taxel_core::projection::Projection;
use taxel_data::{Dataset, Table, require, widest};

use super::principal;
use crate::error::{Error, Result, no_regression};
use crate::parallel;

/// Frames whose products are summed before the sum is added to those of others.
const FRAMES_AT_ONCE: usize = 1024;
/// White noise added to every reading, relative to its standard deviation. Without it, directions in
/// which readings hardly move would be amplified beyond f32.
const NOISE_FLOOR: f64 = 1e-3;
/// Number of features for outputs that belong to no row-wire, unless a user says otherwise. The device's routines keep
/// so many inputs in registers.
pub const USUAL_FEATURES: usize = 18;
/// Most readings of a single row table that a network is given itself where outputs give few features.
const MOST_DIRECT: usize = 48;
/// Largest degree of the products of outputs.
const MOST_FACTORS: usize = 3;

/// Number of features for so many `readings` of so many `rows`, unless a user says otherwise: as many as one row has
/// readings, or [`USUAL_FEATURES`] for a single row table.
pub fn usual_features(rows: usize, readings: usize) -> usize {
    if rows > 1 { (readings / rows).min(USUAL_FEATURES) } else { USUAL_FEATURES }
}

/// Number of features that [`fit`] can give for `dataset`, if so many are `wanted`: fewer than the readings, and no more
/// than the outputs and their products.
pub fn features_at_most(dataset: &Dataset, wanted: usize) -> usize {
    let readings = dataset.inputs.names.len();
    wanted.min(readings.saturating_sub(1)).min(factors(&dataset.outputs, wanted).len())
}

/// Whether all readings of `dataset` are projected: to the [usual](usual_features) number of features, or to fewer where
/// readings are many.
pub(super) fn is_usual_for(dataset: &Dataset) -> bool {
    let readings = dataset.inputs.names.len();
    let usual = usual_features(dataset.rows, readings);
    let enough = readings > MOST_DIRECT || factors(&dataset.outputs, usual).len() >= usual;
    usual < readings && enough
}

/// Checks a number of features that all readings of `dataset` are to be projected to.
///
/// # Errors
/// [`Error`] for a number of features that cannot be had.
pub fn check(dataset: &Dataset, features: Option<usize>) -> Result<()> {
    let readings = dataset.inputs.names.len();
    if let Some(features) = features {
        let possible = (1..=features_at_most(dataset, features)).contains(&features);
        require(possible, "features", features, || {
            format!(
                "give from 1 to {}, fewer than the {readings} readings and no more than the {} outputs and their products",
                features_at_most(dataset, readings),
                dataset.outputs.names.len()
            )
        })?;
    }
    Ok(())
}

/// Fits the projection of `dataset`'s readings to so many `features`; by default to the [usual](usual_features) number,
/// or to fewer if there are [no more](features_at_most).
///
/// Returns f₀, then each reading's part in every feature (`readings × features`), as [`Projection::new`] takes them.
///
/// # Errors
/// [`Error`] for a number of features that cannot be had, for data without a regression, or with a projection beyond f32.
pub fn fit(dataset: &Dataset, features: Option<usize>) -> Result<Vec<f32>> {
    let readings = dataset.inputs.names.len();
    let usual = usual_features(dataset.rows, readings);
    check(dataset, features)?;
    let features = features.unwrap_or(usual);
    let targets = targets(&dataset.outputs, features);
    let features = features.min(targets.names.len());
    let weights = dataset.weights.as_deref();
    let parts = directions((&dataset.inputs, weights), &targets, features)?;
    about_means(parts.transpose().as_slice(), &dataset.inputs.means())
}

/// Parameters of the projection with these `parts` (`readings × features`), whose features are 0 at the `means`
/// of the readings.
///
/// # Errors
/// [`Error`] for numbers beyond f32.
pub(super) fn about_means(parts: &[f64], means: &[f64]) -> Result<Vec<f32>> {
    let features = parts.len() / means.len();
    // f₀ makes up for the means after rounding.
    let mut parameters = vec![0.0; features];
    for (parts, mean) in parts.chunks_exact(features).zip(means) {
        for (start, part) in parameters.iter_mut().zip(parts) {
            *start -= f64::from(*part as f32) * mean;
        }
    }
    parameters.extend(parts);
    let parameters: Vec<f32> = parameters.into_iter().map(|value| value as f32).collect();
    if parameters.iter().all(|value| value.is_finite()) {
        Ok(parameters)
    } else {
        Err(Error::failed("the projection of these readings is beyond f32"))
    }
}

/// Projection of `dataset`'s readings with the given `parameters`.
///
/// # Panics
/// If `parameters` are not as many as [`fit`] makes for this data set.
pub fn view<'b>(parameters: &'b [f32], dataset: &Dataset) -> Projection<'b> {
    let readings = dataset.inputs.names.len();
    Projection::new(readings, parameters.len() / (readings + 1), parameters)
        .expect("a projection of these readings")
}

/// What networks are given of the frames of `dataset`: these themselves, or what a projection of these `parameters`
/// [makes](apply) of them.
///
/// # Panics
/// If the projection is one of other readings.
pub fn seen<'d>(parameters: Option<&[f32]>, dataset: &'d Dataset) -> Cow<'d, Dataset> {
    match parameters {
        Some(parameters) => Cow::Owned(apply(view(parameters, dataset), dataset)),
        None => Cow::Borrowed(dataset),
    }
}

/// Data set that the network behind the projection is trained on: one row, with the features as inputs,
/// all scaled by the largest span of any.
pub fn apply(projection: Projection<'_>, dataset: &Dataset) -> Dataset {
    let (width, count) = (dataset.inputs.names.len(), projection.features());
    let names = (1..=count).map(|feature| format!("feature{feature}")).collect();
    let values = features(projection, count, width, &dataset.inputs.values);
    Dataset {
        inputs: Table { names, values },
        outputs: dataset.outputs.clone(),
        common_span: true,
        weights: dataset.weights.clone(),
        ..Dataset::empty(vec![], vec![], 1, 0)
    }
}

/// Projects every line of `readings` as the device does: `lines × features`, in the outputs' unit.
///
/// A line has `width` readings and gets so many `features`.
pub fn features(
    projection: Projection<'_>,
    features: usize,
    width: usize,
    readings: &[f64],
) -> Vec<f64> {
    let of_line = |line: &[f64]| {
        let line: Vec<f32> = line.iter().map(|reading| *reading as f32).collect();
        let mut features = vec![0.0; features];
        projection.project(&line, &mut features);
        features.into_iter().map(f64::from)
    };
    let of_piece =
        |lines: &[f64]| -> Vec<f64> { lines.chunks_exact(width).flat_map(of_line).collect() };
    parallel::pieces(readings, FRAMES_AT_ONCE * width, &of_piece).concat()
}

/// What the projection has to tell: the `outputs`, and where these are fewer than `features`, their products of two
/// or three factors. Then all are about their means and have a standard deviation of 1.
pub(super) fn targets(outputs: &Table, features: usize) -> Cow<'_, Table> {
    let all = factors(outputs, features);
    if all.len() == outputs.names.len() {
        return Cow::Borrowed(outputs);
    }
    let outputs = standardised(outputs);
    let of_line = |line: &[f64]| -> Vec<f64> {
        let product = |factors: &Vec<usize>| factors.iter().map(|factor| line[*factor]).product();
        all.iter().map(product).collect()
    };
    let values = outputs.lines().flat_map(of_line).collect();
    let names = (1..=all.len()).map(|product| format!("product{product}")).collect();
    Cow::Owned(standardised(&Table { names, values }))
}

/// Factors of each target: the columns of `outputs`, and of their products if these are needed for so many `features`.
/// Products of outputs that no line has together tell nothing.
fn factors(outputs: &Table, features: usize) -> Vec<Vec<usize>> {
    let count = outputs.names.len();
    let mut products: Vec<Vec<usize>> = (0..count).map(|output| vec![output]).collect();
    let mut all = products.clone();
    for _ in 1..MOST_FACTORS {
        if all.len() >= features {
            break;
        }
        // Every product once: its factors in ascending order.
        let longer = products.iter().flat_map(|product| {
            let least = product.last().copied().unwrap_or(0);
            (least..count).map(|factor| [product.as_slice(), &[factor]].concat())
        });
        products = longer.filter(|product| !outputs.lines_with(product).is_empty()).collect();
        all.extend_from_slice(&products);
    }
    all
}

/// Columns of `table` about their means, with standard deviations of 1; those that never change are 0.
fn standardised(table: &Table) -> Table {
    let scale = |deviation: f64| if deviation > 0.0 { 1.0 / deviation } else { 0.0 };
    let scales: Vec<(f64, f64)> =
        table.means().into_iter().zip(table.deviations().into_iter().map(scale)).collect();
    let values = table.lines().flat_map(|line| {
        line.iter().zip(&scales).map(|(value, (mean, scale))| (value - mean) * scale)
    });
    Table { names: table.names.clone(), values: values.collect() }
}

/// Each reading's part in every feature, one feature a column.
fn directions(
    (inputs, weights): (&Table, Option<&[f64]>),
    outputs: &Table,
    features: usize,
) -> Result<DMatrix<f64>> {
    let readings = inputs.names.len();
    let all = Covariances::new((inputs, weights), outputs);
    let (regression, predicted) = if outputs.values.iter().all(|value| !value.is_nan()) {
        let regression = all.regression()?;
        let predicted = all.with_outputs.tr_mul(&regression);
        (regression, predicted)
    } else {
        // Outputs that are missing in some lines are regressed on the others.
        let mut regression = DMatrix::zeros(readings, outputs.names.len());
        for columns in outputs.missing_together() {
            let lines = outputs.lines_with(&columns);
            let all_inputs: Vec<usize> = (0..readings).collect();
            let weights = weights.map(|it| lines.iter().map(|line| it[*line]).collect::<Vec<_>>());
            let inputs = inputs.part(&lines, &all_inputs);
            let of_task =
                Covariances::new((&inputs, weights.as_deref()), &outputs.part(&lines, &columns));
            let parts = of_task.regression()?;
            for (column, part) in columns.iter().zip(parts.column_iter()) {
                regression.column_mut(*column).copy_from(&part);
            }
        }
        let predicted = regression.tr_mul(&(&all.of_readings * &regression));
        (regression, predicted)
    };
    let predicted = (&predicted + predicted.transpose()) * 0.5;
    let mut parts = DMatrix::zeros(readings, features);
    let directions = principal::directions(predicted, features);
    for (mut part, direction) in parts.column_iter_mut().zip(directions.column_iter()) {
        part.copy_from(&(&regression * direction));
    }
    Ok(parts)
}

/// Sums of products of readings, and of readings with outputs, all about their means.
struct Covariances {
    of_readings: DMatrix<f64>,
    with_outputs: DMatrix<f64>,
}

impl Covariances {
    fn new((inputs, weights): (&Table, Option<&[f64]>), outputs: &Table) -> Self {
        let readings = inputs.names.len();
        let means = [inputs, outputs].map(|table| means(table, weights)).concat();
        let products = products((inputs, weights), outputs, &means);
        let width = readings + outputs.names.len();
        let mut of_readings =
            DMatrix::from_fn(readings, readings, |i, j| products[i.min(j) * width + i.max(j)]);
        for reading in 0..readings {
            // A reading that never changes gets a part of 0, since it is 0 about its mean.
            let own = of_readings[(reading, reading)];
            of_readings[(reading, reading)] =
                if own > 0.0 { own * (1.0 + NOISE_FLOOR * NOISE_FLOOR) } else { 1.0 };
        }
        let with_outputs =
            DMatrix::from_fn(readings, width - readings, |i, o| products[i * width + readings + o]);
        Self { of_readings, with_outputs }
    }

    /// Regression of the outputs on the readings.
    fn regression(&self) -> Result<DMatrix<f64>> {
        let decomposed = self.of_readings.clone().cholesky().ok_or_else(no_regression)?;
        Ok(decomposed.solve(&self.with_outputs))
    }
}

/// Sums Σ zᵢ·zⱼ over all frames for every i ≤ j, with z the readings and then the outputs, about their
/// means, times the frame's weight. Pieces are added in their order, whatever the number of threads.
pub(super) fn products(
    (readings, weights): (&Table, Option<&[f64]>),
    targets: &Table,
    means: &[f64],
) -> Vec<f64> {
    let width = means.len();
    let (inputs, outputs) = (readings.names.len(), targets.names.len());
    let of_piece = |piece| {
        let mut sums = vec![0.0; width * width];
        let readings = parallel::piece(&readings.values, FRAMES_AT_ONCE * inputs, piece);
        let targets = parallel::piece(&targets.values, FRAMES_AT_ONCE * outputs, piece);
        let lines = readings.chunks_exact(inputs).zip(targets.chunks_exact(outputs));
        for (index, (readings, targets)) in lines.enumerate() {
            let weight = weights.map_or(1.0, |it| it[piece * FRAMES_AT_ONCE + index]);
            // Readings in f32, as the device has them.
            let readings = readings.iter().map(|reading| f64::from(*reading as f32));
            let values = readings.chain(targets.iter().copied());
            let z = values.zip(means).map(|(value, mean)| (value - mean) * weight);
            let z: Vec<f64> = z.collect();
            widest!(add_products(&z, inputs, &mut sums));
        }
        sums
    };
    sum(&parallel::map(readings.len().div_ceil(FRAMES_AT_ONCE), &of_piece))
}

/// Mean of each column, in which lines count by the squares of their `weights`.
pub(super) fn means(table: &Table, weights: Option<&[f64]>) -> Vec<f64> {
    let Some(weights) = weights else { return table.means() };
    let mut sums = vec![0.0; table.names.len()];
    for (line, weight) in table.lines().zip(weights) {
        sums.iter_mut().zip(line).for_each(|(sum, value)| *sum += value * weight * weight);
    }
    let all: f64 = weights.iter().map(|weight| weight * weight).sum();
    sums.iter_mut().for_each(|sum| *sum /= all);
    sums
}

/// Sums of lists of the same length, added in their order.
pub(crate) fn sum(lists: &[Vec<f64>]) -> Vec<f64> {
    let mut total = vec![0.0; lists.first().map_or(0, Vec::len)];
    for list in lists {
        total.iter_mut().zip(list).for_each(|(total, value)| *total += value);
    }
    total
}

/// Adds the products zᵢ·zⱼ to the sums, for i among the inputs and j ≥ i.
#[inline(always)]
pub(crate) fn add_products(z: &[f64], inputs: usize, sums: &mut [f64]) {
    for (i, sums) in sums.chunks_exact_mut(z.len()).take(inputs).enumerate() {
        let factor = z[i];
        sums[i..].iter_mut().zip(&z[i..]).for_each(|(sum, z)| *sum += factor * z);
    }
}

#[cfg(test)]
mod tests;

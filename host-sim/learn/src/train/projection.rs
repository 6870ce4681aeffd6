//! Projection of all readings of a frame to a few features: those directions that tell most about the
//! outputs.
//!
//! Reduced-rank regression (Izenman, J. Multivariate Anal. 5, 1975): let B be the least-squares
//! solution, and V the first F eigenvectors of Bᵀ·Σxx·B, the covariance of its predictions. Of all
//! matrices of rank F, B·V·Vᵀ then predicts the outputs with the least squared error.
//!
//! The features are x·B·V, in the outputs' unit. Principal components would also spend directions on
//! common changes of the readings that no output needs. `docs/training.md` has measurements.
//!
//! Few outputs have few such directions, and readings tell more of them than any linear map: where a contact is, is a
//! ratio of sums. So with fewer outputs than features, their products are regressed on as well.

use std::borrow::Cow;

use nalgebra::DMatrix;
use taxel_core::blob::Front;
use taxel_core::projection::Projection;
use taxel_data::{Dataset, Table, require, widest};

use super::principal;
use crate::error::{Error, Result, no_regression};
use crate::{infer, parallel};

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
                "give from 1 to {}, fewer than the {readings} readings and no more than the {} outputs and their products of two or \
                 three",
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
    let frames = with_targets(dataset, features);
    let parts = directions(&frames, features.min(frames.outputs.names.len()))?;
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

/// Projection of so many `readings` with the given `parameters`.
///
/// # Panics
/// If `parameters` are not as many as [`fit`] makes for so many readings.
pub fn view(parameters: &[f32], readings: usize) -> Projection<'_> {
    Projection::new(readings, parameters.len() / (readings + 1), parameters)
        .expect("a projection of these readings")
}

/// Projects every line of `readings` as the device does: `lines × features`, in the outputs' unit.
pub fn features(projection: Projection<'_>, readings: &[f64]) -> Vec<f64> {
    let front = Front { outputs: 0, touch: None, projection: Some(projection) };
    infer::given(&front, readings).0.into_owned()
}

/// Frames of `dataset` with what the projection has to tell for outputs: the outputs, and where these are fewer than
/// `features`, their products of two or three factors. Then all are about their means and have a standard deviation of 1.
pub fn with_targets(dataset: &Dataset, features: usize) -> Cow<'_, Dataset> {
    let all = factors(&dataset.outputs, features);
    if all.len() == dataset.outputs.names.len() {
        return Cow::Borrowed(dataset);
    }
    let outputs = standardised(&dataset.outputs);
    let of_line = |line: &[f64]| -> Vec<f64> {
        let product = |factors: &Vec<usize>| factors.iter().map(|factor| line[*factor]).product();
        all.iter().map(product).collect()
    };
    let values = outputs.lines().flat_map(of_line).collect();
    let names = (1..=all.len()).map(|product| format!("product{product}")).collect();
    let outputs = standardised(&Table { names, values });
    Cow::Owned(Dataset { outputs, ..dataset.clone() })
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
fn directions(frames: &Dataset, features: usize) -> Result<DMatrix<f64>> {
    let all = with_noise(frames);
    let is_complete = frames.outputs.values.iter().all(|value| !value.is_nan());
    let regression = if is_complete {
        solved(all.of_inputs.clone(), &all.with_outputs)?
    } else {
        by_task(frames, |frames| {
            let of_task = with_noise(frames);
            solved(of_task.of_inputs, &of_task.with_outputs)
        })?
    };
    let predicted = if is_complete {
        all.with_outputs.tr_mul(&regression)
    } else {
        regression.tr_mul(&(&all.of_inputs * &regression))
    };
    Ok(strongest(&regression, &predicted, features))
}

/// Directions of the inputs that tell most of the outputs by a `regression`, one a column; `predicted` is the covariance of
/// what it predicts.
pub(super) fn strongest(
    regression: &DMatrix<f64>,
    predicted: &DMatrix<f64>,
    features: usize,
) -> DMatrix<f64> {
    let directions = principal::directions((predicted + predicted.transpose()) * 0.5, features);
    let mut parts = DMatrix::zeros(regression.nrows(), features);
    for (mut part, direction) in parts.column_iter_mut().zip(directions.column_iter()) {
        part.copy_from(&(regression * direction));
    }
    parts
}

/// Regression of all outputs on the inputs, one a column: `fit` is given outputs that are missing in the same frames, in the
/// frames that have them.
pub(super) fn by_task(
    frames: &Dataset,
    mut fit: impl FnMut(&Dataset) -> Result<DMatrix<f64>>,
) -> Result<DMatrix<f64>> {
    let (inputs, outputs) = (frames.inputs.names.len(), frames.outputs.names.len());
    let mut regression = DMatrix::zeros(inputs, outputs);
    for columns in frames.outputs.missing_together() {
        let lines = frames.outputs.lines_with(&columns);
        let outputs = frames.outputs.part(&lines, &columns);
        let parts = fit(&Dataset { outputs, ..frames.subset(&lines) })?;
        for (column, part) in columns.iter().zip(parts.column_iter()) {
            regression.column_mut(*column).copy_from(&part);
        }
    }
    Ok(regression)
}

/// Solution X of the normal equations `of_inputs`·X = `with_outputs`.
pub(super) fn solved(of_inputs: DMatrix<f64>, with_outputs: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    Ok(of_inputs.cholesky().ok_or_else(no_regression)?.solve(with_outputs))
}

/// Sums of products of inputs, of inputs with outputs, and of outputs, about given means.
#[derive(Clone)]
pub(super) struct Moments {
    pub of_inputs: DMatrix<f64>,
    pub with_outputs: DMatrix<f64>,
    pub of_outputs: f64,
}

impl Moments {
    pub fn new(frames: &Dataset, means: &[f64]) -> Self {
        let (n, width) = (frames.inputs.names.len(), means.len());
        let sums = products(frames, means);
        let square = |(place, value): (usize, &f64)| {
            let weight = frames.weights.as_ref().map_or(1.0, |it| it[place / (width - n)]);
            (weight * (value - means[n + place % (width - n)])).powi(2)
        };
        Self {
            of_inputs: DMatrix::from_fn(n, n, |i, j| sums[i.min(j) * width + i.max(j)]),
            with_outputs: DMatrix::from_fn(n, width - n, |i, o| sums[i * width + n + o]),
            of_outputs: frames.outputs.values.iter().enumerate().map(square).sum(),
        }
    }
}

/// Moments of `frames` about their means, with the noise floor added to every reading.
fn with_noise(frames: &Dataset) -> Moments {
    let mut moments = Moments::new(frames, &means(frames));
    for reading in 0..frames.inputs.names.len() {
        // A reading that never changes gets a part of 0, since it is 0 about its mean.
        let own = &mut moments.of_inputs[(reading, reading)];
        *own = if *own > 0.0 { *own * (1.0 + NOISE_FLOOR * NOISE_FLOOR) } else { 1.0 };
    }
    moments
}

/// Sums Σ zᵢ·zⱼ over all frames for every i ≤ j, with z the inputs and then the outputs, about their
/// means, times the frame's weight. Pieces are added in their order, whatever the number of threads.
fn products(frames: &Dataset, means: &[f64]) -> Vec<f64> {
    let width = means.len();
    let (inputs, outputs) = (frames.inputs.names.len(), frames.outputs.names.len());
    let of_piece = |piece| {
        let mut sums = vec![0.0; width * width];
        let readings = parallel::piece(&frames.inputs.values, FRAMES_AT_ONCE * inputs, piece);
        let targets = parallel::piece(&frames.outputs.values, FRAMES_AT_ONCE * outputs, piece);
        let lines = readings.chunks_exact(inputs).zip(targets.chunks_exact(outputs));
        for (line, (readings, targets)) in (piece * FRAMES_AT_ONCE..).zip(lines) {
            let weight = frames.weights.as_ref().map_or(1.0, |it| it[line]);
            // Readings in f32, as the device has them.
            let readings = readings.iter().map(|reading| f64::from(*reading as f32));
            let values = readings.chain(targets.iter().copied());
            let z = values.zip(means).map(|(value, mean)| (value - mean) * weight);
            let z: Vec<f64> = z.collect();
            widest!(add_products(&z, inputs, &mut sums));
        }
        sums
    };
    sum(&parallel::map(frames.frames().div_ceil(FRAMES_AT_ONCE), &of_piece))
}

/// Mean of each input and of each output, to which frames count by the squares of their weights.
pub(super) fn means(frames: &Dataset) -> Vec<f64> {
    let of_table = |table: &Table| {
        let Some(weights) = &frames.weights else { return table.means() };
        let mut sums = vec![0.0; table.names.len()];
        for (line, weight) in table.lines().zip(weights) {
            sums.iter_mut().zip(line).for_each(|(sum, value)| *sum += value * weight * weight);
        }
        let all: f64 = weights.iter().map(|weight| weight * weight).sum();
        sums.iter_mut().for_each(|sum| *sum /= all);
        sums
    };
    [&frames.inputs, &frames.outputs].map(of_table).concat()
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

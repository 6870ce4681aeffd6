//! Features of a touch: where it is by a linear map of its shape, what else tells of the outputs, and its strength.

use std::ops::Range;

use nalgebra::DMatrix;
use taxel_data::{Dataset, columns};

use super::super::projection::{
    Moments, USUAL_FEATURES, about_means, by_task, means, solved, strongest, with_targets,
};
use super::{FittedTouch, Kind, examples_of};
use crate::error::{Result, no_regression};

/// Penalties on the map that are tried, each as a share of the mean variance of an input.
const PENALTIES: [f64; 4] = [1e-5, 1e-3, 1e-1, 10.0];
/// Successive parts of the frames, each of which the map is judged on that is fitted to the others.
const PARTS: usize = 5;
/// Spread of other features over that of places.
const SHARE: f64 = 0.5;

/// Where touches are, by their shape.
#[derive(Debug, Clone)]
pub struct Places {
    /// Linear map of shape and strength to places, one a column.
    map: DMatrix<f64>,
    /// Places of the examples that have them, by maps that were fitted to others (`frames × places`).
    pub held_out: DMatrix<f64>,
}

/// Projection of shape and strength to features, for `frames` of a group of outputs: the `places` of the data set, if it has
/// any; the outputs themselves, by [regression](super::super::projection::fit), but for places on a mat; and the strength.
/// It is f₀, then each input's part in every feature (`inputs × features`).
///
/// # Errors
/// [`Error`](crate::Error) for data without a regression, or with a projection beyond f32.
pub fn projection(
    kind: Kind,
    frames: &Dataset,
    places: Option<&Places>,
    features: Option<usize>,
) -> Result<Vec<f32>> {
    let most = features.unwrap_or(USUAL_FEATURES).max(2);
    let inputs = frames.inputs.names.len();
    let is_mat = places.is_some() && cells(&frames.inputs.names[..inputs - 1]).is_some();
    let of_places = places.map_or(0, |places| places.map.ncols());
    let others = most.saturating_sub(of_places + 1);
    let others = if kind == Kind::Place && is_mat { 0 } else { others };
    let mut blocks: Vec<DMatrix<f64>> =
        places.map(|places| places.map.clone()).into_iter().collect();
    if others > 0 {
        blocks.push(regressed(frames, others)?);
    }
    blocks.push(DMatrix::from_fn(inputs, 1, |input, _| f64::from(u8::from(input + 1 == inputs))));
    let spread = |block: &DMatrix<f64>| spread(frames, block);
    let largest = spread(&blocks[0]);
    for block in &mut blocks[1..] {
        let own = spread(block);
        *block *= if own > 0.0 { SHARE * largest / own } else { 0.0 };
    }
    let count = blocks.iter().map(DMatrix::ncols).sum();
    let mut parts = DMatrix::zeros(inputs, count);
    let mut columns = blocks.iter().flat_map(DMatrix::column_iter);
    parts.column_iter_mut().zip(&mut columns).for_each(|(mut to, from)| to.copy_from(&from));
    about_means(parts.transpose().as_slice(), &frames.inputs.means())
}

/// Largest standard deviation of the features with these parts.
fn spread(frames: &Dataset, parts: &DMatrix<f64>) -> f64 {
    let inputs = DMatrix::from_row_slice(frames.frames(), parts.nrows(), &frames.inputs.values);
    let features = inputs * parts;
    features.column_iter().map(|column| column.variance().sqrt()).fold(0.0, f64::max)
}

impl Places {
    /// Map of shapes that `touch` makes to the places that `dataset` has as outputs; `None` without any. It is a ridge
    /// regression towards the centroid, where inputs are cells of a mat: what data cannot tell stays as a centroid has it.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for data without a regression.
    pub fn fit(touch: &FittedTouch, dataset: &Dataset) -> Result<Option<Self>> {
        let names = &dataset.outputs.names;
        let is_place = |index: &usize| columns::is_place(&names[*index]);
        let of_places: Vec<usize> = (0..names.len()).filter(is_place).collect();
        if of_places.is_empty() {
            return Ok(None);
        }
        let lines = examples_of(&dataset.outputs.lines_with(&of_places));
        if lines.is_empty() {
            return Ok(None);
        }
        let outputs = dataset.outputs.part(&lines, &of_places);
        let touch = FittedTouch { kind: Kind::Place, ..touch.clone() };
        let frames = touch.apply(&Dataset { outputs, ..dataset.subset(&lines) });
        let cells = cells(&dataset.inputs.names);
        let Regression { map, of_parts, .. } = regression(&frames, true, cells.as_ref())?;
        let means = frames.inputs.means();
        let mut held_out = DMatrix::zeros(frames.frames(), map.ncols());
        for (part, map) in parts(frames.frames()).zip(&of_parts) {
            let value = |line: usize, input: usize| {
                frames.inputs.values[(part.start + line) * means.len() + input] - means[input]
            };
            let inputs = DMatrix::from_fn(part.len(), means.len(), value);
            held_out.rows_mut(part.start, part.len()).copy_from(&(inputs * map));
        }
        Ok(Some(Self { map, held_out }))
    }
}

/// Directions of shape and strength that tell most of the outputs of `frames`, so many of them or fewer, one a column.
fn regressed(frames: &Dataset, count: usize) -> Result<DMatrix<f64>> {
    let frames = with_targets(frames, count);
    let inputs = frames.inputs.names.len();
    let mut of_inputs = DMatrix::zeros(inputs, inputs);
    let map = by_task(&frames, |frames| {
        let Regression { map, moments, .. } = regression(frames, false, None)?;
        of_inputs += moments.of_inputs;
        Ok(map)
    })?;
    let predicted = map.tr_mul(&(&of_inputs * &map));
    Ok(strongest(&map, &predicted, count.min(frames.outputs.names.len())))
}

/// Ridge regression of outputs on inputs.
struct Regression {
    /// Regression on all frames, one output a column.
    map: DMatrix<f64>,
    /// Moments of the frames.
    moments: Moments,
    /// Regression on all frames but those of each part.
    of_parts: Vec<DMatrix<f64>>,
}

/// Successive parts of so many frames.
pub(super) fn parts(frames: usize) -> impl Iterator<Item = Range<usize>> {
    let length = frames.div_ceil(PARTS).max(1);
    (0..frames).step_by(length).map(move |start| start..frames.min(start + length))
}

/// Ridge regression of the outputs of `frames`, none of which is missing, on their inputs. That of places is one on the
/// `shape_alone`, and towards the centroid if there are `cells`. The penalty is the one with the least error on frames that
/// the regression was not fitted to.
fn regression(
    frames: &Dataset,
    shape_alone: bool,
    cells: Option<&DMatrix<f64>>,
) -> Result<Regression> {
    let mean = means(frames);
    let of_part =
        |lines: Range<usize>| Moments::new(&frames.subset(&lines.collect::<Vec<_>>()), &mean);
    let parts: Vec<Moments> = parts(frames.frames()).map(of_part).collect();
    let (first, others) = parts.split_first().ok_or_else(no_regression)?;
    let whole = others.iter().fold(first.clone(), |sum, part| sum.plus(part, 1.0));
    let prior = match cells {
        Some(cells) => whole.centroid(cells, &mean)?,
        None => DMatrix::zeros(whole.of_inputs.nrows(), frames.outputs.names.len()),
    };
    let map = |moments: &Moments, penalty| moments.map(&prior, penalty, shape_alone);
    let mut best = (f64::INFINITY, PENALTIES[0], vec![]);
    for penalty in PENALTIES {
        let of_part = |part: &Moments| map(&whole.plus(part, -1.0), penalty);
        let of_parts = parts.iter().map(of_part).collect::<Result<Vec<_>>>()?;
        let error = parts.iter().zip(&of_parts).map(|(part, map)| part.error(map)).sum();
        if error < best.0 {
            best = (error, penalty, of_parts);
        }
    }
    let (_, penalty, of_parts) = best;
    Ok(Regression { map: map(&whole, penalty)?, moments: whole, of_parts })
}

/// Column and row of each cell, and 0 for the strength, if the inputs are cells of a mat: `inputs × 2`.
fn cells(names: &[String]) -> Option<DMatrix<f64>> {
    let cell = |name: &String| columns::cell_of(name).map(|([row, column], _)| [column, row]);
    let cells: Vec<[usize; 2]> = names.iter().map(cell).collect::<Option<_>>()?;
    let values = cells.as_flattened().iter().map(|at| *at as f64).chain([0.0; 2]);
    Some(DMatrix::from_row_iterator(names.len() + 1, 2, values))
}

impl Moments {
    fn plus(&self, other: &Self, factor: f64) -> Self {
        Self {
            of_inputs: &self.of_inputs + &other.of_inputs * factor,
            with_outputs: &self.with_outputs + &other.with_outputs * factor,
            of_outputs: self.of_outputs + other.of_outputs * factor,
        }
    }

    /// Regression of the outputs on the two coordinates of the centroid, as a map of the inputs with these `means`.
    fn centroid(&self, cells: &DMatrix<f64>, means: &[f64]) -> Result<DMatrix<f64>> {
        // About the mean place: changes of either sign may sum to anything.
        let strength = cells.nrows() - 1;
        let mut cells = cells.clone();
        for mut along in cells.column_iter_mut() {
            let mean: f64 = along.iter().zip(means).map(|(cell, share)| cell * share).sum();
            along.rows_mut(0, strength).add_scalar_mut(-mean);
        }
        let mut of_centroid = cells.tr_mul(&(&self.of_inputs * &cells));
        let least = 1e-9 * of_centroid.trace().max(f64::MIN_POSITIVE);
        (0..2).for_each(|i| of_centroid[(i, i)] += least);
        Ok(&cells * solved(of_centroid, &cells.tr_mul(&self.with_outputs))?)
    }

    /// Regression of the outputs on the inputs with a `penalty` on what differs from `prior`, or on the shape alone.
    fn map(&self, prior: &DMatrix<f64>, penalty: f64, shape_alone: bool) -> Result<DMatrix<f64>> {
        let mut normal = self.of_inputs.clone();
        let strength = normal.nrows() - 1;
        let mean = (0..strength).map(|i| normal[(i, i)]).sum::<f64>() / strength as f64;
        (0..=strength).for_each(|i| normal[(i, i)] += (penalty * mean).max(f64::MIN_POSITIVE));
        let mut left = &self.with_outputs - &self.of_inputs * prior;
        if shape_alone {
            normal.row_mut(strength).fill(0.0);
            normal.column_mut(strength).fill(0.0);
            normal[(strength, strength)] = 1.0;
            left.row_mut(strength).fill(0.0);
        }
        Ok(prior + solved(normal, &left)?)
    }

    /// Squared error of a `map` on these frames.
    fn error(&self, map: &DMatrix<f64>) -> f64 {
        let along = map.dot(&self.with_outputs);
        let square = map.dot(&(&self.of_inputs * map));
        self.of_outputs - 2.0 * along + square
    }
}

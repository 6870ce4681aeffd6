//! Training by recursion on frames that come piece by piece, however many they are.
//!
//! All that stands before the output weights is taken from the first frames: ranges, the projection, centres and widths
//! (refined or not), and the number format. The recursion then takes in all frames, these first ones included, each
//! once. Memory is that of the first frames, of a piece, and of the recursion.

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;
use taxel_core::rbf::Format;
use taxel_data::{BadValue, Dataset, Progress, RowTable, Table, require};

use super::format::{self, FittedNetwork, Held, Targets, expanded_f32};
use super::least_squares::{Design, Recursion, predict};
use super::tasks::Factors;
use super::{
    Examples, HiddenLayer, Layers, Options, Recursive, Refinement, Samples, Solver, Trained,
    projection, refine,
};
use crate::error::Result;

/// Number of first frames that layers are taken from, unless a user says otherwise.
pub const FIRST_FRAMES: usize = 20_000;
/// Most of the next frames that an error is measured on.
const MOST_NEXT: usize = 2000;
/// Factor on the largest harmless share of rounding that weights of all frames may reach: the format was chosen by the
/// first ones.
const MARGIN: f64 = 2.0;

/// Frames that come piece by piece.
pub type Pieces<'p> = Box<dyn Iterator<Item = taxel_data::Result<Dataset>> + Send + 'p>;

/// Frames to train on, in the order in which they come.
pub struct Frames<'f> {
    /// First frames, which layers are taken from.
    pub first: &'f Dataset,
    /// Frames after these, in pieces with the same columns.
    pub rest: Pieces<'f>,
    /// Number of all frames, if it is known before the last one has come.
    pub count: Option<usize>,
    /// Frames that the learning curve's errors are measured on; `None` for the next frames, before these are taken in.
    pub test: Option<&'f Dataset>,
}

/// Error after so many frames: a point of the learning curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Learned {
    /// Number of frames taken in.
    pub frames: usize,
    /// Number of frames that the error was measured on.
    pub judged_frames: usize,
    /// Root mean square error of each output, in its unit, with weights in f64; NaN for one that these frames lack.
    pub rmse: Vec<f64>,
}

/// Trains one network for each row-wire, or one for all of them, by recursive least squares. Also returns the learning
/// curve.
///
/// With `refinement`, the layers are refined, on its examples and the first frames. A penalty a frame is counted over
/// all frames if their number is known, else over the first ones.
///
/// # Errors
/// As [`train`](super::train) and [`train_refined`](super::train_refined) for the first frames, any error of the pieces
/// after them, and [`BadValue`] for a piece with other columns.
pub fn train(
    frames: Frames<'_>,
    options: &Options,
    refinement: Option<(&Refinement, Examples<'_>)>,
    progress: &dyn Progress,
) -> Result<(Trained, Vec<Learned>)> {
    let first = frames.first;
    super::check(first, options)?;
    let start = Layers::start(first, options)?;
    let (layers, options) = match refinement {
        None => (start, *options),
        Some((settings, examples)) => {
            let layers = refine::refine(first, &start, options, settings, examples, progress)?;
            (layers, settings.options(options))
        }
    };
    fit(frames, &layers, &options, progress)
}

/// Fits the output weights of networks with these `layers` to all `frames`.
fn fit(
    mut frames: Frames<'_>,
    layers: &Layers<'_>,
    options: &Options,
    progress: &dyn Progress,
) -> Result<(Trained, Vec<Learned>)> {
    let first = frames.first;
    // What a format does to weights of the first frames decides on it: there is no second look at the others.
    let by_qr = Options { solver: Solver::Qr, ..*options };
    let chosen = super::fit(layers, &by_qr, progress)?;
    let format = chosen.networks.first().map_or(options.format, FittedNetwork::format);
    let covariance = options.initial_covariance(frames.count.unwrap_or(first.frames()));
    let parameters = layers.projection.as_deref();
    let test = frames.test.map(|test| projection::seen(parameters, test));
    let rows = layers.hidden.iter().enumerate().map(|(row, layer)| {
        let test = test.as_ref().map(|test| test.row_table(row));
        Row::new(&layers.seen.row_table(row), test, layer, options, format, covariance)
    });
    let mut rows: Vec<Row> = rows.collect::<Result<_>>()?;
    progress.stage("fit weights by recursion", frames.count.unwrap_or(0).div_ceil(first.frames()));
    let (mut piece, mut count) = (Some(Cow::Borrowed(first)), 0);
    while let Some(current) = piece {
        let absorb = || {
            let seen = projection::seen(parameters, &current);
            let of_row = |(row, it): (usize, &mut Row)| it.absorb(&seen.row_table(row), count);
            rows.par_iter_mut().enumerate().for_each(of_row);
        };
        let (next, ()) = rayon::join(|| frames.rest.next(), absorb);
        count += current.frames();
        piece = next.transpose()?.map(Cow::Owned);
        if let Some(next) = &piece {
            same_columns(first, next)?;
        }
        progress.step();
    }
    rows.iter_mut().for_each(|row| row.end(count));
    let curve = curve(&rows);
    let networks = rows.into_par_iter().map(|row| row.network(format));
    let networks = networks.collect::<Result<_>>()?;
    Ok((Trained { projection: layers.projection.clone(), networks, frames: count }, curve))
}

/// Checks that the frames of `next` have the columns of the `first` ones.
fn same_columns(first: &Dataset, next: &Dataset) -> std::result::Result<(), BadValue> {
    let names = |set: &Dataset| [&set.inputs, &set.outputs].map(|table| table.names.join(", "));
    let (first, next) = (names(first), names(next));
    require(first == next, "columns", next.join(" and "), || {
        format!("give each piece those of the first frames, {}", first.join(" and "))
    })
}

/// Errors of all rows together.
fn curve(rows: &[Row]) -> Vec<Learned> {
    let points = rows.first().map_or(&[][..], |row| &row.curve).iter().enumerate();
    let of_rows = points.map(|(point, (frames, judged, _))| Learned {
        frames: *frames,
        judged_frames: *judged,
        rmse: rows
            .iter()
            .flat_map(|row| row.curve[point].2.iter().map(|mean_square| mean_square.sqrt()))
            .collect(),
    });
    of_rows.collect()
}

/// Recursion of one network.
struct Row {
    held: Box<dyn Held>,
    /// First frames.
    table: RowTable,
    targets: Targets,
    /// Recursion of the frames that have some columns, with these columns. All carry all outputs, so that one can be
    /// continued as two where a piece has columns apart that were together so far.
    recursions: Vec<(Vec<usize>, Recursion)>,
    test: Option<RowTable>,
    /// Frames taken in, frames judged, and mean squared error of each output.
    curve: Vec<(usize, usize, Vec<f64>)>,
}

impl Row {
    fn new(
        first: &RowTable,
        test: Option<RowTable>,
        layer: &HiddenLayer,
        options: &Options,
        format: Format,
        initial_covariance: f64,
    ) -> Result<Self> {
        let options = Options { spread: layer.spread, ..*options };
        let samples = Samples::new(first);
        let held = format::held(&samples, layer, &options, format)?;
        let targets = Targets::new(&first.outputs);
        let settings = match options.solver {
            Solver::Rls(settings) => settings,
            Solver::Qr => Recursive::default(),
        };
        let regressors = held.design(first).regressors();
        let recursion =
            Recursion::new(regressors, targets.outputs(), initial_covariance, &settings);
        let recursions = vec![((0..targets.outputs()).collect(), recursion)];
        Ok(Self { held, targets, recursions, test, curve: vec![], table: first.clone() })
    }

    /// Takes in the frames of `table`, of which so many came `before`.
    fn absorb(&mut self, table: &RowTable, before: usize) {
        let targets = self.targets.of_others(&table.outputs).deviations;
        self.part_columns(&targets);
        let design = self.held.design(table);
        let frames = table.inputs.len();
        let mut start = 0;
        while start < frames {
            let end = frames.min(checkpoint_after(before + start) - before);
            if self.test.is_none() && is_checkpoint(before + start) {
                let next = start..end.min(start + MOST_NEXT);
                let squares = self.mean_squares(table, next.clone());
                self.curve.push((before + start, next.len(), squares));
            }
            for (columns, recursion) in &mut self.recursions {
                absorb_part(
                    recursion,
                    (&*self.held, &*design),
                    table,
                    (&targets, columns),
                    start..end,
                );
            }
            if is_checkpoint(before + end) {
                let point = self.judged(before + end);
                self.curve.extend(point);
            }
            start = end;
        }
    }

    /// Continues recursions as several, where columns of theirs are missing in different lines of `targets`.
    fn part_columns(&mut self, targets: &Table) {
        let groups = targets.missing_together();
        let parted = self.recursions.drain(..).flat_map(|(columns, recursion)| {
            let of_group = |group: &Vec<usize>| -> Vec<usize> {
                columns.iter().copied().filter(|column| group.contains(column)).collect()
            };
            let parts: Vec<_> =
                groups.iter().map(of_group).filter(|part| !part.is_empty()).collect();
            parts.into_iter().map(move |part| (part, recursion.clone()))
        });
        self.recursions = parted.collect();
    }

    /// Factors of all frames so far.
    fn factors(&self) -> Factors {
        let of_columns = |(columns, recursion): &(Vec<usize>, Recursion)| {
            (columns.clone(), recursion.factor().of_outputs(columns))
        };
        Factors(self.recursions.iter().map(of_columns).collect())
    }

    /// Error on the test frames after so many frames, if there are any.
    fn judged(&self, frames: usize) -> Option<(usize, usize, Vec<f64>)> {
        let test = self.test.as_ref()?;
        let judged = test.inputs.len();
        Some((frames, judged, self.mean_squares(test, 0..judged)))
    }

    /// Ends the learning curve after the last of all `frames`.
    fn end(&mut self, frames: usize) {
        if self.curve.last().is_none_or(|(last, ..)| *last < frames) {
            self.curve.extend(self.judged(frames));
        }
    }

    /// Mean squared error of each output on the `lines` of `table`, with the weights so far.
    fn mean_squares(&self, table: &RowTable, lines: Range<usize>) -> Vec<f64> {
        let weights = self.factors().weights();
        let computed = self.targets.outputs();
        let mut predicted = predict(&*self.held.design(table), lines.clone(), &weights, computed);
        for line in predicted.chunks_exact_mut(computed) {
            line.iter_mut().zip(&self.targets.means).for_each(|(value, mean)| *value += mean);
        }
        let range = lines.start * computed..lines.end * computed;
        let truth = Table {
            names: table.outputs.names.clone(),
            values: table.outputs.values[range].to_vec(),
        };
        let squares = truth.squared_errors(&predicted).into_iter().zip(truth.counts());
        squares.map(|(square, count)| square / count as f64).collect()
    }

    /// Network with the weights of all frames.
    fn network(self, format: Format) -> Result<FittedNetwork> {
        let Self { held, table, targets, .. } = &self;
        let factors = self.factors();
        let network = held.network(&factors, targets)?;
        if format == Format::F32
            && expanded_f32::worst_share(&network, table) > MARGIN * expanded_f32::HARMLESS
        {
            let rule = format!(
                "the weights of all frames have grown so large, against those of the first ones, that its fast formula \
                 for distances loses accuracy: give the format {}",
                Format::F32Direct.name()
            );
            return Err(BadValue::new("format", format.name(), rule).into());
        }
        let left = format::left(&**held, table, targets, &factors);
        network.unless_lost(table, targets, &left)
    }
}

/// Takes those frames of a `range` of `table` into a recursion that have its columns.
fn absorb_part(
    recursion: &mut Recursion,
    (held, design): (&dyn Held, &dyn Design),
    table: &RowTable,
    (targets, columns): (&Table, &[usize]),
    range: Range<usize>,
) {
    let has = |line: &usize| columns.iter().all(|column| !targets.line(*line)[*column].is_nan());
    let is_complete = |line: usize| targets.line(line).iter().all(|value| !value.is_nan());
    if range.clone().all(is_complete) {
        return recursion.absorb(design, &targets.values, range);
    }
    let lines: Vec<usize> = range.filter(has).collect();
    let all = |table: &Table| (0..table.names.len()).collect::<Vec<_>>();
    let mut targets = targets.part(&lines, &all(targets)).values;
    // Columns of other recursions take no part.
    targets.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = 0.0);
    let inputs = table.inputs.part(&lines, &all(&table.inputs));
    let part = RowTable { inputs, outputs: table.outputs.part(&lines, &[]), ..*table };
    recursion.absorb(&*held.design(&part), &targets, 0..lines.len());
}

/// Whether an error is measured after so many frames: 10, 20, 50, 100, 200, …
fn is_checkpoint(frames: usize) -> bool {
    frames >= 10 && checkpoint_after(frames - 1) == frames
}

/// Number of frames above `frames` after which an error is measured next.
fn checkpoint_after(frames: usize) -> usize {
    let decades = (1..19).map(|power| 10_usize.pow(power));
    let mut points = decades.flat_map(|ten| [ten, 2 * ten, 5 * ten]);
    points.find(|point| *point > frames).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests;

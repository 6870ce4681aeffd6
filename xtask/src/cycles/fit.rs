//! Prices of pieces of code, from frames that were measured: by least squares.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use taxel_learn::cost::{Pieces, Price};

use super::regions::Count;
use super::told::Frame;
use crate::process::Outcome;

/// Ratio of the least to the largest singular value from which on prices can be told apart.
const LEAST_SINGULAR: f64 = 1e-9;

/// Digits behind the point of prices of compiled code, which are means.
const MEAN_DIGITS: i32 = 3;

/// The prices that fit all `frames` best, in the order of their pieces' names.
///
/// # Errors
/// The frames do not tell the prices of two pieces apart, or a routine in assembly executes other instructions than
/// its pieces say.
pub fn prices(frames: &[Frame]) -> Outcome<Vec<(String, Price)>> {
    let assembly: Vec<Equation<'_>> = frames
        .iter()
        .filter(|frame| frame.assembly.instructions > 0)
        .map(|frame| Equation::new(&frame.pieces.assembly, frame.assembly, 1.0))
        .collect();
    let compiled: Vec<Equation<'_>> = frames
        .iter()
        .map(|frame| {
            let unit = frame.whole.instructions as f64;
            Equation::new(&frame.pieces.compiled, frame.compiled(), unit)
        })
        .collect();
    let exact: Vec<(String, Price)> = solve(&assembly)?
        .into_iter()
        .map(|(name, [instructions, cycles, flash])| {
            (name.to_owned(), [instructions.round(), cycles.round(), rounded(flash)])
        })
        .collect();
    hold_exact(frames, &exact)?;
    let means = solve(&compiled)?;
    let means = means.into_iter().map(|(name, price)| (name.to_owned(), price.map(rounded)));
    Ok(exact.into_iter().chain(means).collect())
}

/// Fails with the frame whose assembly executes most beside what these prices tell, if one does.
fn hold_exact(frames: &[Frame], prices: &[(String, Price)]) -> Outcome {
    let prices: BTreeMap<&str, Price> =
        prices.iter().map(|(name, price)| (name.as_str(), *price)).collect();
    let beside = |frame: &Frame| {
        let parts = frame.pieces.assembly.iter();
        let told: f64 = parts.map(|(name, times)| prices[name][0] * times as f64).sum();
        told - frame.assembly.instructions as f64
    };
    let worst = frames.iter().map(|frame| (beside(frame), frame));
    match worst.max_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs())) {
        Some((by, frame)) if by != 0.0 => Err(format!(
            "{}: its assembly is told by {by:+} instructions from what it executes; does \
             host-sim/learn/src/cost/routines.rs have the pieces that it has?",
            frame.what()
        )),
        _ => Ok(()),
    }
}

fn rounded(price: f64) -> f64 {
    let unit = 10_f64.powi(MEAN_DIGITS);
    // Not −0.
    (price * unit).round() / unit + 0.0
}

/// An equation: the prices of these pieces add up to these costs, in parts of `unit`.
struct Equation<'f> {
    pieces: &'f Pieces,
    costs: Price,
    unit: f64,
}

impl<'f> Equation<'f> {
    fn new(pieces: &'f Pieces, count: Count, unit: f64) -> Self {
        let Count { instructions, cycles, flash_cycles } = count;
        Self { pieces, costs: [instructions, cycles, flash_cycles].map(|it| it as f64), unit }
    }
}

/// Solves all equations by least squares.
fn solve<'f>(equations: &[Equation<'f>]) -> Outcome<Vec<(&'f str, Price)>> {
    let names = equations.iter().flat_map(|it| it.pieces.iter().map(|(name, _)| name));
    let mut place: BTreeMap<&str, usize> = names.map(|name| (name, 0)).collect();
    place.values_mut().enumerate().for_each(|(index, place)| *place = index);
    let mut matrix = DMatrix::zeros(equations.len(), place.len());
    let mut costs = DMatrix::zeros(equations.len(), 3);
    for (line, Equation { pieces, costs: of_line, unit }) in equations.iter().enumerate() {
        for (name, times) in pieces.iter() {
            matrix[(line, place[name])] = times as f64 / unit;
        }
        for (column, cost) in of_line.iter().enumerate() {
            costs[(line, column)] = cost / unit;
        }
    }
    // Columns of one length, so that pieces that are executed seldom count as well.
    let length = DVector::from_fn(place.len(), |column, _| matrix.column(column).norm());
    for (column, length) in length.iter().enumerate() {
        matrix.column_mut(column).unscale_mut(*length);
    }
    let decomposed = matrix.svd(true, true);
    let values = &decomposed.singular_values;
    if values.min() < LEAST_SINGULAR * values.max() {
        let direction = decomposed.v_t.as_ref().map(|v_t| v_t.row(values.imin()).into_owned());
        let direction = direction.ok_or("the decomposition has no directions")?;
        let mixed = place.iter().filter(|(_, column)| direction[**column].abs() > 1e-6);
        let mixed: Vec<&str> = mixed.map(|(name, _)| *name).collect();
        return Err(format!(
            "the designs do not tell the prices of these apart: {}",
            mixed.join("; ")
        ));
    }
    let solved = decomposed.solve(&costs, 0.0)?;
    let price = |column: usize| std::array::from_fn(|cost| solved[(column, cost)] / length[column]);
    Ok(place.into_iter().map(|(name, column)| (name, price(column))).collect())
}

//! What f32 leaves of a data set's columns: a device is given readings in f32, and gives estimates in f32.
//!
//! A column is refused by its name where little would be left of it, so that no input or output is lost in silence.

use taxel_data::error::{Role, quoted};
use taxel_data::{Dataset, Table};

use crate::error::{Error, Result};

/// Largest root mean square of what rounding to f32 adds to a column, as a share of the column's standard deviation.
pub const MOST_ROUNDING: f64 = 0.05;
/// Least range of a column that changes: one over a smaller one, in the units that readings are scaled to, is beyond
/// f32.
pub const LEAST_RANGE: f64 = 1e-28;
/// Largest magnitude of a value: its square, and sums of squares, stay far inside f64, and ranges stay inside f32.
pub const LARGEST: f64 = 1e30;
/// Least and largest range of an output whose deviations a reading model tells: it holds their squares.
pub const RANGE_OF_SQUARES: [f64; 2] = [1e-15, 1e15];
/// Range, relative to the values, that rounding in f64 explains: such a column does not change.
const CONSTANT: f64 = 4.0 * f64::EPSILON;

/// Checks that f32 holds every column of `dataset` that changes.
///
/// # Errors
/// [`Error`] for the first column that it does not hold.
pub fn check(dataset: &Dataset) -> Result<()> {
    for (role, table) in [(Role::Inputs, &dataset.inputs), (Role::Outputs, &dataset.outputs)] {
        let rounding = rounding(table);
        let columns = table.names.iter().zip(table.ranges()).zip(rounding);
        for ((name, range), rounding) in columns {
            if range[0] > range[1] {
                let message = format!("column {} has no value: leave it out", quoted(name));
                return Err(Error::unfit(message));
            }
            if let Some(why) = refused(range, rounding, role) {
                return Err(column(name, range, &why));
            }
        }
    }
    // Frames at rest need not be among those that are trained on.
    let at_rest = dataset.at_rest.iter().flat_map(|rest| rest.level.iter().zip(&rest.deviation));
    for (name, (level, deviation)) in dataset.inputs.names.iter().zip(at_rest) {
        if level.abs().max(*deviation) > LARGEST {
            let why =
                format!("values beyond {LARGEST:e} are too large for f32: check these frames");
            let column = quoted(name);
            return Err(Error::unfit(format!(
                "column {column} is {level:?} ± {deviation:?} at rest, and {why}"
            )));
        }
    }
    Ok(())
}

/// Checks that f32 holds the squares of all outputs of `dataset` that change, as a full reading model needs them.
///
/// # Errors
/// [`Error`] for the first output whose squares it does not hold.
pub fn check_squares(dataset: &Dataset) -> Result<()> {
    let [least, most] = RANGE_OF_SQUARES;
    let outputs = dataset.outputs.names.iter().zip(dataset.outputs.ranges());
    for (name, range) in outputs {
        let span = range[1] - range[0];
        if span > 0.0 && !(least..=most).contains(&span) {
            let why = format!(
                "a full reading model, which holds squares in f32, needs a range from {least:e} to {most:e}: multiply it by {}, \
                 or leave the reading model out",
                factor(span)
            );
            return Err(column(name, range, &why));
        }
    }
    Ok(())
}

fn column(name: &str, [low, high]: [f64; 2], why: &str) -> Error {
    Error::unfit(format!("column {} goes from {low:?} to {high:?}, and {why}", quoted(name)))
}

/// Power of ten that brings this `size` to about 1, as text.
fn factor(size: f64) -> String {
    format!("1e{}", -size.log10().floor())
}

/// Why a column cannot be used and what to do, from its `range` and what `rounding` adds to it.
fn refused([low, high]: [f64; 2], rounding: f64, role: Role) -> Option<String> {
    if low > high {
        return Some("has no value in the lines that are trained on: leave it out".into());
    }
    let (span, largest) = (high - low, low.abs().max(high.abs()));
    let leave = match role {
        Role::Inputs => ", or leave it out of the inputs",
        Role::Outputs => "",
    };
    if largest > LARGEST {
        return Some(format!(
            "values beyond {LARGEST:e} are too large for f32, which devices compute in: multiply it by {}{leave}",
            factor(largest)
        ));
    }
    if span <= CONSTANT * largest {
        return None;
    }
    if span < LEAST_RANGE {
        return Some(format!(
            "a range below {LEAST_RANGE:e} is lost in f32, which devices compute in: multiply it by {}{leave}",
            factor(span)
        ));
    }
    let step = f64::from((largest as f32).next_up()) - f64::from(largest as f32);
    let unit = 10_f64.powf(span.log10().floor());
    (rounding > MOST_ROUNDING).then(|| {
        format!(
            "numbers in f32, which devices compute in, are {step:?} apart there: subtract {} from it{leave}",
            (low / unit).floor() * unit
        )
    })
}

/// Root mean square of what rounding to f32 adds to each column, as a share of its standard deviation.
fn rounding(table: &Table) -> Vec<f64> {
    let mut squares = vec![[0.0; 2]; table.names.len()];
    let means = table.means();
    for line in table.lines() {
        for (([added, own], mean), value) in squares.iter_mut().zip(&means).zip(line) {
            if !value.is_nan() {
                *added += (f64::from(*value as f32) - value).powi(2);
                *own += (value - mean).powi(2);
            }
        }
    }
    squares.into_iter().map(|[added, own]: [f64; 2]| (added / own).sqrt()).collect()
}

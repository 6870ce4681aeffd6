//! Constants of a device's circuit, fitted to readings of known resistors.
//!
//! The device turns a column's share of the current into a reading with the constants that it has (`docs/readout.md`
//! has the equations). That is undone first. What is left of column k, while row m is active, is
//! x = c_k·g/(1 + R_m·Σg): g is the conductance of the resistor that is connected there, Σg that of the whole row,
//! c_k = true/assumed V_d·R_f,k/V_ref, and R_m the resistance of the row's source. The fit finds all c_k and R_m by
//! least squares of ln x.

use std::fmt;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use taxel_core::Wires;
use taxel_core::blob::Floats;
use taxel_firmware::circuit::Constants;

use crate::error::{Error, Result};

/// Largest relative difference between a reading and a known resistor before the constants are fitted: a larger one
/// is a resistor at another place, or no resistor.
const MOST_BEFORE: f64 = 0.5;
/// Largest relative difference that the fitted constants may leave.
const MOST_AFTER: f64 = 0.02;
/// Smallest relative difference between two loads of a row by which its source can be found.
const LEAST_LOAD_RATIO: f64 = 1.5;
/// Number of steps of the fit. Each leaves the square of the error before it, and three are enough.
const STEPS: usize = 10;

/// Constants of a circuit, as the device takes them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CircuitConstants {
    /// Reference voltage of the converter, in V.
    pub reference_v: f32,
    /// Voltage in V by which the active row is pulled below the others.
    pub drive_v: f32,
    /// Resistance in Ω between the drive and each row-wire.
    pub row_source_ohm: Vec<f32>,
    /// Feedback resistance in Ω of each column.
    pub feedback_ohm: Vec<f32>,
    /// Resistance in Ω in series with each column.
    pub series_ohm: Vec<f32>,
}

impl From<&Constants<'_>> for CircuitConstants {
    fn from(constants: &Constants<'_>) -> Self {
        Self {
            reference_v: constants.reference_v,
            drive_v: constants.drive_v,
            row_source_ohm: constants.row_source_ohm.iter().collect(),
            feedback_ohm: constants.feedback_ohm.iter().collect(),
            series_ohm: constants.series_ohm.iter().collect(),
        }
    }
}

impl CircuitConstants {
    /// The constants as the link carries them.
    pub fn for_link(&self) -> Constants<'_> {
        Constants {
            reference_v: self.reference_v,
            drive_v: self.drive_v,
            row_source_ohm: Floats::new(&self.row_source_ohm),
            feedback_ohm: Floats::new(&self.feedback_ohm),
            series_ohm: Floats::new(&self.series_ohm),
        }
    }
}

/// Known resistors, and what the device reads of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrangement {
    /// Conductance in S between each row and column, row after row; 0 where nothing is connected.
    pub known_s: Vec<f64>,
    /// Mean conductance in S that the device reads; 0 is open, NaN could not be read.
    pub read_s: Vec<f64>,
}

/// Differences between readings and known resistors, read/known − 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Differences {
    /// Root of the mean square.
    pub rms: f64,
    pub largest: f64,
}

impl Differences {
    /// Differences of these pairs of known and read conductances.
    fn new(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let (mut count, mut squares, mut largest) = (0, 0.0, 0.0_f64);
        for (known, read) in pairs.filter(|(known, _)| *known > 0.0) {
            let difference = known / read - 1.0;
            count += 1;
            squares += difference * difference;
            largest = largest.max(difference.abs());
        }
        Self { rms: (squares / f64::from(count.max(1))).sqrt(), largest }
    }
}

impl fmt::Display for Differences {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} % RMS, {:.3} % at most", 100.0 * self.rms, 100.0 * self.largest)
    }
}

/// Constants that were fitted, and how well.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Constants found. Those of wires without a resistor are as they were.
    pub constants: CircuitConstants,
    /// Number of readings that they were fitted to.
    pub readings: usize,
    /// Number of rows and of columns whose constants were found.
    pub rows: usize,
    /// Number of columns whose constants were found.
    pub columns: usize,
    /// Largest standard error of a row's source, in Ω.
    pub row_source_error_ohm: f64,
    /// Largest relative standard error of a column's factor V_d·R_f/V_ref.
    pub feedback_error: f64,
    /// Differences with the constants that the device had.
    pub before: Differences,
    /// Differences that the constants found leave.
    pub after: Differences,
}

/// A reading of a known resistor, with the device's constants undone.
struct Sample {
    row: usize,
    column: usize,
    /// Logarithm of the known current over the one that the device finds, without the row's source.
    log_ratio: f64,
    /// Conductance in S that loads the row's source.
    load_s: f64,
}

/// Fits constants to `arrangements` of `wires`, beginning with those that the device had, `before`.
///
/// Only the product V_d·R_f/V_ref of each column can be found. What all columns have in common goes to the drive
/// voltage, the rest to the feedback resistors. Series resistances stay as they are.
///
/// # Errors
/// [`Error::Data`] if a reading is not that of its resistor, if the resistors do not tell all constants of
/// their wires, or if no constants explain the readings.
pub fn fit(before: &CircuitConstants, wires: Wires, arrangements: &[Arrangement]) -> Result<Fit> {
    for (number, arrangement) in (1..).zip(arrangements) {
        check_places(arrangement, number, wires)?;
    }
    let samples: Vec<Sample> =
        arrangements.iter().flat_map(|a| samples(before, wires, a)).collect();
    check_loads(&samples, wires)?;

    let rows: Vec<usize> = used(wires.rows, samples.iter().map(|s| s.row));
    let columns: Vec<usize> = used(wires.columns, samples.iter().map(|s| s.column));
    let place = |list: &[usize], wire: usize| list.iter().position(|w| *w == wire).unwrap_or(0);
    let unknowns = columns.len() + rows.len();
    // Logarithms of 1/c_k, then R_m.
    let mut found = DVector::zeros(unknowns);
    for (i, row) in rows.iter().enumerate() {
        found[columns.len() + i] = f64::from(before.row_source_ohm[*row]);
    }
    let mut inverse = DMatrix::zeros(unknowns, unknowns);
    let mut residual_squares = 0.0;
    for _ in 0..STEPS {
        let mut normal = DMatrix::zeros(unknowns, unknowns);
        let mut right = DVector::zeros(unknowns);
        residual_squares = 0.0;
        for s in &samples {
            let (k, m) = (place(&columns, s.column), columns.len() + place(&rows, s.row));
            let drop = 1.0 + found[m] * s.load_s;
            let residual = s.log_ratio - found[k] - drop.ln();
            let slope = s.load_s / drop;
            normal[(k, k)] += 1.0;
            normal[(k, m)] += slope;
            normal[(m, k)] += slope;
            normal[(m, m)] += slope * slope;
            right[k] += residual;
            right[m] += residual * slope;
            residual_squares += residual * residual;
        }
        let decomposed = normal.cholesky().ok_or_else(|| undetermined(""))?;
        found += decomposed.solve(&right);
        inverse = decomposed.inverse();
    }
    let freedom = samples.len().saturating_sub(unknowns).max(1);
    let variance = residual_squares / freedom as f64;
    let error = |i: usize| (variance * inverse[(i, i)]).sqrt();
    let largest = |range: std::ops::Range<usize>| range.map(error).fold(0.0, f64::max);

    let mut constants = before.clone();
    for (i, row) in rows.iter().enumerate() {
        // Noise may leave a little less than nothing.
        constants.row_source_ohm[*row] = found[columns.len() + i].max(0.0) as f32;
    }
    let common = -(0..columns.len()).map(|i| found[i]).sum::<f64>() / columns.len() as f64;
    constants.drive_v = (f64::from(before.drive_v) * common.exp()) as f32;
    for (i, column) in columns.iter().enumerate() {
        let factor = (-found[i] - common).exp();
        constants.feedback_ohm[*column] = (f64::from(before.feedback_ohm[*column]) * factor) as f32;
    }

    let read_again = arrangements.iter().map(|a| convert(before, &constants, wires, &a.read_s));
    let after = Differences::new(
        arrangements
            .iter()
            .zip(read_again)
            .flat_map(|(a, read)| a.known_s.iter().copied().zip(read)),
    );
    if after.largest > MOST_AFTER {
        return Err(Error::failed(format!(
            "no constants explain these readings: the best ones leave {after}; check the values of the resistors, \
             their order, and that nothing else is connected"
        )));
    }
    let pairs = arrangements.iter().flat_map(|a| a.known_s.iter().zip(&a.read_s));
    Ok(Fit {
        constants,
        readings: samples.len(),
        rows: rows.len(),
        columns: columns.len(),
        row_source_error_ohm: largest(columns.len()..unknowns),
        feedback_error: largest(0..columns.len()),
        before: Differences::new(pairs.map(|(known, read)| (*known, *read))),
        after,
    })
}

/// Checks that the device reads something like the known resistors, at their places and nowhere else.
fn check_places(arrangement: &Arrangement, number: usize, wires: Wires) -> Result<()> {
    let Arrangement { known_s, read_s } = arrangement;
    for (place, (known, read)) in known_s.iter().zip(read_s).enumerate() {
        let name = place_name(place, wires);
        let says = if read.is_nan() {
            format!("{name} could not be read: `identify` shows failed samples")
        } else if *known == 0.0 && *read > 0.0 {
            let ohm = 1.0 / read;
            format!("{name} reads {ohm:.1} Ω, and nothing should be connected; remove the sensor")
        } else if *known > 0.0 && *read == 0.0 {
            let ohm = 1.0 / known;
            format!("{name} reads as open, and {ohm:.2} Ω should be connected")
        } else if *known > 0.0 && (known / read - 1.0).abs() > MOST_BEFORE {
            let (known, read) = (1.0 / known, 1.0 / read);
            format!("{name} reads {read:.2} Ω, and {known:.2} Ω should be connected")
        } else {
            continue;
        };
        return Err(Error::failed(format!("arrangement {number}: {says}")));
    }
    Ok(())
}

fn place_name(place: usize, wires: Wires) -> String {
    format!("r{}c{}", place / wires.columns + 1, place % wires.columns + 1)
}

/// Checks that the resistors tell all constants of their wires. A row's source lowers all its currents by one
/// factor, and a column's constants raise all currents of the column by one. The two are told apart at a place that
/// is read with two loads of its row, and then along every resistor from there.
fn check_loads(samples: &[Sample], wires: Wires) -> Result<()> {
    if samples.is_empty() {
        return Err(undetermined(": there are none"));
    }
    let mut loads = vec![(f64::INFINITY, 0.0_f64); wires.readings()];
    for s in samples {
        let (low, high) = &mut loads[s.row * wires.columns + s.column];
        (*low, *high) = (low.min(s.load_s), high.max(s.load_s));
    }
    let has_two = |(low, high): &(f64, f64)| *high > LEAST_LOAD_RATIO * low;
    let rows_loads = loads.chunks(wires.columns);
    let mut rows: Vec<bool> = rows_loads.map(|row| row.iter().any(has_two)).collect();
    let mut columns = vec![false; wires.columns];
    if !rows.contains(&true) {
        return Err(undetermined(
            ": no place is read both with few other resistors on its row and with many. Add an arrangement (a line of \
             the file), such as a single resistor at r1c1",
        ));
    }
    for _ in 0..wires.rows + wires.columns {
        for s in samples {
            columns[s.column] |= rows[s.row];
            rows[s.row] |= columns[s.column];
        }
    }
    match samples.iter().find(|s| !rows[s.row]) {
        Some(s) => Err(undetermined(&format!(
            ": row {} shares no column with a row that is read both with few resistors and with many",
            s.row + 1
        ))),
        None => Ok(()),
    }
}

fn undetermined(why: &str) -> Error {
    Error::failed(format!("these resistors do not determine the constants{why}"))
}

/// Numbers of the wires, of so many, that `of` names.
fn used(wires: usize, of: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut used = vec![false; wires];
    of.for_each(|wire| used[wire] = true);
    (0..wires).filter(|wire| used[*wire]).collect()
}

/// Sums over each column.
fn column_sums(wires: Wires, siemens: &[f64]) -> Vec<f64> {
    let column = |k: usize| siemens.iter().skip(k).step_by(wires.columns).sum();
    (0..wires.columns).map(column).collect()
}

/// Currents that the device found, relative to V_d in S, from the conductances that it reads with `constants`.
fn currents(constants: &CircuitConstants, wires: Wires, read_s: &[f64]) -> Vec<f64> {
    let sums = column_sums(wires, read_s);
    let lead = |k: usize| f64::from(constants.series_ohm[k]);
    let rows = read_s.chunks(wires.columns).zip(&constants.row_source_ohm);
    let current = |(row, source): (&[f64], &f32)| {
        let seen = row.iter().enumerate().map(|(k, g)| g / (1.0 + lead(k) * sums[k]));
        let seen: Vec<f64> = seen.collect();
        let drop = 1.0 + f64::from(*source) * seen.iter().sum::<f64>();
        seen.into_iter().map(move |g| g / drop)
    };
    rows.flat_map(current).collect()
}

/// Conductances that a device with the constants `new` would have read where it has read `read_s` with `old`.
fn convert(
    old: &CircuitConstants,
    new: &CircuitConstants,
    wires: Wires,
    read_s: &[f64],
) -> Vec<f64> {
    let factor = |c: &CircuitConstants, k: usize| {
        f64::from(c.drive_v) * f64::from(c.feedback_ohm[k]) / f64::from(c.reference_v)
    };
    let found = currents(old, wires, read_s);
    let rows = found.chunks(wires.columns).zip(&new.row_source_ohm);
    let seen: Vec<f64> = rows
        .flat_map(|(row, source)| {
            let row = row.iter().enumerate();
            let current: Vec<f64> = row.map(|(k, x)| x * factor(old, k) / factor(new, k)).collect();
            let potential = 1.0 - f64::from(*source) * current.iter().sum::<f64>();
            current.into_iter().map(move |x| x / potential)
        })
        .collect();
    let sums = column_sums(wires, &seen);
    let column = |(place, g): (usize, &f64)| {
        let k = place % wires.columns;
        g / (1.0 - f64::from(new.series_ohm[k]) * sums[k])
    };
    seen.iter().enumerate().map(column).collect()
}

/// Samples of an arrangement, one a resistor.
fn samples(before: &CircuitConstants, wires: Wires, arrangement: &Arrangement) -> Vec<Sample> {
    let found = currents(before, wires, &arrangement.read_s);
    let sums = column_sums(wires, &arrangement.known_s);
    let lead = |k: usize| f64::from(before.series_ohm[k]);
    let seen = arrangement.known_s.iter().enumerate().map(|(place, g)| {
        let k = place % wires.columns;
        g / (1.0 + lead(k) * sums[k])
    });
    let seen: Vec<f64> = seen.collect();
    let mut samples = Vec::new();
    for (place, (known, found)) in seen.iter().zip(&found).enumerate() {
        if *known > 0.0 {
            let (row, column) = (place / wires.columns, place % wires.columns);
            let load_s = seen[row * wires.columns..][..wires.columns].iter().sum();
            samples.push(Sample { row, column, log_ratio: (known / found).ln(), load_s });
        }
    }
    samples
}

#[cfg(test)]
mod tests;

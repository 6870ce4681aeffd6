//! Readings of frames, relative to what is known of the sensor at rest.

use taxel_data::{Table, columns};

use super::frames::ShownFrame;

/// What is known of the sensor at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reference<'a> {
    /// Readings at rest, one for each column.
    Rest(&'a [f64]),
    /// The readings are relative to the sensor at rest already: R/R₀.
    Relative,
    /// Nothing: readings are compared with their median.
    Median,
}

/// What shown readings are relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RelativeTo {
    /// Change from the sensor at rest, ΔR/R₀ in per cent.
    Rest,
    /// Change from the column's median over all frames, in per cent of it.
    Median,
    /// Change from the column's median, in standard deviations of the column: for readings that are no resistances.
    MedianInDeviations,
}

/// Readings of the shown frames.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownReadings {
    pub relative_to: RelativeTo,
    pub names: Vec<String>,
    /// Row-wire and column-wire (from 1) of each reading; empty if names do not tell.
    pub wires: Vec<[usize; 2]>,
}

/// Readings of `frames`, relative to the best reference there is.
pub(super) fn changes(
    readings: &Table,
    reference: Reference<'_>,
    frames: &[ShownFrame],
) -> (ShownReadings, Vec<Vec<f64>>) {
    let count = readings.names.len();
    let resistances = readings.names.iter().all(|name| columns::is_judged_in_ohm(name));
    let (relative_to, references, units): (_, Vec<f64>, Vec<f64>) = match reference {
        Reference::Rest(rest) => (RelativeTo::Rest, rest.to_vec(), rest.to_vec()),
        Reference::Relative => (RelativeTo::Rest, vec![1.0; count], vec![1.0; count]),
        Reference::Median if resistances => {
            let medians = medians(readings);
            (RelativeTo::Median, medians.clone(), medians)
        }
        Reference::Median => {
            let deviations = readings.deviations();
            // A reading that never changes, of a dead cell, has nothing to show.
            let units = deviations.iter().map(|it| if *it > 0.0 { 100.0 * it } else { f64::NAN });
            (RelativeTo::MedianInDeviations, medians(readings), units.collect())
        }
    };
    let of_frame = |frame: &ShownFrame| {
        let line = readings.lines().nth(frame.frame).unwrap_or_default();
        let references = references.iter().zip(&units);
        line.iter().zip(references).map(|(r, (zero, unit))| 100.0 * (r - zero) / unit).collect()
    };
    let changes = frames.iter().map(of_frame).collect();
    let wires: Option<Vec<[usize; 2]>> =
        readings.names.iter().map(|name| Some(columns::cell_of(name)?.0)).collect();
    let names = readings.names.clone();
    (ShownReadings { relative_to, names, wires: wires.unwrap_or_default() }, changes)
}

/// Median of each column; missing values do not count.
fn medians(table: &Table) -> Vec<f64> {
    let of_column = |column: usize| {
        let mut values: Vec<f64> =
            table.lines().map(|line| line[column]).filter(|value| !value.is_nan()).collect();
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    (0..table.names.len()).map(of_column).collect()
}

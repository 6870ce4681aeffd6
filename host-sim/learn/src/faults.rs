//! Faults of a sensor's wires, told from its frames: which wire, and what is wrong with it.
//!
//! Three kinds of evidence count, each over a window of frames:
//!
//! - **Health**: readings that are missing, shorted or open. A wire is named if all of its readings are so.
//! - **What the others say**: a model with a [fill](model_core::fill) tells each reading from the others. One that is far
//!   off them, again and again, is noisy.
//! - **Likeness**: two neighbours that touch read alike, where the other wires say that they should differ.

use std::collections::BTreeMap;
use std::fmt;

use model_core::fill::{Fill, MOST_MISSING};
use model_core::health::{Fault, Limits};
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use taxel_data::table::Table;

use crate::health::fault;

mod expected;
mod grid;
mod likeness;

use expected::Expected;
pub use grid::Grid;

/// Number of frames that are judged together.
pub const WINDOW: usize = 200;
/// Least number of frames that can be judged.
const FEWEST: usize = 5;
/// Share of a window's frames in which a reading is faulty, if its wire is broken.
const MOST: f64 = 0.9;
/// Share of a window's frames with a fault from which on a reading comes and goes.
const FLICKERS: f64 = 0.1;
/// Least share of saturated readings of the other rows, if one row is at ground.
const SATURATED: f64 = 0.2;

/// Wires of a fault, numbered as their names are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// All wires.
    All,
    /// A row-wire.
    Row(usize),
    /// Two neighbouring row-wires.
    Rows(usize, usize),
    /// A column-wire.
    Column(usize),
    /// Two neighbouring column-wires.
    Columns(usize, usize),
    /// The reading of a row-wire and a column-wire.
    Reading(usize, usize),
}

impl Place {
    /// Whether the reading of `row` and `column` belongs to the place.
    #[must_use]
    pub fn holds(self, row: usize, column: usize) -> bool {
        match self {
            Self::All => true,
            Self::Row(wire) => wire == row,
            Self::Rows(a, b) => [a, b].contains(&row),
            Self::Column(wire) => wire == column,
            Self::Columns(a, b) => [a, b].contains(&column),
            Self::Reading(of_row, of_column) => (of_row, of_column) == (row, column),
        }
    }
}

/// What is wrong with wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// No reading could be taken.
    Missing,
    /// No current flows: broken or not connected; or the converter is stuck at its lower end.
    Open,
    /// The circuit is saturated: connected to ground, or the converter is stuck at its upper end.
    Shorted,
    /// Connected to ground, which a row-wire shows by saturating all others.
    AtGround,
    /// Connected with each other.
    Touching,
    /// Far off what the other readings tell, or coming and going.
    Noisy,
}

/// What is wrong, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct WireFault {
    /// Wires that it strikes.
    pub place: Place,
    /// What is wrong with them.
    pub kind: Kind,
}

impl fmt::Display for WireFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::All => write!(f, "all readings"),
            Place::Row(wire) => write!(f, "row-wire {wire}"),
            Place::Rows(a, b) => write!(f, "row-wires {a} and {b}"),
            Place::Column(wire) => write!(f, "column-wire {wire}"),
            Place::Columns(a, b) => write!(f, "column-wires {a} and {b}"),
            Place::Reading(row, column) => write!(f, "r{row}c{column}"),
        }?;
        f.write_str(match self.kind {
            Kind::Missing => " missing",
            Kind::Open => " open",
            Kind::Shorted => " shorted",
            Kind::AtGround => " shorted to ground",
            Kind::Touching => " shorted together",
            Kind::Noisy => " noisy",
        })
    }
}

impl Serialize for WireFault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A fault, and in how many frames it was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Found {
    /// The fault.
    pub fault: WireFault,
    /// Number of frames of the windows in which it was found.
    pub frames: usize,
}

/// Faults in `readings` as they were scanned (Ω), by windows of [`WINDOW`] frames. A model's `fill` tells noise and wires
/// that touch; without one, health alone counts. None are told of columns that are no [`Grid`] of wires.
#[must_use]
pub fn diagnose(readings: &Table, limits: Limits, fill: Option<Fill<'_>>) -> Vec<Found> {
    let Some(grid) = Grid::of(&readings.names) else { return vec![] };
    let expected = fill.filter(|fill| fill.readings() == readings.names.len()).map(Expected::of);
    let windows = readings.values.par_chunks(WINDOW * readings.names.len());
    let found: Vec<(usize, Vec<WireFault>)> = windows
        .map(|window| {
            let frames = window.len() / readings.names.len();
            (frames, of_window(&grid, &readings.names, window, limits, expected.as_ref()))
        })
        .collect();
    let mut counts: BTreeMap<WireFault, usize> = BTreeMap::new();
    for (frames, faults) in found {
        faults.into_iter().for_each(|fault| *counts.entry(fault).or_default() += frames);
    }
    counts.into_iter().map(|(fault, frames)| Found { fault, frames }).collect()
}

/// Faults in one window of readings.
fn of_window(
    grid: &Grid,
    names: &[String],
    window: &[f64],
    limits: Limits,
    expected: Option<&Expected>,
) -> Vec<WireFault> {
    let count = names.len();
    let frames = window.len() / count;
    if frames < FEWEST {
        return vec![];
    }
    let mut faulty = vec![[0_usize; 3]; count];
    let mut sound = window.to_vec();
    for (at, reading) in sound.iter_mut().enumerate() {
        if let Some(fault) = fault(&names[at % count], *reading, Some(limits)) {
            faulty[at % count][fault as usize] += 1;
            *reading = f64::NAN;
        }
    }
    let mut faults = of_health(grid, &faulty, frames);
    if faults.iter().any(|fault| matches!(fault.kind, Kind::AtGround) || fault.place == Place::All)
    {
        return faults; // all else follows from it
    }
    let mut struck: Vec<bool> =
        (0..count).map(|at| faults.iter().any(|fault| grid.is_in(fault.place, at))).collect();
    let flickers = |at: &usize| faulty[*at].iter().sum::<usize>() as f64 > FLICKERS * frames as f64;
    let mut noisy: Vec<usize> = (0..count).filter(|at| !struck[*at]).filter(flickers).collect();
    noisy.iter().for_each(|at| struck[*at] = true);
    // With more missing than a fill fills, too little is left to tell of the rest.
    let few = struck.iter().filter(|struck| **struck).count() * MOST_MISSING <= count;
    if let Some(expected) = expected.filter(|_| few) {
        let scaled = expected.standardised(&sound);
        let mut far_off = expected.far_off(&scaled, &struck);
        let left_out = |at: usize| struck[at] || far_off.contains(&at);
        let pairs = likeness::touching(grid, expected, &scaled, &left_out);
        if !pairs.is_empty() {
            // What touches leads the others astray.
            let of_pairs = |at: usize| pairs.iter().any(|place| grid.is_in(*place, at));
            (0..count).filter(|at| of_pairs(*at)).for_each(|at| struck[at] = true);
            far_off = expected.far_off(&scaled, &struck);
        }
        noisy.extend(far_off);
        faults.extend(pairs.into_iter().map(|place| WireFault { place, kind: Kind::Touching }));
    }
    let places = grid.wires_of(&noisy);
    faults.extend(places.into_iter().map(|place| WireFault { place, kind: Kind::Noisy }));
    faults
}

/// Faults that the health of readings alone tells: `faulty` counts those of each reading by kind.
fn of_health(grid: &Grid, faulty: &[[usize; 3]], frames: usize) -> Vec<WireFault> {
    let of_kind = |kind: Fault| -> Vec<usize> {
        let most = |at: &usize| faulty[*at][kind as usize] as f64 >= MOST * frames as f64;
        (0..faulty.len()).filter(most).collect()
    };
    let open = of_kind(Fault::Open);
    let rows_open = grid.wires_of(&open).into_iter().filter_map(|place| match place {
        Place::Row(row) => Some(row),
        _ => None,
    });
    if let [row] = rows_open.collect::<Vec<_>>()[..] {
        let others: Vec<usize> =
            (0..faulty.len()).filter(|at| !grid.is_in(Place::Row(row), *at)).collect();
        let shorted: usize = others.iter().map(|at| faulty[*at][Fault::Shorted as usize]).sum();
        if shorted as f64 > SATURATED * (frames * others.len()) as f64
            && grid.wires_of(&of_kind(Fault::Shorted)).len() > 2
        {
            return vec![WireFault { place: Place::Row(row), kind: Kind::AtGround }];
        }
    }
    let kinds = [
        (Fault::Missing, Kind::Missing),
        (Fault::Shorted, Kind::Shorted),
        (Fault::Open, Kind::Open),
    ];
    let faults = kinds.into_iter().flat_map(|(fault, kind)| {
        let places = grid.wires_of(&of_kind(fault));
        places.into_iter().map(move |place| WireFault { place, kind })
    });
    faults.collect()
}

#[cfg(test)]
mod tests;

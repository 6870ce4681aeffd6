//! Faults that the health of readings alone tells.

use taxel_core::health::{Fault, Limits};

use super::Grid;
use super::wire_fault::{Kind, Place, WireFault};

/// Share of a window's frames in which a reading is faulty, if its wire is broken.
const MOST: f64 = 0.9;
/// Share of a window's frames with a fault from which on a reading comes and goes.
const FLICKERS: f64 = 0.1;
/// Least share of saturated readings of the other rows, if one row is at ground.
const SATURATED: f64 = 0.2;

const KINDS: [Fault; 3] = [Fault::Missing, Fault::Shorted, Fault::Open];

/// Faults that last through a window of so many `frames`: `faulty` counts those of each reading by kind.
pub fn lasting(grid: &Grid, faulty: &[[usize; 3]], frames: usize) -> Vec<WireFault> {
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
    let (mut missing, shorted) = (of_kind(Fault::Missing), of_kind(Fault::Shorted));
    let beside = grid.rows_beside(&shorted, &missing);
    missing.retain(|at| !beside.contains(at));
    let of_kinds = [
        (Kind::Missing, missing),
        (Kind::Shorted, shorted),
        (Kind::BesideShort, beside),
        (Kind::Open, open),
    ];
    let named = of_kinds.into_iter().flat_map(|(kind, readings)| {
        grid.wires_of(&readings).into_iter().map(move |place| WireFault { place, kind })
    });
    named.collect()
}

/// Whether a reading with so many faults by kind comes and goes in so many `frames`.
pub fn flickers(faulty: [usize; 3], frames: usize) -> bool {
    faulty.iter().sum::<usize>() as f64 > FLICKERS * frames as f64
}

/// Faults that come and go within a `window`, besides the readings with a `lasting` one. A wire is named if its readings
/// come and go together, else each reading.
pub fn intermittent(
    grid: &Grid,
    faulty: &[[usize; 3]],
    window: &[f64],
    limits: Limits,
    lasting: &[bool],
) -> Vec<WireFault> {
    let least = FLICKERS * (window.len() / faulty.len()) as f64;
    let of_kind = |fault: Fault| -> Vec<usize> {
        let comes_and_goes =
            |at: &usize| !lasting[*at] && faulty[*at][fault as usize] as f64 > least;
        (0..faulty.len()).filter(comes_and_goes).collect()
    };
    let mut faults = Vec::new();
    for fault in KINDS {
        let mut readings = of_kind(fault);
        if fault == Fault::Missing {
            // Rows are missing as a whole beside a short.
            let beside = grid.rows_beside(&of_kind(Fault::Shorted), &readings);
            readings.extend(beside);
            readings.sort_unstable();
            readings.dedup();
        }
        let mut name = |place| {
            faults.push(WireFault { place, kind: Kind::intermittent(fault) });
        };
        let mut alone = Vec::new();
        for place in grid.wires_of(&readings) {
            if frames_with(grid, window, limits, place, fault) as f64 > least {
                name(place);
            } else {
                alone.extend(readings.iter().copied().filter(|at| grid.is_in(place, *at)));
            }
        }
        alone.sort_unstable();
        alone.dedup(); // a reading of two wires
        alone.into_iter().for_each(|at| name(grid.place(at)));
    }
    faults
}

/// Number of the frames of `values` in which at least half of the readings of `place` have this `fault`.
pub fn frames_with(
    grid: &Grid,
    values: &[f64],
    limits: Limits,
    place: Place,
    fault: Fault,
) -> usize {
    let count = grid.readings();
    let readings: Vec<usize> = (0..count).filter(|at| grid.is_in(place, *at)).collect();
    let is_struck = |frame: &&[f64]| {
        let has = |at: &&usize| limits.fault(frame[**at] as f32) == Some(fault);
        2 * readings.iter().filter(has).count() >= readings.len()
    };
    values.chunks_exact(count).filter(is_struck).count()
}

//! Faults of a sensor's wires, told from its frames: which wire, and what is wrong with it.
//!
//! Three kinds of evidence count, each over a window of frames:
//!
//! - **Health**: readings that are missing, shorted or open, in all frames or now and then. A wire is named if all of its
//!   readings are so.
//! - **What the others say**: a model with a [reading model](taxel_core::reading_model) tells each reading from the others. One that is far
//!   off them, again and again, is noisy.
//! - **Likeness**: two neighbours that touch read alike, where the other wires say that they should differ.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::Serialize;
use taxel_core::health::Limits;
use taxel_core::reading_model::{MOST_MISSING, ReadingModel};
use taxel_data::Table;

use crate::parallel;

mod wire_fault;
mod grid;
mod health;
mod expected;
mod likeness;

use expected::Expected;
pub use grid::Grid;
pub use wire_fault::{Kind, Place, WireFault};

/// Number of frames that are judged together; the last window has up to twice as many.
pub const WINDOW: usize = 200;
/// Least number of frames whose health tells a fault of a wire.
const FEWEST: usize = 5;
/// Least number of frames that tell noise, or wires that touch: among fewer, chance alone is far off.
pub const FEWEST_FOR_NOISE: usize = 50;
/// A fault, and in how many frames it was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Found {
    /// The fault.
    pub fault: WireFault,
    /// Number of frames in which at least half of the readings are missing, shorted or open, as the fault says; or of
    /// the windows in which readings were noisy or wires touched.
    pub frames: usize,
}

/// Faults in `readings` as they were scanned (Ω), by [`windows`]. A model's `fill` tells noise and wires that touch;
/// without one, health alone counts. None are told of columns that are no [`Grid`] of wires.
pub fn diagnose(readings: &Table, limits: Limits, model: Option<ReadingModel<'_>>) -> Vec<Found> {
    let Some(grid) = Grid::new(&readings.names) else { return vec![] };
    let count = readings.names.len();
    let expected = model.filter(|model| model.sizes().readings == count).map(Expected::new);
    let windows = windows(readings.len());
    let found = parallel::map(windows.len(), &|window| {
        let window = windows[window].clone();
        let values = &readings.values[window.start * count..window.end * count];
        (window.len(), of_window(&grid, count, values, limits, expected.as_ref()))
    });
    let all: BTreeSet<WireFault> = found.iter().flat_map(|(_, faults)| faults).copied().collect();
    let of_windows = |fault: WireFault| {
        let windows = found.iter().filter(|(_, faults)| faults.contains(&fault));
        windows.map(|(frames, _)| frames).sum()
    };
    let frames = |fault: WireFault| match fault.kind.of_readings() {
        Some(kind) => health::frames_with(&grid, &readings.values, limits, fault.place, kind),
        None => of_windows(fault),
    };
    // What comes and goes before it lasts, or breaks within a window, is one fault.
    let lasts = |fault: &WireFault| {
        let lasting = fault.kind.of_readings().map(Kind::lasting);
        lasting
            .is_some_and(|kind| kind != fault.kind && all.contains(&WireFault { kind, ..*fault }))
    };
    let told = all.iter().copied().filter(|fault| !lasts(fault));
    told.map(|fault| Found { fault, frames: frames(fault) }).collect()
}

/// Frames that are judged together, of so many: [`WINDOW`] each, and the last with the rest, so that none is short.
pub fn windows(frames: usize) -> Vec<Range<usize>> {
    let count = (frames / WINDOW).max(1);
    let end = |window: usize| if window + 1 == count { frames } else { (window + 1) * WINDOW };
    (0..count).map(|window| window * WINDOW..end(window)).collect()
}

/// Faults in one window of `count` readings a frame.
fn of_window(
    grid: &Grid,
    count: usize,
    window: &[f64],
    limits: Limits,
    expected: Option<&Expected>,
) -> Vec<WireFault> {
    let frames = window.len() / count;
    if frames < FEWEST {
        return vec![];
    }
    let mut faulty = vec![[0_usize; 3]; count];
    let mut sound = window.to_vec();
    for (at, reading) in sound.iter_mut().enumerate() {
        if let Some(fault) = limits.fault(*reading as f32) {
            faulty[at % count][fault as usize] += 1;
            *reading = f64::NAN;
        }
    }
    let mut faults = health::lasting(grid, &faulty, frames);
    if faults.iter().any(|fault| matches!(fault.kind, Kind::AtGround) || fault.place == Place::All)
    {
        return faults; // all else follows from it
    }
    let is_in =
        |faults: &[WireFault], at: usize| faults.iter().any(|fault| grid.is_in(fault.place, at));
    let mut struck: Vec<bool> = (0..count).map(|at| is_in(&faults, at)).collect();
    let intermittent = health::intermittent(grid, &faulty, window, limits, &struck);
    // With more missing than a fill fills, too little is left to tell of the rest.
    let flickers = |at: &usize| struck[*at] || health::flickers(faulty[*at], frames);
    let few = (0..count).filter(flickers).count() * MOST_MISSING <= count;
    let tells = few && frames >= FEWEST_FOR_NOISE && !stand_still(window, count);
    let Some(expected) = expected.filter(|_| tells) else {
        faults.extend(intermittent);
        return faults;
    };
    let scaled = expected.standardised(&sound);
    let mut noisy = expected.far_off(&scaled, &struck);
    let left_out = |at: usize| struck[at] || noisy.contains(&at);
    let touching = likeness::touching(grid, expected, &scaled, &left_out);
    if !touching.is_empty() {
        // What touches leads the others astray.
        let touch = |at: usize| touching.iter().any(|place| grid.is_in(*place, at));
        (0..count).filter(|at| touch(*at)).for_each(|at| struck[at] = true);
        noisy = expected.far_off(&scaled, &struck);
    }
    // Noise alone takes readings beyond the limits now and then.
    let is_noise =
        |place| (0..count).filter(|at| grid.is_in(place, *at)).all(|at| noisy.contains(&at));
    faults.extend(intermittent.into_iter().filter(|fault| !is_noise(fault.place)));
    let noisy = grid.wires_of(&noisy).into_iter().map(|place| (place, Kind::Noisy));
    let touching = touching.into_iter().map(|place| (place, Kind::Touching));
    faults.extend(touching.chain(noisy).map(|(place, kind)| WireFault { place, kind }));
    faults
}

/// Whether all frames of `count` readings in a window are the same, to the bit: then they tell of no noise, and of one place
/// alone. Readings that are missing are the same.
pub fn stand_still(window: &[f64], count: usize) -> bool {
    let next_frames = window.iter().skip(count);
    window.iter().zip(next_frames).all(|(reading, next)| reading.to_bits() == next.to_bits())
}

//! Picture of the study of centres, spread and samples: a map for each number of samples, noise level and kind of error.

use std::collections::BTreeSet;

use crate::question::map::{Cell, Map, MapStudy};

use host_sim::report::format::{fixed, percent, significant, symbol};

use super::heat::{self, Picture, Square};

/// Ratio to the mean's error from which on colours are full.
const FULL: f64 = 3.0;
/// Ratios to the mean's error that the key shows.
const KEY: [f64; 9] = [0.0, 0.25, 0.5, 0.75, 0.9, 1.05, 1.25, 2.0, FULL];

/// Square of an error, as a ratio to the mean's.
fn square(ratio: f64, hover: String, is_framed: bool) -> Square {
    // Roots: small differences near 1 are what is looked for.
    let (class, opacity) = if ratio < 1.0 {
        ("above", (1.0 - ratio).sqrt())
    } else {
        ("below", (ratio.min(FULL).ln() / FULL.ln()).sqrt())
    };
    Square { class, opacity, text: String::new(), hover, is_framed }
}

/// A kind of error: its heading, those of a cell, and that of the mean.
type Kind = (&'static str, fn(&Cell) -> f64, fn(&Map) -> f64);

const KINDS: [Kind; 2] = [
    ("on the samples", |cell| cell.training_rmse, |map| map.mean_training_rmse),
    ("on test frames", |cell| cell.test_rmse, |map| map.mean_rmse),
];

pub fn svg(study: &MapStudy) -> String {
    let heat_map = |map: &Map, (heading, of, of_mean): Kind| {
        let best = map.best(|_| true);
        let one = |spread: f64, centres: usize| {
            let cell = map.cells.iter().find(|it| it.spread == spread && it.centres == centres)?;
            let ratio = of(cell) / of_mean(map);
            let hover = format!(
                "K = {centres}, spread {spread}: {} {}, {} of the mean's",
                significant(of(cell), 3),
                study.unit,
                significant(ratio, 3)
            );
            Some(square(ratio, hover, best == Some(cell)))
        };
        let line = |spread: &f64| {
            let below = study.centres.iter().filter(|centres| **centres != map.samples);
            let mut squares: Vec<_> = below.map(|centres| one(*spread, *centres)).collect();
            squares.resize(study.centres.len(), None);
            squares.push(one(*spread, map.samples));
            (format!("spread {}", fixed(*spread, 1)), squares)
        };
        let heading = format!("{} noise, {heading}", percent(map.noise_level));
        heat::Map { heading, lines: study.spreads.iter().rev().map(line).collect() }
    };
    let samples: BTreeSet<usize> = study.maps.iter().map(|map| map.samples).collect();
    let row = |samples: usize| {
        let maps = study.maps.iter().filter(|map| map.samples == samples);
        let both = maps.flat_map(|map| KINDS.map(|kind| heat_map(map, kind)));
        (format!("N = {samples} samples"), both.collect())
    };
    let words = |ratio: f64| format!("{}{ratio}", if ratio >= FULL { "≥ " } else { "" });
    let mut key: Vec<_> =
        KEY.iter().map(|ratio| (square(*ratio, String::new(), false), words(*ratio))).collect();
    key.push((square(1.0, String::new(), true), "least test error".into()));
    let centres = study.centres.iter().map(usize::to_string);
    let picture = Picture {
        title: format!(
            "RMSE of {} over that of always predicting the mean (scene {}, row {})",
            symbol(&study.group),
            study.subject,
            study.row_wire
        ),
        key,
        cell: [28.0, 13.0],
        columns: centres.chain(["N".to_owned()]).collect(),
        across: "across: centres K; K = N: every sample is a centre. Few samples: over several training sets",
        rows: samples.into_iter().map(row).collect(),
    };
    picture.svg()
}

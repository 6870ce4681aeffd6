//! Neighbouring wires that touch: they read alike where the other wires say that they should differ.

use super::expected::Expected;
use super::{FEWEST_FOR_NOISE, Grid, Place};

/// Least sum of squared differences that are expected, in those of noise: fewer do not tell.
const EVIDENCE: f64 = 60.0;
/// Least by which the logarithm of the likelihood that the wires touch is above that of sound wires. With so much evidence
/// sound wires have −30 ± 8, and such that touch 30 ± 8.
const MORE_LIKELY: f64 = 10.0;
/// Largest mean square of differences, in that of noise: 1 for wires that touch.
const ALIKE: f64 = 3.0;
/// Largest mean square of what the other readings of a frame differ from what is expected, in that of noise: a frame that
/// fits worse is spoilt by another fault.
const FITS: f64 = 3.0;

/// Neighbours that touch, by frames of `scaled` readings. Readings `left_out` tell nothing of the other wires.
pub fn touching(
    grid: &Grid,
    expected: &Expected,
    scaled: &[f64],
    left_out: &dyn Fn(usize) -> bool,
) -> Vec<Place> {
    let struck: Vec<bool> = (0..expected.readings()).map(left_out).collect();
    let (variance, _) = expected.present_noise(scaled, &struck);
    grid.neighbours()
        .filter(|place| touch(grid, expected, scaled, (&struck, variance), *place))
        .collect()
}

fn touch(
    grid: &Grid,
    expected: &Expected,
    scaled: &[f64],
    (struck, variance): (&[bool], f64),
    place: Place,
) -> bool {
    let pairs = grid.pairs(place);
    let (mut of_expected, mut of_both, mut of_found, mut count) = (0.0, 0.0, 0.0, 0.0);
    let mut frames = 0;
    let out = |at: usize| struck[at] || grid.is_in(place, at);
    expected.each(scaled, &out, variance, |frame, z, left| {
        let others = (0..frame.len()).filter(|at| !out(*at) && !frame[*at].is_nan());
        let misfit = others.map(|at| (frame[at] - z[at]).powi(2) / left[at]);
        let (sum, readings) = misfit.fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
        if sum > FITS * variance * readings {
            return;
        }
        frames += 1;
        for [a, b] in &pairs {
            let found = expected.difference([*a, *b], [frame[*a], frame[*b]]);
            let wanted = expected.difference([*a, *b], [z[*a], z[*b]]);
            if found.is_finite() && wanted.is_finite() {
                of_expected += wanted * wanted;
                of_both += wanted * found;
                of_found += found * found;
                count += 1.0;
            }
        }
    });
    frames >= FEWEST_FOR_NOISE
        && of_expected > EVIDENCE * variance
        && 0.5 * of_expected - of_both > MORE_LIKELY * variance
        && of_found < ALIKE * variance * count
}

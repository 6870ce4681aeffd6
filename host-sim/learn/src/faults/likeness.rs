//! Neighbouring wires that touch: they read alike where the other wires say that they should differ.

use nalgebra::DVector;

use super::expected::Expected;
use super::{FEWEST_FOR_NOISE, Grid, Place};

/// Standard errors by which what the other wires tell is certain: that the two differ in a frame, and that they do not read
/// so in a window.
const CERTAIN: f64 = 5.0;
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
    let mut struck: Vec<bool> = (0..expected.readings()).map(left_out).collect();
    let (variance, _) = expected.present_noise(scaled, &struck);
    let mut places = Vec::new();
    loop {
        let certainty = |place: &Place| touch(grid, expected, scaled, (&struck, variance), *place);
        let left = grid.neighbours().filter(|place| !places.contains(place));
        let told = left.filter_map(|place| Some((certainty(&place)?, place)));
        // What touches leads the others astray.
        let Some((_, surest)) = told.max_by(|a, b| a.0.total_cmp(&b.0)) else { return places };
        (0..struck.len()).filter(|at| grid.is_in(surest, *at)).for_each(|at| struck[at] = true);
        places.push(surest);
    }
}

/// Standard errors by which neighbours differ from sound ones, if they touch.
fn touch(
    grid: &Grid,
    expected: &Expected,
    scaled: &[f64],
    (struck, variance): (&[bool], f64),
    place: Place,
) -> Option<f64> {
    let pairs = grid.pairs(place).into_iter();
    let pairs: Vec<_> = pairs.map(|pair| (pair, expected.parts_of_difference(pair))).collect();
    let (mut of_expected, mut of_both, mut error) = (0.0, 0.0, 0.0);
    let (mut of_found, mut count) = (0.0, 0.0);
    let mut frames = 0;
    let out = |at: usize| struck[at] || grid.is_in(place, at);
    expected.each(scaled, &out, variance, |frame, z, solver| {
        let others = (0..frame.len()).filter(|at| !out(*at) && !frame[*at].is_nan());
        let misfit = others.map(|at| (frame[at] - z[at]).powi(2) / solver.left[at]);
        let (sum, readings) = misfit.fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
        if sum > FITS * variance * readings {
            return;
        }
        frames += 1;
        let (mut square, mut both) = (0.0, 0.0);
        let mut parts = DVector::zeros(pairs[0].1.len());
        for ([a, b], parts_of_pair) in &pairs {
            let found = expected.difference([*a, *b], [frame[*a], frame[*b]]);
            let wanted = expected.difference([*a, *b], [z[*a], z[*b]]);
            if found.is_finite() && wanted.is_finite() {
                square += wanted * wanted;
                both += wanted * found;
                parts.axpy(wanted, parts_of_pair, 1.0);
                of_found += found * found;
                count += 1.0;
            }
        }
        let error_of_frame = solver.standard_error(&parts);
        if square > CERTAIN * error_of_frame {
            of_expected += square;
            of_both += both;
            error += error_of_frame; // frames of one touch err alike
        }
    });
    let certainty = (of_expected - of_both) / (variance * of_expected).sqrt().hypot(error);
    let touch = frames >= FEWEST_FOR_NOISE
        && certainty > CERTAIN
        && of_both < 0.5 * of_expected
        && of_found < ALIKE * variance * count;
    touch.then_some(certainty)
}

//! A rotation that makes the spans of features alike.
//!
//! Distances do not change, so neither does the network. But all features share the largest span of any, and the
//! clamp's box about them is the smaller, the smaller that is: it decides how narrow a Gaussian a number format
//! holds.

/// Angles tried for each pair of features, on a half turn.
const ANGLES: usize = 16;
/// Largest number of rotated pairs, for each feature.
const PAIRS: usize = 20;
/// Least relative gain in the largest span that a pair is rotated for.
const GAIN: f64 = 1e-3;
/// Samples looked at, evenly chosen.
const SAMPLES: usize = 8192;

/// Rotation of `values` (`samples × features`) so that the largest span is small: what each feature adds to each
/// rotated one, `features × features`.
///
/// Pairs of the widest feature and another are rotated as long as that helps.
pub(super) fn evening(values: &[f64], features: usize) -> Vec<f64> {
    let step = (values.len() / features).div_ceil(SAMPLES).max(1);
    let chosen = || values.chunks_exact(features).step_by(step);
    let mut columns: Vec<Vec<f64>> =
        (0..features).map(|j| chosen().map(|line| line[j]).collect()).collect();
    let mut rotation: Vec<Vec<f64>> = (0..features)
        .map(|j| (0..features).map(|i| f64::from(u8::from(i == j))).collect())
        .collect();
    for _ in 0..PAIRS * features {
        let spans: Vec<f64> = columns.iter().map(|column| span(column.iter().copied())).collect();
        let mut order: Vec<usize> = (0..features).collect();
        order.sort_by(|a, b| spans[*a].total_cmp(&spans[*b]));
        let Some((&widest, others)) = order.split_last() else { break };
        let enough = spans[widest] * (1.0 - GAIN);
        let found = others.iter().find_map(|&other| {
            let (angle, largest) = best_angle(&columns[widest], &columns[other]);
            (largest < enough).then_some((other, angle))
        });
        let Some((other, angle)) = found else { break };
        rotate(&mut columns, widest, other, angle);
        rotate(&mut rotation, widest, other, angle);
    }
    (0..features).flat_map(|i| rotation.iter().map(move |column| column[i])).collect()
}

/// Turns every line of `values` by a `rotation` of so many `features`.
pub(super) fn turned(values: &[f64], rotation: &[f64], features: usize) -> Vec<f64> {
    let of_line = |line: &[f64]| -> Vec<f64> {
        let feature =
            |j: usize| line.iter().enumerate().map(|(i, x)| x * rotation[i * features + j]).sum();
        (0..features).map(feature).collect()
    };
    values.chunks_exact(features).flat_map(of_line).collect()
}

/// Angle by which two columns are rotated so that the larger of their spans is least, and that span.
fn best_angle(a: &[f64], b: &[f64]) -> (f64, f64) {
    let mut best = (0.0, f64::INFINITY);
    for k in 1..ANGLES {
        let angle = std::f64::consts::PI * k as f64 / ANGLES as f64;
        let (sine, cosine) = libm::sincos(angle);
        let first = span(a.iter().zip(b).map(|(a, b)| cosine * a + sine * b));
        let second = span(a.iter().zip(b).map(|(a, b)| cosine * b - sine * a));
        let largest = first.max(second);
        if largest < best.1 {
            best = (angle, largest);
        }
    }
    best
}

fn rotate(columns: &mut [Vec<f64>], i: usize, j: usize, angle: f64) {
    let (sine, cosine) = libm::sincos(angle);
    for k in 0..columns[i].len() {
        let (a, b) = (columns[i][k], columns[j][k]);
        (columns[i][k], columns[j][k]) = (cosine * a + sine * b, cosine * b - sine * a);
    }
}

fn span(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    high - low
}

//! K-means: k-means++ starts (Arthur & Vassilvitskii, 2007), Lloyd's iterations, restarts.

use rayon::prelude::*;

use super::squared_distance;
use crate::random::Random;

/// How hard to look for centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Independent starts; the best is kept.
    pub restarts: usize,
    /// Most iterations of one start.
    pub iterations: usize,
    /// Points looked at: an even selection where there are more.
    pub most_points: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { restarts: 2, iterations: 30, most_points: 8192 }
    }
}

/// Centres found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Centre after centre. Fewer than asked for where there are fewer distinct points.
    pub centres: Vec<f64>,
    /// Sum of squared distances of the points looked at to their nearest centre.
    pub inertia: f64,
}

/// Points a thread takes at a time. Fixed: sums are then the same on any number of threads.
const PIECE: usize = 512;
/// Relative gain in inertia below which iterations stop.
const ENOUGH: f64 = 1e-5;

/// Looks for `centres` centres of `points` (each of `dimensions` numbers).
///
/// Always ends; an empty cluster takes the point farthest from its centre. If there are fewer
/// distinct points than `centres`, every distinct point becomes one.
///
/// # Panics
/// If `dimensions` or `centres` is 0 or there is no point.
#[must_use]
pub fn fit(
    points: &[f64],
    dimensions: usize,
    centres: usize,
    search: &Search,
    random: &mut Random,
) -> Found {
    assert!(dimensions > 0 && centres > 0 && points.len() >= dimensions, "nothing to cluster");
    let total = points.len() / dimensions;
    let points: Vec<f64> = if total > search.most_points.max(centres) {
        let count = search.most_points.max(centres);
        let pick = |i: usize| i * total / count;
        (0..count).flat_map(|i| &points[pick(i) * dimensions..][..dimensions]).copied().collect()
    } else {
        points.to_vec()
    };
    let mut best: Option<Found> = None;
    for _ in 0..search.restarts.max(1) {
        let start = plus_plus(&points, dimensions, centres, random);
        let found = lloyd(&points, dimensions, start, search.iterations);
        if best.as_ref().is_none_or(|best| found.inertia < best.inertia) {
            best = Some(found);
        }
    }
    best.expect("at least one start")
}

/// Picks starting centres, each with a probability proportional to the squared distance from the
/// nearest one picked before. Stops early when every point coincides with a centre.
fn plus_plus(points: &[f64], dimensions: usize, centres: usize, random: &mut Random) -> Vec<f64> {
    let count = points.len() / dimensions;
    let point = |i: usize| &points[i * dimensions..(i + 1) * dimensions];
    let mut picked = point(random.below(count)).to_vec();
    let mut nearest = vec![f64::INFINITY; count];
    while picked.len() < centres * dimensions {
        let last = &picked[picked.len() - dimensions..];
        nearest.par_chunks_mut(PIECE).enumerate().for_each(|(piece, nearest)| {
            for (i, d) in nearest.iter_mut().enumerate() {
                *d = d.min(squared_distance(point(piece * PIECE + i), last));
            }
        });
        let sum: f64 = nearest.iter().sum();
        if sum == 0.0 {
            break;
        }
        let mut left = random.unit() * sum;
        let chosen = nearest.iter().position(|d| {
            left -= d;
            left < 0.0
        });
        // Rounding may leave a remainder: the last point with a distance takes it.
        let chosen = chosen.or_else(|| nearest.iter().rposition(|d| *d > 0.0));
        picked.extend_from_slice(point(chosen.expect("the sum is positive")));
    }
    picked
}

/// What one piece of the points adds to an iteration.
struct Part {
    sums: Vec<f64>,
    counts: Vec<usize>,
    inertia: f64,
    /// (squared distance, index) of every point, for empty clusters.
    distances: Vec<f64>,
}

fn lloyd(points: &[f64], dimensions: usize, start: Vec<f64>, iterations: usize) -> Found {
    let mut centres = start;
    let mut parts = assign(points, dimensions, &centres);
    for _ in 0..iterations {
        let moved = means(&parts, points, dimensions, &centres);
        let moved_parts = assign(points, dimensions, &moved);
        let (before, after) = (inertia(&parts), inertia(&moved_parts));
        if after > before {
            break; // rounding, or an empty cluster's new place did not pay
        }
        (centres, parts) = (moved, moved_parts);
        if before - after <= ENOUGH * before {
            break;
        }
    }
    Found { inertia: inertia(&parts), centres }
}

fn inertia(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.inertia).sum()
}

fn assign(points: &[f64], dimensions: usize, centres: &[f64]) -> Vec<Part> {
    let pieces = points.par_chunks(PIECE * dimensions);
    pieces
        .map(|piece| {
            let mut part = Part {
                sums: vec![0.0; centres.len()],
                counts: vec![0; centres.len() / dimensions],
                inertia: 0.0,
                distances: Vec::with_capacity(PIECE),
            };
            for point in piece.chunks_exact(dimensions) {
                let (mut nearest, mut distance) = (0, f64::INFINITY);
                for (k, centre) in centres.chunks_exact(dimensions).enumerate() {
                    let d = squared_distance(point, centre);
                    if d < distance {
                        (nearest, distance) = (k, d);
                    }
                }
                let sum = &mut part.sums[nearest * dimensions..(nearest + 1) * dimensions];
                sum.iter_mut().zip(point).for_each(|(s, p)| *s += p);
                part.counts[nearest] += 1;
                part.inertia += distance;
                part.distances.push(distance);
            }
            part
        })
        .collect()
}

fn means(parts: &[Part], points: &[f64], dimensions: usize, centres: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; centres.len()];
    let mut counts = vec![0_usize; centres.len() / dimensions];
    for part in parts {
        sums.iter_mut().zip(&part.sums).for_each(|(a, b)| *a += b);
        counts.iter_mut().zip(&part.counts).for_each(|(a, b)| *a += b);
    }
    let mut farthest: Option<Vec<usize>> = None;
    for (mean, count) in sums.chunks_exact_mut(dimensions).zip(&counts) {
        if *count > 0 {
            mean.iter_mut().for_each(|m| *m /= *count as f64);
        } else {
            // Take a point of its own, the farthest left over.
            let queue = farthest.get_or_insert_with(|| by_distance(parts));
            let index = queue.pop().unwrap_or(0);
            mean.copy_from_slice(&points[index * dimensions..(index + 1) * dimensions]);
        }
    }
    sums
}

/// Indices of all points, the farthest from its centre last.
fn by_distance(parts: &[Part]) -> Vec<usize> {
    let distances: Vec<f64> = parts.iter().flat_map(|part| part.distances.clone()).collect();
    let mut order: Vec<usize> = (0..distances.len()).collect();
    order.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    fn random(seed: u64) -> Random {
        Random::new(seed, Stream::Training, Purpose::Centres, 0, 0)
    }

    fn sorted(mut values: Vec<f64>) -> Vec<f64> {
        values.sort_by(f64::total_cmp);
        values
    }

    #[test]
    fn separate_clusters_are_found_whatever_the_seed() {
        let points: Vec<f64> =
            (0..300).map(|i| f64::from(i % 3) * 10.0 + f64::from(i / 3 % 10) * 0.01).collect();
        for seed in 0..20 {
            let found = fit(&points, 1, 3, &Search::default(), &mut random(seed));
            for (centre, expected) in sorted(found.centres).iter().zip([0.045, 10.045, 20.045]) {
                assert!((centre - expected).abs() < 1e-9, "seed {seed}: {centre}");
            }
        }
    }

    #[test]
    fn duplicates_end_with_one_centre_a_distinct_point() {
        let points = [1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 5.0, 2.0];
        let found = fit(&points, 1, 6, &Search::default(), &mut random(1));
        assert_eq!(sorted(found.centres), [1.0, 2.0, 5.0]);
        assert_eq!(found.inertia, 0.0);
        let found = fit(&[7.0; 50], 1, 4, &Search::default(), &mut random(1));
        assert_eq!(found.centres, [7.0]);
    }

    #[test]
    fn as_many_centres_as_points_reach_them_all() {
        let points = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let found = fit(&points, 2, 4, &Search::default(), &mut random(3));
        assert_eq!((found.centres.len(), found.inertia), (8, 0.0));
    }

    #[test]
    fn an_empty_cluster_takes_the_farthest_point() {
        // The third centre is nobody's nearest.
        let points = [0.0, 1.0, 10.0, 11.0, 30.0];
        let found = lloyd(&points, 1, vec![0.5, 10.5, 1e6], 50);
        assert_eq!(sorted(found.centres), [0.5, 10.5, 30.0]);
    }

    #[test]
    fn restarts_never_end_worse() {
        let mut source = random(9);
        let points: Vec<f64> = (0..4000).map(|_| source.unit()).collect();
        let with = |restarts| {
            let search = Search { restarts, ..Search::default() };
            fit(&points, 4, 25, &search, &mut random(4)).inertia
        };
        assert!(with(8) <= with(1));
    }
}

//! K-means: k-means++ starts, Lloyd's iterations, restarts.
//!
//! Every point belongs to the centre with the least squared distance, summed in f64 in the order of the
//! features; among equals, to the first. `screen` avoids computing most distances in f64, which changes nothing in
//! the result.

use std::borrow::Cow;

use taxel_data::Random;

mod screen;
mod assign;
mod start;

use assign::{Assignment, Piece};
use screen::Points;

/// Effort of a search for centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Number of independent starts; the best result is kept.
    pub restarts: usize,
    /// Largest number of iterations from one start.
    pub iterations: usize,
    /// Relative gain in inertia below which iterations stop.
    pub enough: f64,
    /// Largest number of points looked at: an even selection where there are more.
    pub most_points: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { restarts: 2, iterations: 30, enough: 1e-5, most_points: 8192 }
    }
}

/// Result of a search for centres.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Centres, `centres × dimensions`. Fewer than asked for where there are fewer distinct points.
    pub centres: Vec<f64>,
    /// Sum of squared distances of the points looked at from their nearest centres.
    pub inertia: f64,
    /// Number of iterations that led to these centres.
    pub iterations: usize,
}

/// Nearest centre of a point, and its squared distance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Nearest {
    centre: u32,
    squared_distance: f64,
}

impl Default for Nearest {
    fn default() -> Self {
        Self { centre: 0, squared_distance: f64::INFINITY }
    }
}

impl Nearest {
    /// Whether this centre is nearer than `other`; among equals, the first centre wins.
    #[inline(always)]
    fn is_nearer(&self, other: &Self) -> bool {
        self.squared_distance < other.squared_distance
            || (self.squared_distance == other.squared_distance && self.centre < other.centre)
    }
}

/// Sums that squared distances are added up in, side by side.
const LANES: usize = 8;

/// Points that a thread takes at a time. It depends on their number alone, so sums are the same on any
/// number of threads.
fn piece(count: usize) -> usize {
    count.div_ceil(64).next_multiple_of(LANES).max(512)
}

/// Searches for `centres` centres of `points` (`points × dimensions`, all finite).
///
/// The search always ends; an empty cluster takes the point farthest from its centre. If there are fewer
/// distinct points than `centres`, every distinct point becomes one.
///
/// # Panics
/// If `dimensions` or `centres` is 0 or there is no point.
pub fn fit(
    points: &[f64],
    dimensions: usize,
    centres: usize,
    search: &Search,
    random: &mut Random,
) -> Found {
    assert!(dimensions > 0 && centres > 0 && points.len() >= dimensions, "nothing to cluster");
    let total = points.len() / dimensions;
    let points: Cow<[f64]> = if total > search.most_points.max(centres) {
        let count = search.most_points.max(centres);
        let pick = |i: usize| i * total / count;
        (0..count).flat_map(|i| &points[pick(i) * dimensions..][..dimensions]).copied().collect()
    } else {
        points.into()
    };
    let points = Points::new(&points, dimensions);
    let mut best: Option<Found> = None;
    for _ in 0..search.restarts.max(1) {
        let start = start::plus_plus(&points, centres, random);
        let found = lloyd(Assignment::new(&points, start), search);
        if best.as_ref().is_none_or(|best| found.inertia < best.inertia) {
            best = Some(found);
        }
    }
    best.expect("at least one start")
}

/// Starting centres of one search, by k-means++ over `points`; fewer than `centres` where there are
/// fewer distinct points.
///
/// # Panics
/// If `dimensions` or `centres` is 0 or there is no point.
pub fn plus_plus(
    points: &[f64],
    dimensions: usize,
    centres: usize,
    random: &mut Random,
) -> Vec<f64> {
    assert!(dimensions > 0 && centres > 0 && points.len() >= dimensions, "nothing to cluster");
    start::plus_plus(&Points::new(points, dimensions), centres, random)
}

/// Lloyd's iterations over all `points` from given centres on. Only [`Search::iterations`] and
/// [`Search::enough`] matter.
///
/// # Panics
/// If `dimensions` is 0, or there is no point or no centre.
pub fn refine(points: &[f64], dimensions: usize, centres: &[f64], search: &Search) -> Found {
    assert!(dimensions > 0 && points.len() >= dimensions && !centres.is_empty(), "nothing to do");
    let points = Points::new(points, dimensions);
    lloyd(Assignment::new(&points, centres.to_vec()), search)
}

fn lloyd(mut assignment: Assignment<'_>, search: &Search) -> Found {
    let inertia_of = |assignment: &Assignment<'_>| -> f64 {
        assignment.pieces.iter().map(|piece| piece.inertia).sum()
    };
    let mut inertia = inertia_of(&assignment);
    for iteration in 0..search.iterations {
        let before = assignment.centres.clone();
        assignment.move_to(means(&assignment));
        let after = inertia_of(&assignment);
        if after > inertia {
            // Stop here: rounding spoiled the gain, or an empty cluster's new place did not pay.
            return Found { centres: before, inertia, iterations: iteration };
        }
        let gain = inertia - after;
        if gain <= search.enough * inertia {
            return Found {
                centres: assignment.centres,
                inertia: after,
                iterations: iteration + 1,
            };
        }
        inertia = after;
    }
    Found { centres: assignment.centres, inertia, iterations: search.iterations }
}

fn means(assignment: &Assignment<'_>) -> Vec<f64> {
    let points = assignment.points;
    let dimensions = points.dimensions;
    let mut sums = vec![0.0; assignment.centres.len()];
    let mut counts = vec![0_usize; assignment.centres.len() / dimensions];
    for piece in &assignment.pieces {
        sums.iter_mut().zip(&piece.sums).for_each(|(a, b)| *a += b);
        counts.iter_mut().zip(&piece.counts).for_each(|(a, b)| *a += b);
    }
    let mut farthest: Option<Vec<usize>> = None;
    for (mean, count) in sums.chunks_exact_mut(dimensions).zip(&counts) {
        if *count > 0 {
            mean.iter_mut().for_each(|m| *m /= *count as f64);
        } else {
            // The empty cluster takes the farthest point that is left.
            let queue = farthest.get_or_insert_with(|| by_distance(&assignment.pieces));
            let index = queue.pop().unwrap_or(0);
            mean.copy_from_slice(points.point(index));
        }
    }
    sums
}

/// Indices of all points, ascending by distance from their centres.
fn by_distance(pieces: &[Piece]) -> Vec<usize> {
    let nearest = pieces.iter().flat_map(|piece| &piece.nearest);
    let distances: Vec<f64> = nearest.map(|nearest| nearest.squared_distance).collect();
    let mut order: Vec<usize> = (0..distances.len()).collect();
    order.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
    order
}

//! Starting centres for Lloyd's iterations, by k-means++ (Arthur & Vassilvitskii, "k-means++: the
//! advantages of careful seeding", SODA 2007).

use rayon::prelude::*;

use taxel_data::{Random, widest};

use super::screen::Points;
use super::{LANES, piece};
use crate::train::squared_distance;

/// Piece of the points, with their squared distances from the nearest centres so far.
struct Piece {
    squared_distances: Vec<f64>,
    /// Sum of the squared distances.
    sum: f64,
}

/// Picks starting centres, each with a probability proportional to the squared distance from the nearest
/// one picked before. Stops early when every point coincides with a centre.
pub(super) fn plus_plus(points: &Points<'_>, centres: usize, random: &mut Random) -> Vec<f64> {
    let count = points.count();
    let size = piece(count);
    let new = |first: usize| Piece {
        squared_distances: vec![f64::INFINITY; size.min(count - first)],
        sum: 0.0,
    };
    let mut pieces: Vec<Piece> = (0..count).step_by(size).map(new).collect();
    let mut picked = Vec::with_capacity(centres * points.dimensions);
    let mut next = random.below(count);
    for index in 0..centres {
        let centre = points.point(next);
        picked.extend_from_slice(centre);
        pieces.par_iter_mut().enumerate().for_each(|(number, piece)| {
            let points = &points.values[number * size * points.dimensions..];
            widest!(piece.approach(points, centre));
        });
        let sum: f64 = pieces.iter().map(|piece| piece.sum).sum();
        if sum == 0.0 {
            break;
        }
        if index + 1 < centres {
            next = draw(&pieces, size, random.unit() * sum);
        }
    }
    picked
}

impl Piece {
    /// Takes one more centre into account. The piece's points are the first of `points`.
    #[inline(always)]
    fn approach(&mut self, points: &[f64], centre: &[f64]) {
        for (least, point) in
            self.squared_distances.iter_mut().zip(points.chunks_exact(centre.len()))
        {
            let squared_distance = squared_distance(point, centre);
            *least = if squared_distance < *least { squared_distance } else { *least };
        }
        let (whole, rest) = self.squared_distances.as_chunks::<LANES>();
        let mut sums = [0.0; LANES];
        for squared_distances in whole {
            (0..LANES).for_each(|l| sums[l] += squared_distances[l]);
        }
        self.sum = sums.iter().chain(rest).sum();
    }
}

/// Index of the point at which the running sum of squared distances passes `left`.
fn draw(pieces: &[Piece], size: usize, mut left: f64) -> usize {
    // Rounding may leave a remainder: the last piece with a distance takes it.
    let last = pieces.iter().rposition(|piece| piece.sum > 0.0).expect("the sum is positive");
    let mut number = 0;
    while number < last && left >= pieces[number].sum {
        left -= pieces[number].sum;
        number += 1;
    }
    let squared_distances = &pieces[number].squared_distances;
    let chosen = squared_distances.iter().position(|squared_distance| {
        left -= squared_distance;
        left < 0.0
    });
    let chosen = chosen.or_else(|| squared_distances.iter().rposition(|d| *d > 0.0));
    number * size + chosen.expect("the piece's sum is positive")
}

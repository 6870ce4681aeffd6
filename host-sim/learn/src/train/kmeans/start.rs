//! Starting centres for Lloyd's iterations, by k-means++ (Arthur & Vassilvitskii, "k-means++: the
//! advantages of careful seeding", SODA 2007).

#![expect(clippy::inline_always, reason = "what `simd::widest` runs must be inlined into it")]

use rayon::prelude::*;

use super::screen::{LANES, Points, exact, rounded_distances};
use super::{Nearest, piece};
use taxel_data::random::Random;
use taxel_data::simd::widest;

/// Piece of the points, with their nearest centres so far.
struct Piece {
    nearest: Vec<Nearest>,
    /// Rounded squared distance that a new centre must be within to be nearer, for every point.
    reach: Vec<[f32; LANES]>,
    /// Sum of the points' squared distances from their centres.
    sum: f64,
}

/// Picks starting centres, each with a probability proportional to the squared distance from the nearest
/// one picked before.
///
/// Returns the centres, and the nearest of them for every point. Stops early when every point coincides
/// with a centre.
pub(super) fn plus_plus(
    points: &Points<'_>,
    centres: usize,
    random: &mut Random,
) -> (Vec<f64>, Vec<Nearest>) {
    let count = points.count();
    let size = piece(count);
    let mut pieces: Vec<Piece> = (0..count)
        .step_by(size)
        .map(|first| {
            let count = size.min(count - first);
            let mut reach = vec![[f32::INFINITY; LANES]; count.div_ceil(LANES)];
            reach.as_flattened_mut()[count..].fill(-1.0); // unused lanes are never approached
            Piece { nearest: vec![Nearest::default(); count], reach, sum: 0.0 }
        })
        .collect();
    let mut picked = Vec::with_capacity(centres * points.dimensions);
    let mut next = random.below(count);
    for index in 0..centres {
        let centre = points.point(next);
        picked.extend_from_slice(centre);
        let rounded: Vec<f32> = points.screen.round(centre).collect();
        pieces.par_iter_mut().enumerate().for_each(|(number, piece)| {
            widest(
                #[inline(always)]
                || piece.approach(points, number * size, index as u32, centre, &rounded),
            );
        });
        let sum: f64 = pieces.iter().map(|piece| piece.sum).sum();
        if sum == 0.0 {
            break;
        }
        if index + 1 < centres {
            next = draw(&pieces, size, random.unit() * sum);
        }
    }
    (picked, pieces.into_iter().flat_map(|piece| piece.nearest).collect())
}

impl Piece {
    /// Takes one more centre into account. `first` is the index of the piece's first point.
    #[inline(always)]
    fn approach(
        &mut self,
        points: &Points<'_>,
        first: usize,
        index: u32,
        centre: &[f64],
        rounded: &[f32],
    ) {
        for (group, reach) in self.reach.iter_mut().enumerate() {
            let rounded = rounded_distances(rounded, points.lanes_of(first / LANES + group));
            if rounded.iter().zip(reach.iter()).all(|(rounded, reach)| rounded > reach) {
                continue;
            }
            for lane in 0..LANES {
                let place = group * LANES + lane;
                if rounded[lane] <= reach[lane] {
                    let squared_distance = exact(points.point(first + place), centre);
                    if squared_distance < self.nearest[place].squared_distance {
                        self.nearest[place] = Nearest { centre: index, squared_distance };
                        reach[lane] = points.screen.reach(squared_distance);
                    }
                }
            }
        }
        let (whole, rest) = self.nearest.as_chunks::<LANES>();
        let mut sums = [0.0; LANES];
        for nearest in whole {
            (0..LANES).for_each(|l| sums[l] += nearest[l].squared_distance);
        }
        let rest = rest.iter().map(|nearest| nearest.squared_distance);
        self.sum = sums.into_iter().chain(rest).sum();
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
    let nearest = &pieces[number].nearest;
    let chosen = nearest.iter().position(|nearest| {
        left -= nearest.squared_distance;
        left < 0.0
    });
    let chosen = chosen.or_else(|| nearest.iter().rposition(|n| n.squared_distance > 0.0));
    number * size + chosen.expect("the piece's sum is positive")
}

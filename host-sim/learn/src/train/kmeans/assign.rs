//! Assignment of points to their nearest centres.
//!
//! Every centre is looked at for every point, side by side in f32; those that may be the nearest are compared in f64,
//! which alone decides ([`Screen`]).
//!
//! [`Screen`]: super::screen::Screen

use rayon::prelude::*;
use taxel_data::widest;

use super::screen::{Centres, Points};
use super::{Nearest, piece};
use crate::train::squared_distance;

/// Piece of the points: their assignment, and their share of an iteration's sums.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Nearest centre of every point.
    pub(super) nearest: Vec<Nearest>,
    /// Sums of the points of every centre, `centres × dimensions`.
    pub(super) sums: Vec<f64>,
    /// Number of points of every centre.
    pub(super) counts: Vec<usize>,
    /// Sum of the squared distances of points from their centres.
    pub(super) inertia: f64,
}

/// Assignment of points to centres.
#[derive(Debug, Clone)]
pub(super) struct Assignment<'p> {
    pub(super) points: &'p Points<'p>,
    pub(super) centres: Vec<f64>,
    pub(super) pieces: Vec<Piece>,
}

impl<'p> Assignment<'p> {
    /// Assigns `points` to `centres`.
    pub(super) fn new(points: &'p Points<'p>, centres: Vec<f64>) -> Self {
        let piece = |first: usize| Piece {
            nearest: vec![Nearest::default(); piece(points.count()).min(points.count() - first)],
            sums: vec![0.0; centres.len()],
            counts: vec![0; centres.len() / points.dimensions],
            inertia: 0.0,
        };
        let pieces = firsts(points).map(piece).collect();
        let mut this = Self { points, centres: Vec::new(), pieces };
        this.move_to(centres);
        this
    }

    /// Assigns the points anew to `centres`, as many as before.
    pub(super) fn move_to(&mut self, centres: Vec<f64>) {
        let (points, rounded) = (self.points, Centres::new(&self.points.screen, &centres));
        self.pieces.par_iter_mut().zip(firsts(points)).for_each(|(piece, first)| {
            widest!({
                piece.assign(points, first, &rounded, &centres);
                piece.add_up(points, first);
            });
        });
        self.centres = centres;
    }
}

/// Index of each piece's first point.
fn firsts(points: &Points<'_>) -> rayon::iter::StepBy<rayon::range::Iter<usize>> {
    (0..points.count()).into_par_iter().step_by(piece(points.count()))
}

impl Piece {
    /// Assigns the piece's points, the first of which is number `first` of all.
    #[inline(always)]
    fn assign(&mut self, points: &Points<'_>, first: usize, rounded: &Centres, centres: &[f64]) {
        let n = points.dimensions;
        for (place, nearest) in self.nearest.iter_mut().enumerate() {
            let (point, (x, half_square)) =
                (points.point(first + place), points.rounded(first + place));
            let squared_distance_of =
                |centre: u32| squared_distance(point, &centres[centre as usize * n..][..n]);
            // The former centre is seldom far from the nearest.
            nearest.squared_distance = squared_distance_of(nearest.centre);
            let mut reach = points.screen.reach(nearest.squared_distance, half_square);
            for group in 0..rounded.groups() {
                let least = rounded.at_least(group, x);
                let hits = least.iter().fold(0, |hits, least| hits | u32::from(*least <= reach));
                if hits == 0 {
                    continue;
                }
                for (centre, least) in Centres::numbers(group).zip(least) {
                    if least <= reach {
                        let squared_distance = squared_distance_of(centre);
                        let found = Nearest { centre, squared_distance };
                        if found.is_nearer(nearest) {
                            *nearest = found;
                            reach = points.screen.reach(squared_distance, half_square);
                        }
                    }
                }
            }
        }
    }

    /// Adds up points and squared distances, in the order of the points.
    #[inline(always)]
    fn add_up(&mut self, points: &Points<'_>, first: usize) {
        let n = points.dimensions;
        self.sums.fill(0.0);
        self.counts.fill(0);
        self.inertia = 0.0;
        for (point, nearest) in points.values[first * n..].chunks_exact(n).zip(&self.nearest) {
            let centre = nearest.centre as usize;
            let sum = &mut self.sums[centre * n..][..n];
            sum.iter_mut().zip(point).for_each(|(s, x)| *s += x);
            self.counts[centre] += 1;
            self.inertia += nearest.squared_distance;
        }
    }
}

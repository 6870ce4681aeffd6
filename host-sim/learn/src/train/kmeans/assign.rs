//! Assignment of points to their nearest centres while centres move, without looking at most centres.
//!
//! This is Yinyang K-means (Ding et al., "Yinyang K-means: a drop-in replacement of the classic K-means with
//! consistent speedup", ICML 2015). Centres are put into groups. For every point and group, a lower bound is
//! kept on the distance of the group's centres, except the one that the point belongs to. The bound falls by
//! the largest movement of the group's centres. Only groups whose bound is not above the distance of the
//! point's own centre are looked at.
//!
//! A group is as many centres as a vector holds, so looking at one costs little. Bounds for groups of near
//! centres fall slowly, unlike those of Hamerly's algorithm, and there are fewer of them than Elkan's.
//!
//! Bounds hold for the distances as f64 computes them, all rounding included ([`Screen`]), so the
//! assignment, ties included, is the same as by looking at every centre.
//!
//! [`Screen`]: super::screen::Screen

#![expect(clippy::inline_always, reason = "what `simd::widest` runs must be inlined into it")]

use rayon::prelude::*;

use super::screen::{LANES, Points, exact, rounded_distances};
use super::{Nearest, piece};
use taxel_data::simd::widest;

/// Largest number of groups for which bounds are kept.
const MOST_GROUPS: usize = 64;

/// Piece of the points: their assignment, and their share of an iteration's sums.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// Nearest centre of every point.
    pub(super) nearest: Vec<Nearest>,
    /// Lower bounds on scaled distances, [`LANES`] groups at a time, point after point. Each was raised,
    /// when it was found, by the movement of its group until then.
    bounds: Vec<[f32; LANES]>,
    /// Sums of the points of every centre, `centres × dimensions`.
    pub(super) sums: Vec<f64>,
    /// Number of points of every centre.
    pub(super) counts: Vec<usize>,
    /// Sum of the squared distances of points from their centres.
    pub(super) inertia: f64,
}

/// Assignment of points to centres that move.
#[derive(Debug, Clone)]
pub(super) struct Assignment<'p> {
    pub(super) points: &'p Points<'p>,
    pub(super) centres: Vec<f64>,
    pub(super) pieces: Vec<Piece>,
    groups: Groups,
}

/// Centres in groups.
#[derive(Debug, Clone)]
struct Groups {
    /// Vectors in a group.
    vectors: usize,
    /// Centre in each lane; [`NOBODY`] in lanes that fill up the last group.
    centre_of: Vec<u32>,
    /// Lane of each centre.
    lane_of: Vec<u32>,
    /// Rounded centres: vector after vector, dimension after dimension.
    rounded: Vec<[f32; LANES]>,
    /// Largest movement of each group's centres, summed over all iterations, scaled; filled up to whole
    /// vectors.
    moved: Vec<f64>,
    /// Movements of the groups, as `moved`, in f32.
    rounded_moved: Vec<[f32; LANES]>,
    /// Error that rounding may cause in a comparison of bounds.
    slack: f64,
}

const NOBODY: u32 = u32::MAX;

impl Groups {
    fn new(points: &Points<'_>, centres: &[f64]) -> Self {
        let count = centres.len() / points.dimensions;
        let vectors = count.div_ceil(LANES * MOST_GROUPS);
        let size = vectors * LANES;
        let groups = count.div_ceil(size);
        let mut centre_of: Vec<u32> = (0..count as u32).collect();
        gather(&mut centre_of, centres, points.dimensions, size);
        centre_of.resize(groups * size, NOBODY);
        let mut lane_of = vec![0; count];
        for (lane, centre) in centre_of.iter().enumerate().filter(|(_, c)| **c != NOBODY) {
            lane_of[*centre as usize] = lane as u32;
        }
        let mut this = Self {
            vectors,
            centre_of,
            lane_of,
            rounded: vec![[f32::INFINITY; LANES]; groups * vectors * points.dimensions],
            moved: vec![0.0; groups.next_multiple_of(LANES)],
            rounded_moved: vec![[0.0; LANES]; groups.div_ceil(LANES)],
            slack: points.screen.slack(0.0),
        };
        this.round(points, centres);
        this
    }

    /// Vector and lane of the bound of a centre's group.
    fn place_of(&self, centre: u32) -> (usize, usize) {
        let group = self.lane_of[centre as usize] as usize / (self.vectors * LANES);
        (group / LANES, group % LANES)
    }

    /// Searches a group for centres nearer than `nearest`. Returns the least rounded squared distance of
    /// all centres but the one in `own_lane`.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "private, and called in one place")]
    fn search(
        &self,
        points: &Points<'_>,
        group: usize,
        centres: &[f64],
        point: &[f64],
        rounded: &[f32],
        nearest: &mut Nearest,
        look: &mut Look,
    ) -> f32 {
        let (n, mut least) = (points.dimensions, f32::INFINITY);
        for vector in group * self.vectors..(group + 1) * self.vectors {
            let distances = self.distances(n, vector, look.own_lane, rounded);
            let least_here = smallest(&distances);
            least = if least_here < least { least_here } else { least };
            if least_here > look.reach {
                continue;
            }
            for (lane, rounded) in distances.iter().enumerate() {
                let centre = self.centre_of.get(vector * LANES + lane).copied().unwrap_or(NOBODY);
                if *rounded > look.reach || centre == NOBODY {
                    continue;
                }
                let squared_distance = exact(point, &centres[centre as usize * n..][..n]);
                let found = Nearest { centre, squared_distance };
                if found.is_nearer(nearest) {
                    (*nearest, look.reach) = (found, points.screen.reach(squared_distance));
                }
            }
        }
        least
    }

    /// Least rounded squared distance of a group's centres but the one in `own_lane`.
    #[inline(always)]
    fn least(&self, dimensions: usize, group: usize, own_lane: usize, rounded: &[f32]) -> f32 {
        let vectors = group * self.vectors..(group + 1) * self.vectors;
        let least = |vector| smallest(&self.distances(dimensions, vector, own_lane, rounded));
        vectors.map(least).fold(f32::INFINITY, f32::min)
    }

    #[inline(always)]
    fn distances(
        &self,
        dimensions: usize,
        vector: usize,
        own_lane: usize,
        rounded: &[f32],
    ) -> [f32; LANES] {
        // A group that does not exist is infinitely far away.
        let Some(centres) = self.rounded.get(vector * dimensions..(vector + 1) * dimensions) else {
            return [f32::INFINITY; LANES];
        };
        let mut distances = rounded_distances(rounded, centres);
        if own_lane / LANES == vector {
            distances[own_lane % LANES] = f32::INFINITY;
        }
        distances
    }

    fn round(&mut self, points: &Points<'_>, centres: &[f64]) {
        let n = points.dimensions;
        for (centre, lane) in centres.chunks_exact(n).zip(&self.lane_of) {
            let lane = *lane as usize;
            let places = &mut self.rounded[lane / LANES * n..];
            let rounded = points.screen.round(centre);
            places.iter_mut().zip(rounded).for_each(|(place, x)| place[lane % LANES] = x);
        }
    }

    fn move_centres(&mut self, points: &Points<'_>, from: &[f64], to: &[f64]) {
        let n = points.dimensions;
        let mut most = vec![0.0_f64; self.moved.len()];
        for ((from, to), lane) in from.chunks_exact(n).zip(to.chunks_exact(n)).zip(&self.lane_of) {
            let most = &mut most[*lane as usize / (self.vectors * LANES)];
            *most = most.max(points.screen.scaled_at_most(exact(from, to)));
        }
        self.moved.iter_mut().zip(&most).for_each(|(moved, most)| *moved += most);
        let places = self.rounded_moved.as_flattened_mut().iter_mut();
        places.zip(&self.moved).for_each(|(place, moved)| *place = *moved as f32);
        self.slack = points.screen.slack(self.moved.iter().copied().fold(0.0, f64::max));
        self.round(points, to);
    }
}

/// Orders centres so that `size` neighbours in the order are near each other: halves them again and
/// again across the direction in which they reach farthest.
fn gather(order: &mut [u32], centres: &[f64], dimensions: usize, size: usize) {
    if order.len() <= size {
        return;
    }
    let direction = principal_direction(order, centres, dimensions);
    let along = |k: u32| dot(&centres[k as usize * dimensions..], &direction);
    let mut placed: Vec<(f64, u32)> = order.iter().map(|k| (along(*k), *k)).collect();
    placed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.iter_mut().zip(placed).for_each(|(k, (_, placed))| *k = placed);
    let half = (order.len() / size).div_ceil(2) * size;
    let (low, high) = order.split_at_mut(half);
    gather(low, centres, dimensions, size);
    gather(high, centres, dimensions, size);
}

/// Approximate first principal component of the given centres, by a few steps of the power method from
/// the centre farthest from their mean.
fn principal_direction(order: &[u32], centres: &[f64], dimensions: usize) -> Vec<f64> {
    let centre = |k: &u32| &centres[*k as usize * dimensions..][..dimensions];
    let mut mean = vec![0.0; dimensions];
    for k in order {
        mean.iter_mut().zip(centre(k)).for_each(|(m, x)| *m += x / order.len() as f64);
    }
    let from_mean = |k: &u32| centre(k).iter().zip(&mean).map(|(x, m)| x - m).collect();
    let offsets: Vec<Vec<f64>> = order.iter().map(from_mean).collect();
    let farthest = offsets.iter().max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)));
    let mut direction = farthest.cloned().unwrap_or(mean);
    for _ in 0..8 {
        let mut next = vec![0.0; dimensions];
        for offset in &offsets {
            let weight = dot(offset, &direction);
            next.iter_mut().zip(offset).for_each(|(n, x)| *n += weight * x);
        }
        let length = dot(&next, &next).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            break; // centres that coincide: any direction will do
        }
        direction = next.into_iter().map(|x| x / length).collect();
    }
    direction
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'p> Assignment<'p> {
    /// Assigns points to `centres`, given every point's `nearest`.
    pub(super) fn new(points: &'p Points<'p>, centres: Vec<f64>, nearest: &[Nearest]) -> Self {
        let groups = Groups::new(points, &centres);
        let chunks = groups.rounded_moved.len();
        let pieces = nearest.chunks(piece(nearest.len())).map(|nearest| Piece {
            nearest: nearest.to_vec(),
            bounds: vec![[f32::NEG_INFINITY; LANES]; nearest.len() * chunks],
            sums: vec![0.0; centres.len()],
            counts: vec![0; centres.len() / points.dimensions],
            inertia: 0.0,
        });
        let mut this = Self { points, pieces: pieces.collect(), centres, groups };
        let firsts = this.firsts();
        this.pieces.par_iter_mut().zip(firsts).for_each(|(piece, first)| {
            widest(
                #[inline(always)]
                || piece.add_up(points, first),
            );
        });
        this
    }

    /// Assigns points to `centres` from scratch.
    pub(super) fn from_scratch(points: &'p Points<'p>, centres: Vec<f64>) -> Self {
        let first = &centres[..points.dimensions];
        let nearest: Vec<Nearest> = (0..points.count())
            .into_par_iter()
            .map(|i| Nearest { centre: 0, squared_distance: exact(points.point(i), first) })
            .collect();
        let mut this = Self::new(points, centres.clone(), &nearest);
        this.move_to(centres);
        this
    }

    fn firsts(&self) -> rayon::iter::StepBy<rayon::range::Iter<usize>> {
        let count = self.points.count();
        (0..count).into_par_iter().step_by(piece(count))
    }

    /// Assigns the points anew to `centres`, as many as before.
    pub(super) fn move_to(&mut self, centres: Vec<f64>) {
        self.groups.move_centres(self.points, &self.centres, &centres);
        self.centres = centres;
        let (points, groups, centres) = (self.points, &self.groups, self.centres.as_slice());
        let firsts = self.firsts();
        self.pieces.par_iter_mut().zip(firsts).for_each(|(piece, first)| {
            widest(
                #[inline(always)]
                || {
                    piece.assign(points, first, groups, centres);
                    piece.add_up(points, first);
                },
            );
        });
    }

    /// Forgets all bounds: the next assignment looks at every centre.
    #[cfg(test)]
    pub(super) fn forget(&mut self) {
        self.pieces.iter_mut().for_each(|piece| piece.bounds.fill([f32::NEG_INFINITY; LANES]));
    }
}

impl Piece {
    /// Assigns the piece's points, the first of which is number `first` of all.
    #[inline(always)]
    fn assign(&mut self, points: &Points<'_>, first: usize, groups: &Groups, centres: &[f64]) {
        let n = points.dimensions;
        let mut rounded = vec![0.0; n];
        let bounds = self.bounds.chunks_exact_mut(groups.rounded_moved.len());
        for (place, (nearest, bounds)) in self.nearest.iter_mut().zip(bounds).enumerate() {
            let index = first + place;
            let (point, own) = (points.point(index), nearest.centre);
            let own_squared_distance = exact(point, &centres[own as usize * n..][..n]);
            nearest.squared_distance = own_squared_distance;
            let limit = points.screen.scaled_at_most(own_squared_distance) + groups.slack;
            let limit = limit as f32;
            let mut look = None;
            for (chunk, (bounds, moved)) in bounds.iter_mut().zip(&groups.rounded_moved).enumerate()
            {
                // A bound that is not a number, because a centre came from very far, counts as near.
                let is_far = |l: usize| bounds[l] - moved[l] > limit;
                let near = |l: usize| u32::from(!is_far(l)) << l;
                let hits = (0..LANES).fold(0, |hits, l| hits | near(l));
                if hits == 0 {
                    continue;
                }
                let look = look.get_or_insert_with(|| {
                    points.copy_rounded(index, &mut rounded);
                    Look {
                        own_lane: groups.lane_of[own as usize] as usize,
                        reach: points.screen.reach(own_squared_distance),
                    }
                });
                let mut least = [f32::INFINITY; LANES];
                let mut left = hits;
                while left != 0 {
                    let l = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let group = chunk * LANES + l;
                    least[l] =
                        groups.search(points, group, centres, point, &rounded, nearest, look);
                }
                let found = points.screen.at_least(least);
                for l in 0..LANES {
                    bounds[l] = if hits >> l & 1 == 1 { found[l] + moved[l] } else { bounds[l] };
                }
            }
            if nearest.centre != own {
                // The former centre is now one of the others, and the new one no longer is.
                let (group, l) = groups.place_of(own);
                let at_least = points.screen.scaled_at_least(own_squared_distance) as f32;
                let bound = at_least + groups.rounded_moved[group][l];
                bounds[group][l] = bounds[group][l].min(bound);
                let (group, l) = groups.place_of(nearest.centre);
                let lane = groups.lane_of[nearest.centre as usize] as usize;
                let least = groups.least(n, group * LANES + l, lane, &rounded);
                let [at_least, ..] = points.screen.at_least([least; LANES]);
                bounds[group][l] = at_least + groups.rounded_moved[group][l];
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

/// State of the search for one point's nearest centre.
struct Look {
    own_lane: usize,
    /// Largest rounded squared distance of a centre that may be the nearest.
    reach: f32,
}

#[inline(always)]
fn smallest(values: &[f32; LANES]) -> f32 {
    values.iter().fold(f32::INFINITY, |least, value| if *value < least { *value } else { least })
}

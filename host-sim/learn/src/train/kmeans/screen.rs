//! Rounded copy of the points, which tells far centres from near ones eight at a time.
//!
//! The assignment is always decided by [`squared_distance`] in f64. The copy, in f32 and scaled to [−1,
//! 1], only shows which distances cannot matter; [`Screen`] holds the error bounds that make this
//! certain.

#![expect(clippy::inline_always, reason = "what `simd::widest` runs must be inlined into it")]

use super::super::squared_distance;

/// Numbers in a vector.
pub(super) const LANES: usize = 8;

/// Relative error of one f32 operation: half the distance from 1 to the next number.
const ROUNDING_F32: f64 = f32::EPSILON as f64 / 2.0;
const ROUNDING_F64: f64 = f64::EPSILON / 2.0;

/// Points to cluster, exact and rounded.
#[derive(Debug, Clone)]
pub(super) struct Points<'p> {
    pub(super) values: &'p [f64],
    pub(super) dimensions: usize,
    /// Rounded points, [`LANES`] at a time, dimension after dimension; the last lanes are filled up with
    /// 0.
    lanes: Vec<[f32; LANES]>,
    pub(super) screen: Screen,
}

impl<'p> Points<'p> {
    pub(super) fn new(values: &'p [f64], dimensions: usize) -> Self {
        let screen = Screen::of(values, dimensions);
        let count = values.len() / dimensions;
        let mut lanes = vec![[0.0; LANES]; count.div_ceil(LANES) * dimensions];
        let places = lanes.chunks_exact_mut(dimensions);
        for (points, lanes) in values.chunks(LANES * dimensions).zip(places) {
            for (lane, point) in points.chunks_exact(dimensions).enumerate() {
                let rounded = screen.round(point);
                lanes.iter_mut().zip(rounded).for_each(|(place, x)| place[lane] = x);
            }
        }
        Self { values, dimensions, lanes, screen }
    }

    pub(super) fn count(&self) -> usize {
        self.values.len() / self.dimensions
    }

    #[inline(always)]
    pub(super) fn point(&self, index: usize) -> &'p [f64] {
        &self.values[index * self.dimensions..][..self.dimensions]
    }

    /// Copies one rounded point.
    #[inline(always)]
    pub(super) fn copy_rounded(&self, index: usize, to: &mut [f32]) {
        let lane = index % LANES;
        to.iter_mut().zip(self.lanes_of(index / LANES)).for_each(|(to, from)| *to = from[lane]);
    }

    /// Rounded points of group number `index`, [`LANES`] of them, dimension after dimension.
    #[inline(always)]
    pub(super) fn lanes_of(&self, index: usize) -> &[[f32; LANES]] {
        &self.lanes[index * self.dimensions..][..self.dimensions]
    }
}

/// Scaling and rounding of points, with bounds on the rounding errors.
///
/// Write ρ for the distance of a point and a centre times `scale`, r for their squared distance as
/// it comes out in f32 from their rounded copies, n for the dimensions, and u for 2⁻²⁴.
/// Coordinates are at most 1 in magnitude and are rounded by at most u(1 + 2⁻²⁷), so distances
/// change by at most A = 2.02·u·√n (what a centre farther out adds to this is less than u·ρ); and n
/// differences, squares and sums change r by at most a factor of 1 ± (n + 8)·u. Hence
/// √r·(1 − ε) − A ≤ ρ ≤ √r·(1 + ε) + A with ε = (n + 8)·u.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Screen {
    /// Middle of every dimension.
    middle: Vec<f64>,
    scale: f64,
    /// Absolute error A of a scaled distance.
    absolute: f64,
    /// Relative error ε of a scaled distance.
    relative: f64,
}

impl Screen {
    fn of(values: &[f64], dimensions: usize) -> Self {
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; dimensions];
        for point in values.chunks_exact(dimensions) {
            for ([low, high], x) in ranges.iter_mut().zip(point) {
                (*low, *high) = (low.min(*x), high.max(*x));
            }
        }
        let middle: Vec<f64> = ranges.iter().map(|[low, high]| low / 2.0 + high / 2.0).collect();
        let reach = ranges.iter().zip(&middle).map(|([low, high], m)| (m - low).max(high - m));
        let reach = reach.fold(0.0, f64::max);
        // Squares of distances that matter must be normal numbers. Points closer together are not
        // scaled, and A then says that nothing is known.
        let scale = if reach > 1e-100 { 1.0 / reach } else { 1.0 };
        let n = dimensions as f64;
        Self {
            middle,
            scale,
            absolute: 2.02 * ROUNDING_F32 * n.sqrt(),
            relative: (n + 8.0) * ROUNDING_F32,
        }
    }

    /// Scales and rounds a point or a centre. A centre that is given may be far from all points: it is
    /// brought nearer, which keeps squares finite and lower bounds true.
    pub(super) fn round(&self, point: &[f64]) -> impl Iterator<Item = f32> {
        let scaled = |(x, middle): (&f64, &f64)| ((x - middle) * self.scale).clamp(-1e8, 1e8);
        point.iter().zip(&self.middle).map(move |pair| scaled(pair) as f32)
    }

    /// Upper bound on the scaled distance ρ, from a squared distance in f64.
    #[inline(always)]
    pub(super) fn scaled_at_most(&self, squared_distance: f64) -> f64 {
        // The square has n + 3 roundings; a few more follow here.
        let n = self.middle.len() as f64;
        self.scale * squared_distance.sqrt() * (1.0 + (n + 12.0) * ROUNDING_F64)
    }

    /// Lower bound on the scaled distance ρ, from a squared distance in f64.
    #[inline(always)]
    pub(super) fn scaled_at_least(&self, squared_distance: f64) -> f64 {
        let n = self.middle.len() as f64;
        self.scale * squared_distance.sqrt() * (1.0 - (n + 12.0) * ROUNDING_F64)
    }

    /// Lower bounds on scaled distances ρ, short of [`Self::slack`], from rounded squared distances r.
    #[inline(always)]
    pub(super) fn at_least(&self, rounded: [f32; LANES]) -> [f32; LANES] {
        let (factor, less) = ((1.0 - self.relative) as f32, self.absolute as f32);
        rounded.map(|r| r.sqrt() * factor - less)
    }

    /// Largest r of a centre that is no farther, in f64, than `squared_distance`.
    #[inline(always)]
    pub(super) fn reach(&self, squared_distance: f64) -> f32 {
        let most = (self.scaled_at_most(squared_distance) + self.absolute) / (1.0 - self.relative);
        // The margin covers rounding to f32, and that of both distances in f64.
        (most * most * 1.000_001) as f32
    }

    /// Error that lower bounds may pick up in f32. The root, its product and two sums are rounded, and
    /// so are the movement `moved`, which is added and subtracted, and the difference. Bounds are below
    /// 2.1·√n.
    pub(super) fn slack(&self, moved: f64) -> f64 {
        16.0 * ROUNDING_F32 * (4.0 * (self.middle.len() as f64).sqrt() + moved)
    }
}

/// Squared distances r of a rounded point from [`LANES`] rounded centres.
#[inline(always)]
pub(super) fn rounded_distances(point: &[f32], centres: &[[f32; LANES]]) -> [f32; LANES] {
    /// Differences that are added up one after the other, in two runs.
    const RUN: usize = 3;
    let mut sums = [[0.0; LANES]; 2];
    let (points, last_points) = point.as_chunks::<{ 2 * RUN }>();
    let (runs, last_centres) = centres.as_chunks::<{ 2 * RUN }>();
    for (x, c) in points.iter().zip(runs) {
        for i in 0..2 * RUN {
            for l in 0..LANES {
                sums[i % 2][l] += (x[i] - c[i][l]) * (x[i] - c[i][l]);
            }
        }
    }
    for (x, c) in last_points.iter().zip(last_centres) {
        (0..LANES).for_each(|l| sums[0][l] += (x - c[l]) * (x - c[l]));
    }
    std::array::from_fn(|l| sums[0][l] + sums[1][l])
}

/// Exact squared distance, in f64, which decides the assignment.
#[inline(always)]
pub(super) fn exact(point: &[f64], centre: &[f64]) -> f64 {
    squared_distance(point, centre)
}

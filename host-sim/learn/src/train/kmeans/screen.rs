//! A rounded copy of the points, in which far centres are told from near ones eight at a time.
//!
//! What decides is always [`squared_distance`] in f64. The copy, in f32 and scaled to [−1, 1],
//! only tells which distances cannot matter; [`Screen`] holds the bounds that make this certain.

#![expect(clippy::inline_always, reason = "what `simd::widest` runs must be inlined into it")]

use super::super::squared_distance;

/// Numbers of a vector.
pub(super) const LANES: usize = 8;

/// Half the distance between 1 and the next f32, and f64: the relative error of one operation.
const ROUNDING_F32: f64 = f32::EPSILON as f64 / 2.0;
const ROUNDING_F64: f64 = f64::EPSILON / 2.0;

/// Points to cluster, as given and rounded.
#[derive(Debug, Clone)]
pub(super) struct Points<'p> {
    pub(super) values: &'p [f64],
    pub(super) dimensions: usize,
    /// [`LANES`] points at a time, dimension after dimension; the last are filled up with 0.
    blocks: Vec<[f32; LANES]>,
    pub(super) screen: Screen,
}

impl<'p> Points<'p> {
    pub(super) fn new(values: &'p [f64], dimensions: usize) -> Self {
        let screen = Screen::of(values, dimensions);
        let count = values.len() / dimensions;
        let mut blocks = vec![[0.0; LANES]; count.div_ceil(LANES) * dimensions];
        let places = blocks.chunks_exact_mut(dimensions);
        for (points, block) in values.chunks(LANES * dimensions).zip(places) {
            for (lane, point) in points.chunks_exact(dimensions).enumerate() {
                let rounded = screen.round(point);
                block.iter_mut().zip(rounded).for_each(|(place, x)| place[lane] = x);
            }
        }
        Self { values, dimensions, blocks, screen }
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
        to.iter_mut().zip(self.block(index / LANES)).for_each(|(to, from)| *to = from[lane]);
    }

    /// The rounded points of block number `index`, dimension after dimension.
    #[inline(always)]
    pub(super) fn block(&self, index: usize) -> &[[f32; LANES]] {
        &self.blocks[index * self.dimensions..][..self.dimensions]
    }
}

/// How points are scaled and rounded, and what the rounding may amount to.
///
/// Write ρ for the distance of a point and a centre times `scale`, r for their squared distance as
/// it comes out in f32 from their rounded copies, n for the dimensions, and u for 2⁻²⁴.
/// Coordinates are at most 1 in magnitude and are rounded by at most u(1 + 2⁻²⁷), so distances
/// change by at most A = 2.02·u·√n (what a centre farther out adds to this is less than u·ρ); and n
/// differences, squares and sums change r by at most a factor of 1 ± (n + 8)·u. Hence
/// √r·(1 − ε) − A ≤ ρ ≤ √r·(1 + ε) + A with ε = (n + 8)·u.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Screen {
    /// The middle of every dimension.
    middle: Vec<f64>,
    scale: f64,
    /// A.
    absolute: f64,
    /// ε.
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
        // Squares of distances that matter must be normal numbers. Of points closer together
        // nothing is scaled, and A then says that nothing is known.
        let scale = if reach > 1e-100 { 1.0 / reach } else { 1.0 };
        let n = dimensions as f64;
        Self {
            middle,
            scale,
            absolute: 2.02 * ROUNDING_F32 * n.sqrt(),
            relative: (n + 8.0) * ROUNDING_F32,
        }
    }

    /// A point or centre, scaled and rounded. A centre that is given may be far from all points: it
    /// is brought nearer, which keeps squares finite and lower bounds true.
    pub(super) fn round(&self, point: &[f64]) -> impl Iterator<Item = f32> {
        let scaled = |(x, middle): (&f64, &f64)| ((x - middle) * self.scale).clamp(-1e8, 1e8);
        point.iter().zip(&self.middle).map(move |pair| scaled(pair) as f32)
    }

    /// A bound that ρ is not above, from a squared distance as computed in f64.
    #[inline(always)]
    pub(super) fn scaled_at_most(&self, squared_distance: f64) -> f64 {
        // (n + 3) roundings within the square, a few here.
        let n = self.middle.len() as f64;
        self.scale * squared_distance.sqrt() * (1.0 + (n + 12.0) * ROUNDING_F64)
    }

    /// A bound that ρ is not below, from a squared distance as computed in f64.
    #[inline(always)]
    pub(super) fn scaled_at_least(&self, squared_distance: f64) -> f64 {
        let n = self.middle.len() as f64;
        self.scale * squared_distance.sqrt() * (1.0 - (n + 12.0) * ROUNDING_F64)
    }

    /// Bounds that ρ is not below but for [`Self::slack`], from r.
    #[inline(always)]
    pub(super) fn at_least(&self, rounded: [f32; LANES]) -> [f32; LANES] {
        let (factor, less) = ((1.0 - self.relative) as f32, self.absolute as f32);
        rounded.map(|r| r.sqrt() * factor - less)
    }

    /// The largest r that a centre may have which is no farther, in f64, than `squared_distance`.
    #[inline(always)]
    pub(super) fn reach(&self, squared_distance: f64) -> f32 {
        let most = (self.scaled_at_most(squared_distance) + self.absolute) / (1.0 - self.relative);
        // The margin covers rounding to f32, and that of both distances in f64.
        (most * most * 1.000_001) as f32
    }

    /// What bounds may lose in f32: the root, its product and two sums are rounded, and so are
    /// `moved`, which is added and subtracted, and the difference. Bounds are below 2.1·√n.
    pub(super) fn slack(&self, moved: f64) -> f64 {
        16.0 * ROUNDING_F32 * (4.0 * (self.middle.len() as f64).sqrt() + moved)
    }
}

/// Squared distances r of a rounded point from [`LANES`] rounded centres.
#[inline(always)]
pub(super) fn rounded_distances(point: &[f32], centres: &[[f32; LANES]]) -> [f32; LANES] {
    /// Differences that are added up one after the other, twice.
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

/// What decides: the squared distance in f64.
#[inline(always)]
pub(super) fn exact(point: &[f64], centre: &[f64]) -> f64 {
    squared_distance(point, centre)
}

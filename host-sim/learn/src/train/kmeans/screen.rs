//! Rounded copy of points and centres, which tells far centres from near ones many at a time.
//!
//! The assignment is always decided by [`squared_distance`] in f64. The copy, in f32 and scaled to [−1,
//! 1], only shows which distances cannot matter; [`Screen`] holds the error bounds that make this
//! certain.
//!
//! [`squared_distance`]: crate::train::squared_distance

/// Centres that are looked at side by side.
const LANES: usize = 16;

/// Relative error of one f32 operation: half the distance from 1 to the next number.
const ROUNDING_F32: f64 = f32::EPSILON as f64 / 2.0;
const ROUNDING_F64: f64 = f64::EPSILON / 2.0;

/// Points to cluster, exact and rounded.
#[derive(Debug, Clone)]
pub(super) struct Points<'p> {
    pub(super) values: &'p [f64],
    pub(super) dimensions: usize,
    rounded: Vec<f32>,
    /// ‖x‖²/2 of each rounded point.
    half_squares: Vec<f64>,
    pub(super) screen: Screen,
}

impl<'p> Points<'p> {
    pub(super) fn new(values: &'p [f64], dimensions: usize) -> Self {
        let screen = Screen::new(values, dimensions);
        let points = values.chunks_exact(dimensions);
        let rounded: Vec<f32> = points.flat_map(|point| screen.round(point)).collect();
        let half_squares = rounded.chunks_exact(dimensions).map(half_square).collect();
        Self { values, dimensions, rounded, half_squares, screen }
    }

    pub(super) fn count(&self) -> usize {
        self.values.len() / self.dimensions
    }

    #[inline(always)]
    pub(super) fn point(&self, index: usize) -> &'p [f64] {
        &self.values[index * self.dimensions..][..self.dimensions]
    }

    /// Rounded point, and its ‖x‖²/2.
    #[inline(always)]
    pub(super) fn rounded(&self, index: usize) -> (&[f32], f64) {
        let rounded = &self.rounded[index * self.dimensions..][..self.dimensions];
        (rounded, self.half_squares[index])
    }
}

fn half_square(rounded: &[f32]) -> f64 {
    rounded.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>() / 2.0
}

/// Rounded centres.
#[derive(Debug)]
pub(super) struct Centres {
    dimensions: usize,
    /// For [`LANES`] centres at a time, ‖c‖²/2 less the error bound E, NaN where there is no centre; then
    /// their coordinates, dimension after dimension.
    lanes: Vec<[f32; LANES]>,
}

impl Centres {
    pub(super) fn new(screen: &Screen, centres: &[f64]) -> Self {
        let n = screen.middle.len();
        let mut lanes = Vec::new();
        for group in centres.chunks(LANES * n) {
            let first = lanes.len();
            lanes.push([f32::NAN; LANES]);
            lanes.resize(first + 1 + n, [0.0; LANES]);
            for (lane, centre) in group.chunks_exact(n).enumerate() {
                let rounded: Vec<f32> = screen.round(centre).collect();
                let half = half_square(&rounded);
                let error =
                    1.01 * (n + 2) as f64 * ROUNDING_F32 * (half + (n as f64 * 2.0 * half).sqrt());
                lanes[first][lane] = (half - error) as f32;
                for (place, x) in lanes[first + 1..].iter_mut().zip(rounded) {
                    place[lane] = x;
                }
            }
        }
        Self { dimensions: n, lanes }
    }

    /// Number of groups of [`LANES`] centres, the last filled up.
    #[inline(always)]
    pub(super) fn groups(&self) -> usize {
        self.lanes.len() / (1 + self.dimensions)
    }

    /// Numbers of a group's centres.
    #[inline(always)]
    pub(super) fn numbers(group: usize) -> std::ops::RangeFrom<u32> {
        (group * LANES) as u32..
    }

    /// Lower bounds on ‖c‖²/2 − x·c for the centres c of a group, of a rounded point x; NaN where there is no centre.
    #[inline(always)]
    pub(super) fn at_least(&self, group: usize, x: &[f32]) -> [f32; LANES] {
        let group = &self.lanes[group * (1 + self.dimensions)..][..=self.dimensions];
        let mut least = group[0];
        for (x, c) in x.iter().zip(&group[1..]) {
            for l in 0..LANES {
                least[l] -= x * c[l];
            }
        }
        least
    }
}

/// Scaling and rounding of points and centres, with bounds on the rounding errors.
///
/// Write ρ for the distance of a point and a centre times `scale`, x and c for their rounded copies, n for the
/// dimensions, and u for 2⁻²⁴. Coordinates of points are at most 1 in magnitude and are rounded by at most u(1 +
/// 2⁻²⁷), and so are those of centres among them. Hence ‖x − c‖ ≤ ρ + A with A = 2.02·u·√n; what a centre farther out
/// adds to this is less than ε·ρ, ε = (n + 8)·u. The n products and sums of ‖c‖²/2 − x·c change it by at most
/// E = (n + 2)·u·(‖c‖²/2 + √n·‖c‖), which the bounds of [`Centres`] are lowered by.
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
    fn new(values: &[f64], dimensions: usize) -> Self {
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
    fn round(&self, point: &[f64]) -> impl Iterator<Item = f32> {
        let scaled = |(x, middle): (&f64, &f64)| ((x - middle) * self.scale).clamp(-1e8, 1e8);
        point.iter().zip(&self.middle).map(move |pair| scaled(pair) as f32)
    }

    /// Largest ‖c‖²/2 − x·c of a centre that is no farther, in f64, than `squared_distance` from a point with this
    /// ‖x‖²/2.
    #[inline(always)]
    pub(super) fn reach(&self, squared_distance: f64, half_square: f64) -> f32 {
        // The square has n + 3 roundings; a few more follow here.
        let roundings = (self.middle.len() + 12) as f64 * ROUNDING_F64;
        let at_most = self.scale * squared_distance.sqrt() * (1.0 + roundings);
        let most = (at_most + self.absolute) / (1.0 - self.relative);
        let half = most * most / 2.0;
        // The margin covers rounding to f32, products that are no normal numbers, and all roundings in f64.
        (half - half_square + 4.0 * ROUNDING_F32 * (half + half_square)) as f32
    }
}

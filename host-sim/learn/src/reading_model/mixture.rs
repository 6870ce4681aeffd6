//! Mixture of Gaussians with full covariances, by expectation–maximisation (Dempster, Laird and Rubin, J. R. Stat. Soc.
//! B 39, 1977) from K-means centres.

use nalgebra::{Cholesky, DMatrix, DVector};
use taxel_data::{Purpose, Random, Stream};

use crate::parallel;
use crate::train::kmeans::{self, Search};

/// Points that a thread takes at a time.
const POINTS_AT_ONCE: usize = 512;
/// Most iterations.
const ITERATIONS: usize = 60;
/// Gain in the mean log-likelihood, in nats, below which iterations stop.
const ENOUGH: f64 = 1e-3;
/// Variance added to every feature, relative to the least and to the largest variance of any.
const FLOOR: [f64; 2] = [1e-3, 1e-9];

/// Component: ln π·N(f | μ, Σ) = c − ½‖W·f − o‖².
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    constant: f64,
    offsets: DVector<f64>,
    /// Inverse of the covariance's Cholesky factor, a lower triangle.
    whitening: DMatrix<f64>,
}

/// Mixture of Gaussians.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    /// Components, whose probabilities sum up to 1.
    pub components: Vec<Component>,
}

/// Sums over points, weighted by a component's probability.
#[derive(Clone)]
struct Sums {
    weight: f64,
    first: DVector<f64>,
    second: DMatrix<f64>,
}

impl Sums {
    fn zero(size: usize) -> Self {
        Self { weight: 0.0, first: DVector::zeros(size), second: DMatrix::zeros(size, size) }
    }

    fn add(&mut self, weight: f64, point: &DVector<f64>) {
        self.weight += weight;
        self.first.axpy(weight, point, 1.0);
        self.second.ger(weight, point, point, 1.0);
    }

    fn merge(&mut self, other: &Self) {
        self.weight += other.weight;
        self.first += &other.first;
        self.second += &other.second;
    }

    /// Component of these sums, out of so many `points`; `None` if it would have a covariance that is none.
    fn component(&self, points: usize, floor: f64) -> Option<Component> {
        let size = self.first.len();
        let mean = &self.first / self.weight;
        let mut covariance = &self.second / self.weight - &mean * mean.transpose();
        for feature in 0..size {
            covariance[(feature, feature)] += floor;
        }
        let factor = Cholesky::new(covariance)?.unpack();
        let whitening = factor.solve_lower_triangular(&DMatrix::identity(size, size))?;
        let half_log_determinant: f64 = factor.diagonal().iter().map(|d| d.ln()).sum();
        let half_log_tau = 0.5 * size as f64 * std::f64::consts::TAU.ln();
        let constant = (self.weight / points as f64).ln() - half_log_determinant - half_log_tau;
        Some(Component { constant, offsets: &whitening * mean, whitening })
    }
}

impl Component {
    /// Numbers of the component in a blob: c, −o, and W column after column.
    pub fn numbers(&self) -> impl Iterator<Item = f32> {
        let offsets = self.offsets.iter().map(|offset| -offset);
        let numbers = [self.constant].into_iter().chain(offsets);
        numbers.chain(self.whitening.iter().copied()).map(|number| number as f32)
    }

    /// ln π·N(f | μ, Σ).
    fn log_density(&self, point: &DVector<f64>) -> f64 {
        let mut distance = 0.0;
        for (row, offset) in self.offsets.iter().enumerate() {
            let mut product = -offset;
            for column in 0..=row {
                product += self.whitening[(row, column)] * point[column];
            }
            distance += product * product;
        }
        self.constant - 0.5 * distance
    }
}

impl Mixture {
    /// Fits a mixture of at most so many `components` to `points` (`points × size`).
    ///
    /// The same on any number of threads. Components that too few points belong to are left out.
    pub fn fit(points: &[f64], size: usize, components: usize, seed: u64) -> Self {
        let count = points.len() / size;
        let floor = floor(points, size);
        let mut random = Random::new(seed, Stream::Training, Purpose::Mixture, 0, 0);
        let starts = kmeans::fit(points, size, components, &Search::default(), &mut random).centres;
        let nearest = |point: &DVector<f64>| {
            let distances = starts.chunks_exact(size).map(|centre| {
                centre.iter().zip(point).map(|(c, p)| (c - p) * (c - p)).sum::<f64>()
            });
            let mut probabilities = vec![0.0; starts.len() / size];
            if let Some((nearest, _)) = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) {
                probabilities[nearest] = 1.0;
            }
            (probabilities, 0.0)
        };
        let (sums, _) = sums(points, size, starts.len() / size, nearest);
        let of_sums = |sums: &[Sums]| {
            // Fewer points make no covariance.
            let enough = sums.iter().filter(|sums| sums.weight > size as f64);
            let kept: Vec<(f64, Component)> = enough
                .filter_map(|sums| Some((sums.weight, sums.component(count, floor)?)))
                .collect();
            // Components that are left out take no weight with them.
            let left: f64 = kept.iter().map(|(weight, _)| weight / count as f64).sum();
            let with_all = |(_, component): (f64, Component)| Component {
                constant: component.constant - left.ln(),
                ..component
            };
            Self { components: kept.into_iter().map(with_all).collect() }
        };
        let mut mixture = of_sums(&sums);
        if mixture.components.is_empty() {
            // One Gaussian for all points.
            let (sums, _) = self::sums(points, size, 1, |_| (vec![1.0], 0.0));
            return Self { components: sums[0].component(count, floor).into_iter().collect() };
        }
        let mut before = f64::NEG_INFINITY;
        for _ in 0..ITERATIONS {
            let of_point = |point: &DVector<f64>| mixture.probabilities(point);
            let (sums, likelihood) = self::sums(points, size, mixture.components.len(), of_point);
            let next = of_sums(&sums);
            if next.components.is_empty() {
                break;
            }
            mixture = next;
            let likelihood = likelihood / count as f64;
            if likelihood - before < ENOUGH {
                break;
            }
            before = likelihood;
        }
        mixture
    }

    /// Probability of each component given a point, and the point's ln p.
    pub fn probabilities(&self, point: &DVector<f64>) -> (Vec<f64>, f64) {
        let mut of_component: Vec<f64> =
            self.components.iter().map(|component| component.log_density(point)).collect();
        let best = of_component.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        of_component.iter_mut().for_each(|density| *density = (*density - best).exp());
        let sum: f64 = of_component.iter().sum();
        of_component.iter_mut().for_each(|density| *density /= sum);
        (of_component, best + sum.ln())
    }
}

/// Variance that every feature gets besides its own.
fn floor(points: &[f64], size: usize) -> f64 {
    let count = (points.len() / size) as f64;
    let variance = |feature: usize| {
        let values = || points.iter().skip(feature).step_by(size);
        let mean = values().sum::<f64>() / count;
        values().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count
    };
    let variances: Vec<f64> = (0..size).map(variance).collect();
    let least = variances.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = variances.iter().copied().fold(0.0, f64::max);
    // Points that are all the same have no scale: any floor will do.
    if largest > 0.0 { FLOOR[0] * least + FLOOR[1] * largest } else { 1.0 }
}

/// Sums of each component, and the sum of ln p, with the probabilities and ln p that `of_point` tells.
fn sums(
    points: &[f64],
    size: usize,
    components: usize,
    of_point: impl Fn(&DVector<f64>) -> (Vec<f64>, f64) + Sync,
) -> (Vec<Sums>, f64) {
    let of_piece = |piece: &[f64]| {
        let mut sums = vec![Sums::zero(size); components];
        let mut likelihood = 0.0;
        let mut point = DVector::zeros(size);
        for line in piece.chunks_exact(size) {
            point.copy_from_slice(line);
            let (probabilities, log_density) = of_point(&point);
            likelihood += log_density;
            for (sums, probability) in sums.iter_mut().zip(probabilities) {
                if probability > 1e-12 {
                    sums.add(probability, &point);
                }
            }
        }
        (sums, likelihood)
    };
    let pieces = parallel::pieces(points, POINTS_AT_ONCE * size, &of_piece);
    let mut all = (vec![Sums::zero(size); components], 0.0);
    for (sums, likelihood) in &pieces {
        all.0.iter_mut().zip(sums).for_each(|(all, sums)| all.merge(sums));
        all.1 += likelihood;
    }
    all
}

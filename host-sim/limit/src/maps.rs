//! Draws by randomised optimisation, for posteriors that are thin and bent: Bardsley, Solonen, Haario and Laine, SIAM J.
//! Sci. Comput. 36 (2014).
//!
//! Latents and residuals together are F(z) = (z, r(z)), whose squares are twice the negative logarithm of the posterior.
//! Its slopes at a top are Q·R, with orthonormal columns Q. A draw is the z at which QᵀF(z) is QᵀF(top) + ξ, for a standard
//! normal ξ. Where F is linear, these are draws of the posterior itself; where it is bent, they follow the bend. Their
//! density is known: |det QᵀF′(z)|·N(ξ).

use nalgebra::{DMatrix, DVector, Dyn, LU};
use taxel_data::{LANES, Random};

use crate::samples::{Samples, resampled};
use crate::slopes::{Local, locals};
use crate::target::Target;
use crate::weights::{log_sum, normalised};

/// Steps in which a draw is solved, or given up.
const STEPS: usize = 60;
/// Largest difference of a solved draw from its ξ.
const SOLVED: f64 = 1e-3;
/// Logarithm of a density's share of the highest, below which a top is left out.
const NEGLIGIBLE: f64 = -15.0;
/// Share of a step below which it leads nowhere.
const LEAST_LENGTH: f64 = 1e-6;

/// Maps from standard normal numbers to latents, one a top of the posterior.
pub struct Maps {
    maps: Vec<Map>,
    /// Share of each in the draws: what the posterior has there, if it is normal.
    shares: Vec<f64>,
}

struct Map {
    top: DVector<f64>,
    /// Qᵀ, for latents and residuals.
    of_latents: DMatrix<f64>,
    of_residuals: DMatrix<f64>,
    /// QᵀF(top).
    at_top: DVector<f64>,
    /// Natural logarithm of the posterior's mass around the top, but for a constant.
    log_mass: f64,
}

impl Maps {
    /// Maps of these `tops` of the posterior, but for those that the map of a higher one leads to.
    pub fn new<T: Target>(target: &T, mut tops: Vec<Local>, memory: &mut T::Memory) -> Self {
        tops.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
        let mut maps: Vec<Map> = Vec::new();
        while !tops.is_empty() {
            let top = tops.remove(0);
            let map = Map::new(&top);
            let least = top.log_posterior() + NEGLIGIBLE;
            let mut draws: Vec<Draw<'_>> =
                tops.iter().map(|top| Draw::new(&map, map.at(top))).collect();
            let ends = solve(target, &mut draws, memory);
            drop(draws);
            let mut ends = ends.iter();
            let highest = maps.is_empty();
            tops.retain(|top| {
                let is_there = ends.next().is_some_and(|end| end.is_as(top));
                !is_there && (!highest || top.log_posterior() > least)
            });
            maps.push(map);
        }
        let shares = normalised(&maps.iter().map(|map| map.log_mass).collect::<Vec<_>>());
        Self { maps, shares }
    }

    /// Natural logarithm of the posterior's mass around all tops, but for a constant.
    pub fn log_mass(&self) -> f64 {
        log_sum(self.maps.iter().map(|map| map.log_mass))
    }

    /// Draws [`LANES`] samples. One that cannot be solved has the weight 0.
    pub fn draw<T: Target>(
        &self,
        target: &T,
        random: &mut Random,
        memory: &mut T::Memory,
    ) -> Samples {
        let n = target.latents();
        let own = resampled(&self.shares, LANES, random);
        let drawn = own.iter().map(|&map| {
            let map = &self.maps[map];
            Draw::new(map, &map.at_top + DVector::from_fn(n, |_, _| random.normal()))
        });
        let mut drawn: Vec<Draw<'_>> = drawn.collect();
        let found = solve(target, &mut drawn, memory);
        // The density of another map counts where it would have led to the same place, and not to another fold.
        let others = |own: usize| (0..self.maps.len()).filter(move |map| *map != own);
        let pairs = own.iter().zip(&found);
        let again = pairs.flat_map(|(own, local)| {
            others(*own).map(|map| Draw::new(&self.maps[map], self.maps[map].at(local)))
        });
        let mut again: Vec<Draw<'_>> = again.collect();
        let ends = solve(target, &mut again, memory);
        let mut ends = ends.iter();
        let mut samples = Samples::new(n, 0.0);
        for ((&own, draw), local) in own.iter().zip(&drawn).zip(&found) {
            let mut logs = vec![self.log_density(own, local)];
            for map in others(own) {
                let is_same = ends.next().is_some_and(|end| end.is_as(local));
                logs.extend(is_same.then(|| self.log_density(map, local)));
            }
            let log_prior = -0.5 * local.place.norm_squared() - log_sum(logs.iter().copied());
            samples.places.extend(&local.place);
            samples.log_prior.push(if draw.is_solved(local) {
                log_prior
            } else {
                f64::NEG_INFINITY
            });
            samples.log_likelihood.push(local.log_likelihood);
        }
        samples
    }

    /// Natural logarithm of a map's share in the density of draws, but for the constant of a standard normal one.
    fn log_density(&self, map: usize, local: &Local) -> f64 {
        self.shares[map].ln() + self.maps[map].log_density(local)
    }
}

/// Solves all `draws` by Newton's method, from the tops of their maps.
fn solve<T: Target>(target: &T, draws: &mut [Draw<'_>], memory: &mut T::Memory) -> Vec<Local> {
    let mut here = locals(target, draws.iter().map(|draw| &draw.map.top), memory);
    for _ in 0..STEPS {
        let open: Vec<usize> =
            (0..draws.len()).filter(|it| draws[*it].is_open(&here[*it])).collect();
        if open.is_empty() {
            break;
        }
        let steps: Vec<Step> = open.iter().map(|it| draws[*it].step(&here[*it])).collect();
        let there = locals(target, steps.iter().map(|step| &step.to), memory);
        for ((&it, step), there) in open.iter().zip(&steps).zip(there) {
            let draw = &mut draws[it];
            if step.leads_on(&draw.off(&there)) {
                draw.length = (2.0 * draw.length).min(1.0);
                here[it] = there;
            } else {
                draw.length *= 0.25;
            }
        }
    }
    here
}

impl Map {
    fn new(top: &Local) -> Self {
        let (m, n) = top.slopes.shape();
        let mut stacked = DMatrix::identity(n + m, n);
        stacked.rows_mut(n, m).copy_from(&top.slopes);
        let qr = stacked.qr();
        let q = qr.q();
        let log_determinant: f64 = qr.r().diagonal().iter().map(|x| x.abs().ln()).sum();
        let mut map = Self {
            top: top.place.clone(),
            of_latents: q.rows(0, n).transpose(),
            of_residuals: q.rows(n, m).transpose(),
            at_top: DVector::zeros(n),
            log_mass: top.log_posterior() - log_determinant,
        };
        map.at_top = map.at(top);
        map
    }

    /// QᵀF at a place.
    fn at(&self, local: &Local) -> DVector<f64> {
        &self.of_latents * &local.place + &self.of_residuals * &local.residuals
    }

    /// QᵀF′ at a place.
    fn slopes(&self, local: &Local) -> DMatrix<f64> {
        &self.of_latents + &self.of_residuals * &local.slopes
    }

    fn log_density(&self, local: &Local) -> f64 {
        let determinant = self.slopes(local).lu().determinant();
        determinant.abs().ln() - 0.5 * (self.at(local) - &self.at_top).norm_squared()
    }
}

/// Draw that is being solved.
struct Draw<'m> {
    map: &'m Map,
    /// QᵀF of the solution.
    wanted: DVector<f64>,
    /// Share of a whole step that is taken.
    length: f64,
}

impl<'m> Draw<'m> {
    fn new(map: &'m Map, wanted: DVector<f64>) -> Self {
        Self { map, wanted, length: 1.0 }
    }

    fn is_solved(&self, local: &Local) -> bool {
        self.off(local).norm() <= SOLVED
    }

    fn off(&self, local: &Local) -> DVector<f64> {
        self.map.at(local) - &self.wanted
    }

    fn is_open(&self, local: &Local) -> bool {
        self.length > LEAST_LENGTH && !self.is_solved(local)
    }

    /// Step of Newton's method, at most one standard deviation of the prior long.
    fn step(&self, local: &Local) -> Step {
        let slopes = self.map.slopes(local).lu();
        let whole =
            slopes.solve(&self.off(local)).unwrap_or_else(|| DVector::zeros(local.place.len()));
        let whole_length = whole.norm();
        Step {
            to: &local.place - whole * (self.length / whole_length.max(1.0)),
            whole_length,
            slopes,
        }
    }
}

/// Step on the way to a draw.
struct Step {
    to: DVector<f64>,
    /// Length of the step that was wanted.
    whole_length: f64,
    /// Slopes where it begins.
    slopes: LU<f64, Dyn, Dyn>,
}

impl Step {
    /// Whether less is left to go where it ends, which is this far `off`, by the slopes where it begins: along a bent ridge,
    /// a step may well lead away from it (Deuflhard's natural test).
    fn leads_on(&self, off: &DVector<f64>) -> bool {
        self.slopes.solve(off).is_some_and(|left| left.norm() < self.whole_length)
    }
}

//! Slopes of residuals over latents, and the tops of a posterior that they lead to.

use nalgebra::{Cholesky, DMatrix, DVector};
use taxel_data::{LANES, Lanes};

use crate::target::Target;

/// Difference of a latent over which slopes are taken, in its prior's standard deviations: short beside a bend of the
/// sensor's equations, long beside the rounding of readings in f32.
const DIFFERENCE: f64 = 1e-2;
/// Most steps of an ascent.
const STEPS: usize = 40;
/// Gain of the logarithm of the posterior by a step, below which an ascent is at its end.
const AT_THE_END: f64 = 1e-2;
/// Damping at which no step leads on.
const MOST_DAMPING: f64 = 1e6;

/// Readings near a place: how far each is off, and how fast that changes.
pub struct Local {
    pub place: DVector<f64>,
    /// Residuals in standard deviations, one a reading.
    pub residuals: DVector<f64>,
    /// Their slopes, `[reading][latent]`.
    pub slopes: DMatrix<f64>,
    /// Natural logarithm of the likelihood, but for a constant.
    pub log_likelihood: f64,
}

impl Local {
    /// Natural logarithm of prior times likelihood, but for a constant.
    pub fn log_posterior(&self) -> f64 {
        self.log_likelihood - 0.5 * self.place.norm_squared()
    }

    /// Whether another place is this one, but for what a draw is solved to.
    pub fn is_as(&self, other: &Self) -> bool {
        let off = (&self.place - &other.place).norm_squared()
            + (&self.residuals - &other.residuals).norm_squared();
        off < 0.01
    }

    /// Precision of the normal distribution that the posterior is near: that of the prior and of the readings.
    pub fn precision(&self) -> DMatrix<f64> {
        DMatrix::identity(self.place.len(), self.place.len()) + self.slopes.tr_mul(&self.slopes)
    }

    /// Place after a Gauss–Newton step, with the precision's diagonal lifted by a share `damping` (Marquardt, 1963).
    fn stepped(&self, damping: f64) -> DVector<f64> {
        let mut precision = self.precision();
        let lifted = precision.diagonal() * (1.0 + damping);
        precision.set_diagonal(&lifted);
        let gradient = -(&self.place + self.slopes.tr_mul(&self.residuals));
        match Cholesky::new(precision) {
            Some(factor) => &self.place + factor.solve(&gradient),
            None => self.place.clone(),
        }
    }
}

/// Readings near each of the `places`.
pub fn locals<'p, T: Target>(
    target: &T,
    places: impl IntoIterator<Item = &'p DVector<f64>>,
    memory: &mut T::Memory,
) -> Vec<Local> {
    let n = target.latents();
    let lanes = 2 * n + 1;
    let mut latents = vec![[0.0; LANES]; n];
    let mut residuals = vec![[0.0; LANES]; target.readings()];
    let mut all = Vec::new();
    let places: Vec<&DVector<f64>> = places.into_iter().collect();
    for places in places.chunks(LANES / lanes) {
        for (place, lane) in places.iter().zip((0..).step_by(lanes)) {
            for (i, latent) in latents.iter_mut().enumerate() {
                latent[lane..lane + lanes].fill(place[i]);
                latent[lane + 1 + 2 * i] += DIFFERENCE;
                latent[lane + 2 + 2 * i] -= DIFFERENCE;
            }
        }
        let log_likelihood = target.residuals(&latents, memory, &mut residuals);
        for (place, lane) in places.iter().zip((0..).step_by(lanes)) {
            let slope = |k: usize, i: usize| {
                let [above, below] = [1, 2].map(|side| residuals[k][lane + side + 2 * i]);
                (above - below) / (2.0 * DIFFERENCE)
            };
            all.push(Local {
                place: (*place).clone(),
                residuals: DVector::from_fn(residuals.len(), |k, _| residuals[k][lane]),
                slopes: DMatrix::from_fn(residuals.len(), n, slope),
                log_likelihood: log_likelihood[lane],
            });
        }
    }
    all
}

/// Tops of the posterior that damped Gauss–Newton steps lead to, each from one of these `places`.
pub fn tops<T: Target>(target: &T, places: &[DVector<f64>], memory: &mut T::Memory) -> Vec<Local> {
    let mut found = locals(target, places, memory);
    let mut damping = vec![1e-2; found.len()];
    let mut open: Vec<usize> = (0..found.len()).collect();
    for _ in 0..STEPS {
        let next: Vec<DVector<f64>> =
            open.iter().map(|start| found[*start].stepped(damping[*start])).collect();
        let log = log_likelihoods(target, &next, memory);
        let mut higher = Vec::new();
        open = open
            .iter()
            .zip(next.into_iter().zip(log))
            .filter_map(|(&start, (place, log))| {
                let gain = log - 0.5 * place.norm_squared() - found[start].log_posterior();
                damping[start] *= if gain > 0.0 { 0.1 } else { 10.0 };
                if gain > 0.0 {
                    higher.push((start, place));
                }
                (gain.abs() > AT_THE_END && damping[start] < MOST_DAMPING).then_some(start)
            })
            .collect();
        let moved = locals(target, higher.iter().map(|(_, place)| place), memory);
        higher.iter().zip(moved).for_each(|((start, _), local)| found[*start] = local);
        if open.is_empty() {
            break;
        }
    }
    found
}

/// Natural logarithms of the likelihood at `places`.
fn log_likelihoods<T: Target>(
    target: &T,
    places: &[DVector<f64>],
    memory: &mut T::Memory,
) -> Vec<f64> {
    let mut latents: Vec<Lanes> = vec![[0.0; LANES]; target.latents()];
    let of_some = |places: &[DVector<f64>]| {
        for (lane, place) in places.iter().enumerate() {
            latents.iter_mut().zip(place).for_each(|(latent, x)| latent[lane] = *x);
        }
        target.log_likelihood(&latents, memory)[..places.len()].to_vec()
    };
    places.chunks(LANES).flat_map(of_some).collect()
}

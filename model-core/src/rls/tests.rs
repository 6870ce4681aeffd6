use super::*;
use nalgebra::{DMatrix, DVector};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// 16 Gaussians on 8 scaled inputs and their bias: overlapping, like the network's regressors.
const N: usize = 17;

struct Source {
    random: Xoshiro256PlusPlus,
    centres: Vec<[f64; 8]>,
    width: f64,
}

impl Source {
    fn new(width: f64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let centres = (0..N - 1).map(|_| core::array::from_fn(|_| uniform(&mut random))).collect();
        Self { random, centres, width }
    }

    /// Regressors of a random point on a curve through the cube, and a noisy target.
    fn sample(&mut self, noise: f64) -> ([f64; N], f64) {
        let t = uniform(&mut self.random);
        let x: [f64; 8] = core::array::from_fn(|i| 0.5 + 0.4 * (t * (2.0 + i as f64)).sin());
        let mut h = [1.0; N];
        for (h, c) in h.iter_mut().zip(&self.centres) {
            let d2: f64 = x.iter().zip(c).map(|(x, c)| (x - c).powi(2)).sum();
            *h = (-d2 / (2.0 * self.width.powi(2))).exp();
        }
        // The sum of twelve uniforms is close enough to normal for a test.
        let normal = (0..12).map(|_| uniform(&mut self.random)).sum::<f64>() - 6.0;
        (h, (6.0 * t).sin() + noise * normal)
    }
}

fn uniform(random: &mut Xoshiro256PlusPlus) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Ridge regression with penalty 1/δ through the singular values of [H; I/√δ].
fn ridge(samples: &[([f64; N], f64)], initial_covariance: f64) -> DVector<f64> {
    let rows = samples.len() + N;
    let root = 1.0 / initial_covariance.sqrt();
    let h = DMatrix::from_fn(rows, N, |i, j| match i.checked_sub(samples.len()) {
        None => samples[i].0[j],
        Some(k) => f64::from(u8::from(k == j)) * root,
    });
    let y = DVector::from_fn(rows, |i, _| samples.get(i).map_or(0.0, |s| s.1));
    h.svd(true, true).solve(&y, 0.0).unwrap()
}

fn fit(samples: &[([f64; N], f64)], initial_covariance: f64) -> DVector<f64> {
    let mut rls = Rls::<f64, N, 1>::try_new(initial_covariance, 1.0).unwrap();
    for (h, y) in samples {
        rls.update(*h, [*y]);
    }
    DVector::from_iterator(N, rls.output_weights().into_iter().map(|[w]| w))
}

#[test]
fn weights_equal_batch_ridge_on_a_well_conditioned_set() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let samples: Vec<_> = (0..2000)
        .map(|_| {
            let h: [f64; N] = core::array::from_fn(|_| uniform(&mut random) - 0.5);
            let y = h.iter().enumerate().map(|(i, h)| h * (i as f64 - 5.0)).sum::<f64>();
            (h, y + uniform(&mut random))
        })
        .collect();
    for initial_covariance in [1.0, 1e3, 1e6] {
        let batch = ridge(&samples, initial_covariance);
        let relative = (fit(&samples, initial_covariance) - &batch).norm() / batch.norm();
        assert!(relative <= 1e-8, "δ = {initial_covariance}: {relative:e}");
    }
}

#[test]
fn predictions_equal_batch_ridge_on_an_ill_conditioned_set() {
    let mut source = Source::new(2.0);
    let samples: Vec<_> = (0..2000).map(|_| source.sample(0.01)).collect();
    let h = DMatrix::from_fn(samples.len(), N, |i, j| samples[i].0[j]);
    let singular = h.singular_values();
    let gram_condition = (singular.max() / singular.min()).powi(2);
    assert!(gram_condition > 1e16, "the set must be hard: {gram_condition:e}");
    for initial_covariance in [1e3, 1e6, 1e9] {
        let batch = &h * ridge(&samples, initial_covariance);
        let ours = &h * fit(&samples, initial_covariance);
        let relative = (&ours - &batch).norm() / batch.norm();
        assert!(relative <= 1e-6, "δ = {initial_covariance}: {relative:e}");
    }
}

/// RMSE on fresh samples after `updates`, in f32 and in f64.
fn errors_after(updates: usize, width: f64, delta: f64, forgetting: f64) -> (f64, f64) {
    let mut source = Source::new(width);
    let mut narrow = Rls::<f32, N, 1>::try_new(delta as f32, forgetting as f32).unwrap();
    let mut wide = Rls::<f64, N, 1>::try_new(delta, forgetting).unwrap();
    for _ in 0..updates {
        let (h, y) = source.sample(0.05);
        narrow.update(h.map(|h| h as f32), [y as f32]);
        wide.update(h, [y]);
    }
    let (narrow, wide) = (narrow.output_weights(), wide.output_weights());
    assert!(narrow.iter().all(|[w]| w.is_finite()) && wide.iter().all(|[w]| w.is_finite()));
    let mut squares = (0.0, 0.0);
    let fresh = 20_000;
    for _ in 0..fresh {
        let (h, y) = source.sample(0.05);
        let error = |w: &dyn Fn(usize) -> f64| {
            (h.iter().enumerate().map(|(i, h)| h * w(i)).sum::<f64>() - y).powi(2)
        };
        squares.0 += error(&|i| f64::from(narrow[i][0]));
        squares.1 += error(&|i| wide[i][0]);
    }
    ((squares.0 / f64::from(fresh)).sqrt(), (squares.1 / f64::from(fresh)).sqrt())
}

#[test]
fn f32_stays_within_a_tenth_of_f64_after_a_million_updates() {
    for (delta, forgetting) in [(1e3, 1.0), (1e6, 1.0), (1e3, 0.99), (1e6, 0.99)] {
        let (narrow, wide) = errors_after(1_000_000, 0.3, delta, forgetting);
        assert!(wide < 0.2, "the fit itself must work: {wide}");
        let ratio = narrow / wide;
        println!(
            "δ = {delta:e}, λ = {forgetting}: f32 {narrow:.5}, f64 {wide:.5}, ratio {ratio:.5}"
        );
        assert!(ratio <= 1.1, "δ = {delta}, λ = {forgetting}: {ratio}");
    }
}

#[test]
fn unexcited_directions_fade_to_weight_zero() {
    let mut rls = Rls::<f32, 2, 1>::try_new(1e3, 0.9).unwrap();
    for _ in 0..100_000 {
        rls.update([1.0, 0.0], [2.0]);
    }
    let weights = rls.output_weights();
    assert!((weights[0][0] - 2.0).abs() < 1e-5, "{weights:?}");
    assert_eq!(weights[1][0], 0.0);
}

#[test]
fn hopeless_settings_are_refused() {
    for delta in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(Rls::<f32, 2, 1>::try_new(delta, 1.0), Err(RlsError::InitialCovariance));
    }
    for forgetting in [0.0, -0.5, 1.001, f32::NAN] {
        assert_eq!(Rls::<f32, 2, 1>::try_new(1.0, forgetting), Err(RlsError::ForgettingFactor));
    }
}

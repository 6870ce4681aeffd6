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

/// Memory of a recursion for N regressors and one output.
type Memory<T> = [T; Rls::<f64>::values(N, 1)];

fn weights<T: Real>(rls: &Rls<'_, T>) -> [T; N] {
    let mut weights = [T::ZERO; N];
    rls.weights(&mut weights);
    weights
}

fn fit(samples: &[([f64; N], f64)], initial_covariance: f64) -> DVector<f64> {
    let mut memory: Memory<f64> = [0.0; _];
    let mut rls = Rls::try_new(&mut memory, [N, 1], initial_covariance, 1.0).unwrap();
    for (h, y) in samples {
        rls.update(&mut h.clone(), &mut [*y]).unwrap();
    }
    DVector::from_iterator(N, weights(&rls))
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
    let (mut narrow, mut wide): (Memory<f32>, Memory<f64>) = ([0.0; _], [0.0; _]);
    let mut narrow = Rls::try_new(&mut narrow, [N, 1], delta as f32, forgetting as f32).unwrap();
    let mut wide = Rls::try_new(&mut wide, [N, 1], delta, forgetting).unwrap();
    for _ in 0..updates {
        let (h, y) = source.sample(0.05);
        narrow.update(&mut h.map(|h| h as f32), &mut [y as f32]).unwrap();
        wide.update(&mut h.clone(), &mut [y]).unwrap();
    }
    let (narrow, wide) = (weights(&narrow), weights(&wide));
    assert!(narrow.iter().all(|w| w.is_finite()) && wide.iter().all(|w| w.is_finite()));
    let mut squares = (0.0, 0.0);
    let fresh = 20_000;
    for _ in 0..fresh {
        let (h, y) = source.sample(0.05);
        let error = |w: &dyn Fn(usize) -> f64| {
            (h.iter().enumerate().map(|(i, h)| h * w(i)).sum::<f64>() - y).powi(2)
        };
        squares.0 += error(&|i| f64::from(narrow[i]));
        squares.1 += error(&|i| wide[i]);
    }
    ((squares.0 / f64::from(fresh)).sqrt(), (squares.1 / f64::from(fresh)).sqrt())
}

#[test]
fn f32_stays_within_a_tenth_of_f64_after_a_million_updates() {
    for (delta, forgetting) in [(1e3, 1.0), (1e6, 1.0), (1e5, 0.99), (1e6, 0.99)] {
        let (narrow, wide) = errors_after(1_000_000, 0.3, delta, forgetting);
        assert!(wide < 0.2, "the fit itself must work: {wide}");
        let ratio = narrow / wide;
        println!(
            "δ = {delta:e}, λ = {forgetting}: f32 {narrow:.5}, f64 {wide:.5}, ratio {ratio:.5}"
        );
        assert!(ratio <= 1.1, "δ = {delta}, λ = {forgetting}: {ratio}");
    }
}

/// Gaussians of a small network for the long test, and the bias's 1.
const FEW: usize = 5;

/// Regressors of the scalar input x.
fn few(x: f32) -> [f32; FEW] {
    core::array::from_fn(|i| match i {
        4 => 1.0,
        _ => libm::expf(-(x - i as f32 / 3.0).powi(2) / 0.18),
    })
}

#[test]
fn a_resting_noisy_sensor_does_no_harm_in_ten_million_updates() {
    let truth = |x: f32| (3.0 * x).sin();
    for forgetting in [0.9, 0.99, 0.999, 0.9999] {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut noise = || 0.17 * (uniform(&mut random) + uniform(&mut random) - 1.0) as f32;
        let mut memory = [0.0_f32; Rls::<f32>::values(FEW, 1)];
        let mut rls = Rls::try_new(&mut memory, [FEW, 1], 1e3, forgetting).unwrap();
        for i in 0..20_000 {
            let x = (i * 7919 % 1000) as f32 / 1000.0;
            rls.update(&mut few(x), &mut [truth(x) + noise()]).unwrap();
        }
        assert!(rls.is_excited(4.0), "λ = {forgetting}");
        let rest = few(0.4);
        for _ in 0..10_000_000 {
            rls.update(&mut rest.clone(), &mut [truth(0.4) + noise()]).unwrap();
        }
        let mut weights = [0.0; FEW];
        rls.weights(&mut weights);
        let predict = |x: f32| few(x).iter().zip(&weights).map(|(h, w)| h * w).sum::<f32>();
        // The mean of the last 1/(1 − λ) targets, with noise of 0.07.
        let error = (predict(0.4) - truth(0.4)).abs();
        assert!(error < 0.07, "λ = {forgetting}: {error} at rest");
        // It was 1e19.
        let largest = weights.iter().fold(0.0_f32, |most, w| most.max(w.abs()));
        assert!(largest < 1.5, "λ = {forgetting}: {weights:?}");
        assert!(rls.triangle.iter().all(|r| r.abs() <= 1.01 * (10.0 / (1.0 - forgetting)).sqrt()));
        assert!(!rls.is_excited(4.0), "a resting sensor excites one direction: λ = {forgetting}");
        // It learns again as soon as there is something to learn.
        for i in 0..20_000 {
            let x = (i * 7919 % 1000) as f32 / 1000.0;
            rls.update(&mut few(x), &mut [truth(x) + noise()]).unwrap();
        }
        rls.weights(&mut weights);
        let predict = |x: f32| few(x).iter().zip(&weights).map(|(h, w)| h * w).sum::<f32>();
        let worst = (0..=10).map(|i| (predict(i as f32 / 10.0) - truth(i as f32 / 10.0)).abs());
        let worst = worst.fold(0.0, f32::max);
        assert!(worst < 0.15, "λ = {forgetting}: {worst} after presses");
    }
}

#[test]
fn an_unusable_sample_is_refused_and_changes_nothing() {
    let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
    let mut rls = Rls::try_new(&mut memory, [2, 1], 1e3, 0.99).unwrap();
    rls.update(&mut [1.0, 2.0], &mut [3.0]).unwrap();
    let before = (rls.triangle.to_vec(), rls.projection.to_vec(), rls.turn);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e20, -1e20, f32::MAX] {
        for (h, y) in [([bad, 0.0], 0.0), ([0.0, bad], 0.0), ([1.0, 1.0], bad)] {
            assert_eq!(rls.update(&mut h.clone(), &mut [y]), Err(RlsError::UnusableSample));
        }
    }
    assert_eq!(rls.update(&mut [1.0], &mut [1.0]), Err(RlsError::UnusableSample));
    assert_eq!(rls.update(&mut [1.0; 2], &mut [1.0; 2]), Err(RlsError::UnusableSample));
    assert_eq!((rls.triangle.to_vec(), rls.projection.to_vec(), rls.turn), before);
    // The largest usable numbers still give finite weights.
    for _ in 0..1000 {
        rls.update(&mut [1e15, -1e15], &mut [1e15]).unwrap();
    }
    let mut weights = [0.0; 2];
    rls.weights(&mut weights);
    assert!(weights.iter().all(|w| w.is_finite()), "{weights:?}");
}

#[test]
fn unexcited_directions_fade_towards_weight_zero_and_are_told() {
    let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
    let mut rls = Rls::try_new(&mut memory, [2, 1], 1e3, 0.9).unwrap();
    let mut weights = [0.0; 2];
    for _ in 0..100 {
        rls.update(&mut [0.0, 1.0], &mut [5.0]).unwrap();
        rls.update(&mut [1.0, 0.0], &mut [2.0]).unwrap();
    }
    rls.weights(&mut weights);
    assert!((weights[1] - 5.0).abs() < 0.01 && rls.is_excited(10.0), "{weights:?}");
    for _ in 0..100_000 {
        rls.update(&mut [1.0, 0.0], &mut [2.0]).unwrap();
    }
    rls.weights(&mut weights);
    assert!((weights[0] - 2.0).abs() < 1e-3 && weights[1].abs() < 1e-6, "{weights:?}");
    assert!(!rls.is_excited(10.0) && rls.is_excited(0.5));
}

#[test]
fn hopeless_settings_are_refused() {
    let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
    for delta in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-39] {
        let refused = Rls::try_new(&mut memory, [2, 1], delta, 1.0);
        assert_eq!(refused, Err(RlsError::InitialCovariance), "{delta}");
    }
    for forgetting in [0.0, -0.5, 1.001, f32::NAN] {
        let refused = Rls::try_new(&mut memory, [2, 1], 1.0, forgetting);
        assert_eq!(refused, Err(RlsError::ForgettingFactor));
    }
    let refused = Rls::try_new(&mut memory[1..], [2, 1], 1.0, 1.0);
    assert_eq!(refused, Err(RlsError::Memory { expected: 8, found: 7 }));
}

#[test]
fn knowledge_is_counted_in_squares_and_a_direction_without_any_gets_weight_0() {
    let mut memory = [0.0; Rls::<f64>::values(1, 1)];
    let mut rls = Rls::try_new(&mut memory, [1, 1], 1.0, 1.0).unwrap();
    rls.update(&mut [2.0], &mut [6.0]).unwrap();
    assert!(rls.is_excited(4.9) && !rls.is_excited(5.1)); // 1 + 2·2
    let mut weights = [f64::NAN; 2];
    solve(&[3.0, 1.0, 0.0, 0.0], &[6.0, 0.0], 2, &mut weights);
    assert_eq!(weights, [2.0, 0.0]);
}

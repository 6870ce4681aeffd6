//! The sampler against posteriors that are known exactly.

use nalgebra::{DMatrix, DVector};
use taxel_data::{Purpose, Stream};

use super::*;

/// Data y = slope·x + noise of standard deviation `deviation`; the outputs are the latents x.
struct Linear {
    slope: DMatrix<f64>,
    data: DVector<f64>,
    deviation: f64,
}

impl Target for Linear {
    type Memory = ();

    fn latents(&self) -> usize {
        self.slope.ncols()
    }

    fn output_count(&self) -> usize {
        self.slope.ncols()
    }

    fn readings(&self) -> usize {
        self.data.len()
    }

    fn residuals(&self, latents: &[Lanes], (): &mut (), residuals: &mut [Lanes]) -> Lanes {
        for lane in 0..LANES {
            let x = DVector::from_iterator(latents.len(), latents.iter().map(|l| l[lane]));
            let off = (&self.data - &self.slope * x) / self.deviation;
            residuals.iter_mut().zip(&off).for_each(|(to, off)| to[lane] = *off);
        }
        self.log_likelihood(latents, &mut ())
    }

    fn log_likelihood(&self, latents: &[Lanes], (): &mut ()) -> Lanes {
        std::array::from_fn(|lane| {
            let x = DVector::from_iterator(latents.len(), latents.iter().map(|l| l[lane]));
            -0.5 * (&self.data - &self.slope * x).norm_squared() / self.deviation.powi(2)
        })
    }

    fn outputs(&self, latents: &[Lanes], (): &mut (), outputs: &mut [Lanes]) {
        outputs.copy_from_slice(latents);
    }
}

/// One latent x, of which the data is x² with noise: two modes.
struct Square {
    data: f64,
    deviation: f64,
}

impl Target for Square {
    type Memory = ();

    fn latents(&self) -> usize {
        1
    }

    fn output_count(&self) -> usize {
        2
    }

    fn readings(&self) -> usize {
        1
    }

    fn residuals(&self, latents: &[Lanes], (): &mut (), residuals: &mut [Lanes]) -> Lanes {
        residuals[0] = latents[0].map(|x| (self.data - x * x) / self.deviation);
        self.log_likelihood(latents, &mut ())
    }

    fn log_likelihood(&self, latents: &[Lanes], (): &mut ()) -> Lanes {
        latents[0].map(|x| -0.5 * ((self.data - x * x) / self.deviation).powi(2))
    }

    fn outputs(&self, latents: &[Lanes], (): &mut (), outputs: &mut [Lanes]) {
        outputs[0] = latents[0];
        outputs[1] = latents[0].map(f64::abs);
    }
}

/// Two latents x and y, of which the data is y + x² with noise: a thin ridge along a parabola.
struct Parabola {
    data: f64,
    deviation: f64,
}

impl Target for Parabola {
    type Memory = ();

    fn latents(&self) -> usize {
        2
    }

    fn output_count(&self) -> usize {
        2
    }

    fn readings(&self) -> usize {
        1
    }

    fn log_likelihood(&self, latents: &[Lanes], (): &mut ()) -> Lanes {
        let mut residuals = [[0.0; LANES]];
        self.residuals(latents, &mut (), &mut residuals)
    }

    fn residuals(&self, latents: &[Lanes], (): &mut (), residuals: &mut [Lanes]) -> Lanes {
        for lane in 0..LANES {
            let reading = latents[1][lane] + latents[0][lane].powi(2);
            residuals[0][lane] = (self.data - reading) / self.deviation;
        }
        residuals[0].map(|off| -0.5 * off * off)
    }

    fn outputs(&self, latents: &[Lanes], (): &mut (), outputs: &mut [Lanes]) {
        outputs[0] = latents[0].map(|x| x * x);
        outputs[1] = latents[1];
    }
}

fn posterior<T: Target<Memory = ()>>(target: &T, effort: &Effort, index: u64) -> Moments {
    let mut random = Random::new(1, Stream::Test, Purpose::Posterior, index, 0);
    let mut prior = Samples::new(target.latents(), 0.0);
    for _ in 0..32 {
        let mut latents = vec![[0.0; LANES]; target.latents()];
        latents.as_flattened_mut().fill_with(|| random.normal());
        prior.log_likelihood.extend(target.log_likelihood(&latents, &mut ()));
        prior.log_prior.extend([0.0; LANES]);
        for lane in 0..LANES {
            prior.places.extend(latents.iter().map(|latent| latent[lane]));
        }
    }
    let target = std::slice::from_ref(target);
    let samples = sample(target, &[prior], effort, &mut random, &mut ());
    moments(target, &samples, &mut ())
}

#[test]
fn a_linear_posterior_is_the_exact_one() {
    let mut random = Random::new(2, Stream::Test, Purpose::Noise, 0, 0);
    for (index, deviation) in [1.0, 0.1, 0.01].into_iter().enumerate() {
        let slope = DMatrix::from_fn(8, 4, |_, _| random.normal());
        let truth = DVector::from_fn(4, |_, _| random.normal());
        let noise = DVector::from_fn(8, |_, _| deviation * random.normal());
        let target = Linear { data: &slope * truth + noise, slope, deviation };
        let precision =
            DMatrix::identity(4, 4) + target.slope.transpose() * &target.slope / deviation.powi(2);
        let covariance = precision.try_inverse().unwrap();
        let exact = &covariance * target.slope.transpose() * &target.data / deviation.powi(2);
        let effort = Effort { wanted: 2000.0, ..Effort::new(4) };
        let found = posterior(&target, &effort, index as u64);
        assert!(found.effective >= 2000.0, "{}", found.effective);
        for i in 0..4 {
            let standard_error = (covariance[(i, i)] / found.effective).sqrt();
            let off = (found.mean[i] - exact[i]) / standard_error;
            assert!(off.abs() < 4.0, "deviation {deviation}, latent {i}: {off} standard errors");
            let ratio = found.variance[i] / covariance[(i, i)];
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / found.effective).sqrt(), "{ratio}");
        }
    }
}

#[test]
fn a_posterior_with_two_modes_is_that_of_a_fine_grid() {
    let target = Square { data: 1.2, deviation: 0.05 };
    let [mut sum, mut sums] = [0.0, 0.0];
    for i in -60_000..60_000 {
        let x = (f64::from(i) + 0.5) * 1e-4;
        let off: f64 = (target.data - x * x) / target.deviation;
        let density = (-0.5 * (x * x + off * off)).exp();
        sum += density;
        sums += density * x.abs();
    }
    let effort = Effort { wanted: 1000.0, ..Effort::new(1) };
    let found = posterior(&target, &effort, 0);
    for (i, exact) in [0.0, sums / sum].into_iter().enumerate() {
        let standard_error = (found.variance[i] / found.effective).sqrt();
        assert!((found.mean[i] - exact).abs() < 4.0 * standard_error, "{} {exact}", found.mean[i]);
    }
}

#[test]
fn a_posterior_on_a_thin_bent_ridge_is_that_along_the_ridge() {
    for deviation in [1e-3, 1e-6] {
        let target = Parabola { data: 0.4, deviation };
        // Along the ridge, y is 0.4 − x²; the noise adds nothing that counts.
        let [mut sum, mut sums] = [0.0, 0.0];
        for i in -60_000..60_000 {
            let x = (f64::from(i) + 0.5) * 1e-4;
            let density = (-0.5 * (x * x + (target.data - x * x).powi(2))).exp();
            sum += density;
            sums += density * x * x;
        }
        let effort = Effort { wanted: 500.0, solved: 100, ..Effort::new(2) };
        let found = posterior(&target, &effort, 0);
        assert!(found.effective >= 500.0, "{}", found.effective);
        let mean = sums / sum;
        for (i, exact) in [mean, target.data - mean].into_iter().enumerate() {
            let standard_error = (found.variance[i] / found.effective).sqrt();
            let off = (found.mean[i] - exact) / standard_error;
            assert!(off.abs() < 4.0, "deviation {deviation}, output {i}: {off} standard errors");
        }
    }
}

#[test]
fn a_population_that_does_not_arrive_says_so() {
    let data = DVector::from_element(3, 3.0);
    let target = Linear { slope: DMatrix::identity(3, 3), data, deviation: 1e-6 };
    let found = posterior(&target, &Effort { rounds: 2, solved: 0, ..Effort::new(3) }, 0);
    assert!(found.effective < 2.0, "{}", found.effective);
}

#[test]
fn the_variance_of_few_samples_is_unbiased() {
    let target = Linear { slope: DMatrix::zeros(1, 1), data: DVector::zeros(1), deviation: 1.0 };
    let samples = Samples {
        latents: 1,
        log_share: 0.0,
        places: (0..LANES).map(|i| i as f64).collect(),
        log_prior: vec![0.0; LANES],
        log_likelihood: vec![0.0; LANES],
    };
    let found = moments(&[target], &[samples], &mut ());
    // Of 0, 1, … n − 1: n(n + 1)/12.
    let n = LANES as f64;
    assert!((found.effective - n).abs() < 1e-9 && (found.mean[0] - (n - 1.0) / 2.0).abs() < 1e-9);
    assert!((found.variance[0] - n * (n + 1.0) / 12.0).abs() < 1e-9, "{found:?}");
}

/// Readings that two kinds of motion explain, one of them better: the population arrives at the first noise, not at the second.
#[test]
fn kinds_of_motion_have_the_shares_of_bayes() {
    for deviation in [0.2, 1e-6] {
        let kind = |gain| Linear {
            slope: DMatrix::identity(2, 2) * gain,
            data: DVector::from_vec(vec![0.5, 1.0]),
            deviation,
        };
        let (targets, shares) = ([kind(1.0), kind(3.0)], [0.25, 0.75]);
        let mut random = Random::new(3, Stream::Test, Purpose::Posterior, 0, 0);
        let priors = std::array::from_fn::<_, 2, _>(|kind| {
            let places: Vec<f64> = (0..64 * LANES).map(|_| random.normal()).collect();
            let mut prior = Samples::new(2, f64::ln(shares[kind]));
            for places in places.chunks_exact(2 * LANES) {
                let latents: [Lanes; 2] =
                    std::array::from_fn(|i| std::array::from_fn(|lane| places[2 * lane + i]));
                prior.log_likelihood.extend(targets[kind].log_likelihood(&latents, &mut ()));
            }
            prior.log_prior = vec![0.0; prior.log_likelihood.len()];
            Samples { places, ..prior }
        });
        let effort = Effort { wanted: 1000.0, ..Effort::new(2) };
        let samples = sample(&targets, &priors, &effort, &mut random, &mut ());
        let found = moments(&targets, &samples, &mut ());
        // The data are normal with the variance gain² + deviation², the mean latents gain·data over it.
        let of_kind = [1.0, 3.0].map(|gain: f64| (gain, gain * gain + deviation * deviation));
        let masses: Vec<f64> = of_kind
            .iter()
            .zip(shares)
            .map(|((_, variance), share)| share / variance * (-0.625 / variance).exp())
            .collect();
        let means =
            of_kind.iter().zip(&masses).map(|((gain, variance), mass)| mass * gain / variance);
        let per_data = means.sum::<f64>() / masses.iter().sum::<f64>();
        for (i, data) in [0.5, 1.0].into_iter().enumerate() {
            let standard_error = (found.variance[i] / found.effective).sqrt();
            let off = (found.mean[i] - data * per_data) / standard_error;
            assert!(off.abs() < 4.0, "deviation {deviation}, latent {i}: {off} standard errors");
        }
    }
}

/// Readings that no step of a draw leads along.
struct Saw;

impl Target for Saw {
    type Memory = ();

    fn latents(&self) -> usize {
        1
    }

    fn output_count(&self) -> usize {
        1
    }

    fn readings(&self) -> usize {
        1
    }

    fn log_likelihood(&self, latents: &[Lanes], (): &mut ()) -> Lanes {
        latents[0].map(|x| -0.5 * (1e6 * (1e3 * x).fract()).powi(2))
    }

    fn residuals(&self, latents: &[Lanes], (): &mut (), residuals: &mut [Lanes]) -> Lanes {
        residuals[0] = latents[0].map(|x| 1e6 * (1e3 * x).fract());
        self.log_likelihood(latents, &mut ())
    }

    fn outputs(&self, latents: &[Lanes], (): &mut (), outputs: &mut [Lanes]) {
        outputs.copy_from_slice(latents);
    }
}

#[test]
fn draws_that_lead_nowhere_end_early() {
    let mut random = Random::new(4, Stream::Test, Purpose::Posterior, 0, 0);
    let mut prior = Samples::new(1, 0.0);
    prior.places = (0..LANES).map(|_| random.normal()).collect();
    prior.log_prior = vec![0.0; LANES];
    let places = std::array::from_fn(|lane| prior.places[lane]);
    prior.log_likelihood = Saw.log_likelihood(&[places], &mut ()).to_vec();
    let effort = Effort { rounds: 0, solved: 40, ..Effort::new(1) };
    let samples = sample(&[Saw], &[prior], &effort, &mut random, &mut ());
    assert_eq!(samples[0].len(), 10 * LANES);
}

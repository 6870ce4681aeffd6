//! The sampler against posteriors that are known exactly.

use nalgebra::{DMatrix, DVector};
use taxel_data::{LANES, Lanes, Purpose, Random, Stream};
use taxel_limit::population::{Effort, Moments, moments, sample};
use taxel_limit::samples::Samples;
use taxel_limit::target::Target;

/// Function of latents.
type OfLatents = Box<dyn Fn(&[f64], &mut [f64]) + Sync>;

/// Residuals and outputs as functions of latents. One type for all, so that the sampler is compiled once.
struct Functions {
    /// Numbers of latents, residuals and outputs.
    counts: [usize; 3],
    residuals: OfLatents,
    outputs: OfLatents,
}

impl Functions {
    /// Calls one of the functions in each lane.
    fn in_lanes(of: &dyn Fn(&[f64], &mut [f64]), latents: &[Lanes], found: &mut [Lanes]) {
        let mut of_lane = vec![0.0; found.len()];
        for lane in 0..LANES {
            let latents: Vec<f64> = latents.iter().map(|latent| latent[lane]).collect();
            of(&latents, &mut of_lane);
            found.iter_mut().zip(&of_lane).for_each(|(found, of_lane)| found[lane] = *of_lane);
        }
    }
}

impl Target for Functions {
    type Memory = ();

    fn latents(&self) -> usize {
        self.counts[0]
    }

    fn readings(&self) -> usize {
        self.counts[1]
    }

    fn output_count(&self) -> usize {
        self.counts[2]
    }

    fn log_likelihood(&self, latents: &[Lanes], (): &mut ()) -> Lanes {
        self.residuals(latents, &mut (), &mut vec![[0.0; LANES]; self.counts[1]])
    }

    fn residuals(&self, latents: &[Lanes], (): &mut (), residuals: &mut [Lanes]) -> Lanes {
        Self::in_lanes(&self.residuals, latents, residuals);
        std::array::from_fn(|lane| -0.5 * residuals.iter().map(|it| it[lane].powi(2)).sum::<f64>())
    }

    fn outputs(&self, latents: &[Lanes], (): &mut (), outputs: &mut [Lanes]) {
        Self::in_lanes(&self.outputs, latents, outputs);
    }
}

/// Data y = slope·x + noise of standard deviation `deviation`; the outputs are the latents x.
fn linear(slope: DMatrix<f64>, data: DVector<f64>, deviation: f64) -> Functions {
    Functions {
        counts: [slope.ncols(), slope.nrows(), slope.ncols()],
        residuals: Box::new(move |latents, residuals| {
            for (k, residual) in residuals.iter_mut().enumerate() {
                let reading: f64 = slope.row(k).iter().zip(latents).map(|(s, x)| s * x).sum();
                *residual = (data[k] - reading) / deviation;
            }
        }),
        outputs: Box::new(|latents, outputs| outputs.copy_from_slice(latents)),
    }
}

/// One latent x, of which the data is x² with noise: two modes.
fn square(data: f64, deviation: f64) -> Functions {
    Functions {
        counts: [1, 1, 2],
        residuals: Box::new(move |x, residuals| residuals[0] = (data - x[0] * x[0]) / deviation),
        outputs: Box::new(|x, outputs| outputs.copy_from_slice(&[x[0], x[0].abs()])),
    }
}

/// Two latents x and y, of which the data is y + x² with noise: a thin ridge along a parabola.
fn parabola(data: f64, deviation: f64) -> Functions {
    Functions {
        counts: [2, 1, 2],
        residuals: Box::new(move |at, residuals| {
            residuals[0] = (data - at[1] - at[0] * at[0]) / deviation;
        }),
        outputs: Box::new(|at, outputs| outputs.copy_from_slice(&[at[0] * at[0], at[1]])),
    }
}

/// Readings that no step of a draw leads along.
fn saw() -> Functions {
    Functions {
        counts: [1, 1, 1],
        residuals: Box::new(|x, residuals| residuals[0] = 1e6 * (1e3 * x[0]).fract()),
        outputs: Box::new(|x, outputs| outputs.copy_from_slice(x)),
    }
}

fn posterior(target: &Functions, effort: &Effort, index: u64) -> Moments {
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
        let data = &slope * truth + noise;
        let precision = DMatrix::identity(4, 4) + slope.transpose() * &slope / deviation.powi(2);
        let covariance = precision.try_inverse().unwrap();
        let exact = &covariance * slope.transpose() * &data / deviation.powi(2);
        let effort = Effort { wanted: 2000.0, ..Effort::new(4) };
        let found = posterior(&linear(slope, data, deviation), &effort, index as u64);
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
    let (data, deviation) = (1.2, 0.05);
    let [mut sum, mut sums] = [0.0, 0.0];
    for i in -60_000..60_000 {
        let x = (f64::from(i) + 0.5) * 1e-4;
        let off: f64 = (data - x * x) / deviation;
        let density = (-0.5 * (x * x + off * off)).exp();
        sum += density;
        sums += density * x.abs();
    }
    let effort = Effort { wanted: 1000.0, ..Effort::new(1) };
    let found = posterior(&square(data, deviation), &effort, 0);
    for (i, exact) in [0.0, sums / sum].into_iter().enumerate() {
        let standard_error = (found.variance[i] / found.effective).sqrt();
        assert!((found.mean[i] - exact).abs() < 4.0 * standard_error, "{} {exact}", found.mean[i]);
    }
}

#[test]
fn a_posterior_on_a_thin_bent_ridge_is_that_along_the_ridge() {
    let data = 0.4;
    for deviation in [1e-3, 1e-6] {
        // Along the ridge, y is 0.4 − x²; the noise adds nothing that counts.
        let [mut sum, mut sums] = [0.0, 0.0];
        for i in -60_000..60_000 {
            let x = (f64::from(i) + 0.5) * 1e-4;
            let density = (-0.5 * (x * x + (data - x * x).powi(2))).exp();
            sum += density;
            sums += density * x * x;
        }
        let effort = Effort { wanted: 500.0, solved: 100, ..Effort::new(2) };
        let found = posterior(&parabola(data, deviation), &effort, 0);
        assert!(found.effective >= 500.0, "{}", found.effective);
        let mean = sums / sum;
        for (i, exact) in [mean, data - mean].into_iter().enumerate() {
            let standard_error = (found.variance[i] / found.effective).sqrt();
            let off = (found.mean[i] - exact) / standard_error;
            assert!(off.abs() < 4.0, "deviation {deviation}, output {i}: {off} standard errors");
        }
    }
}

#[test]
fn a_population_that_does_not_arrive_says_so() {
    let data = DVector::from_element(3, 3.0);
    let target = linear(DMatrix::identity(3, 3), data, 1e-6);
    let found = posterior(&target, &Effort { rounds: 2, solved: 0, ..Effort::new(3) }, 0);
    assert!(found.effective < 2.0, "{}", found.effective);
}

#[test]
fn the_variance_of_few_samples_is_unbiased() {
    let target = linear(DMatrix::zeros(1, 1), DVector::zeros(1), 1.0);
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
        let data = DVector::from_vec(vec![0.5, 1.0]);
        let kind = |gain| linear(DMatrix::identity(2, 2) * gain, data.clone(), deviation);
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

#[test]
fn draws_that_lead_nowhere_end_early() {
    let mut random = Random::new(4, Stream::Test, Purpose::Posterior, 0, 0);
    let mut prior = Samples::new(1, 0.0);
    prior.places = (0..LANES).map(|_| random.normal()).collect();
    prior.log_prior = vec![0.0; LANES];
    let places = std::array::from_fn(|lane| prior.places[lane]);
    prior.log_likelihood = saw().log_likelihood(&[places], &mut ()).to_vec();
    let effort = Effort { rounds: 0, solved: 40, ..Effort::new(1) };
    let samples = sample(&[saw()], &[prior], &effort, &mut random, &mut ());
    assert_eq!(samples[0].len(), 10 * LANES);
}

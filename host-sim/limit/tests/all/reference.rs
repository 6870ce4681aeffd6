//! Figures of a reference whose posteriors are made up.

use taxel_data::Table;
use taxel_limit::limit::Posterior;
use taxel_limit::{Reference, Refusal};

/// Two outputs of some frames: the truth is off the posterior mean by one deviation, up and down.
fn reference(effective: f64, off: f64, kurtosis: f64) -> Reference {
    let names = ["r1e1_dz_mm", "r1e2_dz_mm"].map(String::from).to_vec();
    let mut truth = Table { names, values: Vec::new().into() };
    let mut posteriors = Vec::new();
    for i in 0..100 {
        let mean = vec![f64::from(i % 7), 2.0 - f64::from(i % 5)];
        let side = if i % 2 == 0 { off } else { -off };
        truth.values.extend([mean[0] + side, mean[1] - side]);
        let variance = vec![0.039 + 1e-3 * f64::from(i % 3); 2];
        let fourth = variance.iter().map(|it| kurtosis * it * it).collect();
        posteriors.push(Posterior { mean, variance, fourth, effective: vec![effective; 2] });
    }
    Reference { truth, posteriors, prior_variance: vec![1.0; 2], apart: 1 }
}

#[test]
fn the_ratio_is_that_of_the_errors() {
    let reference = reference(1e6, 0.2, 3.0);
    assert_eq!(reference.check(100.0), Ok(()));
    let limit = &reference.limits()[0];
    assert!((limit.limit - 0.2).abs() < 1e-3 && (limit.rmse - 0.2).abs() < 1e-3);
    // A decoder that is 0.15 mm off the posterior mean, on whichever side: √(0.04 + 0.0225)/0.2.
    let mut estimates = Vec::new();
    for (i, posterior) in reference.posteriors.iter().enumerate() {
        let side = if i % 4 < 2 { 0.15 } else { -0.15 };
        estimates.extend(posterior.mean.iter().map(|mean| mean + side));
    }
    let ratio = reference.ratio(&reference.truth, &estimates, &[0, 1]).unwrap();
    assert!((ratio.ratio - 1.25).abs() < 2e-3, "{ratio:?}");
    let errors = reference.truth.squared_errors(&estimates);
    let plain = ((errors[0] + errors[1]) / 200.0).sqrt() / limit.limit;
    assert!((ratio.ratio - plain).abs() < 2e-3, "{plain}");
}

#[test]
fn other_frames_and_missing_estimates_have_no_ratio() {
    let reference = reference(100.0, 0.2, 3.0);
    let mut estimates = reference.truth.values.clone();
    let mut other = reference.truth.clone();
    other.values[3] += 0.1;
    assert_eq!(reference.ratio(&other, &estimates, &[0, 1]), None);
    estimates[5] = f64::NAN;
    assert_eq!(reference.ratio(&reference.truth, &estimates, &[0, 1]), None);
    assert_eq!(reference.ratio(&reference.truth, &estimates[..100], &[0, 1]), None);
}

#[test]
fn a_sample_that_does_not_carry_the_figures_is_refused() {
    let refusal = |effective, off| reference(effective, off, 3.0).check(100.0).unwrap_err();
    assert!(matches!(refusal(99.0, 0.2), Refusal::Thin { of: 100, .. }));
    assert!(matches!(refusal(f64::NAN, 0.2), Refusal::Thin { of: 100, .. }));
    assert!(matches!(refusal(1e6, 0.3), Refusal::Inconsistent { .. }));
    assert!(matches!(refusal(1e6, 0.1), Refusal::Inconsistent { .. }));
    // Errors that are rare and large: none is among the frames.
    assert_eq!(reference(1e6, 0.1, 1e4).check(100.0), Ok(()));
}

/// Two outputs of two frames, whose figures are worked out by hand.
#[test]
fn figures_of_two_frames_are_those_worked_out_by_hand() {
    let names = ["r1e1_dz_mm", "r1e2_dz_mm"].map(String::from).to_vec();
    let posterior = |mean: [f64; 2], variance: [f64; 2], effective: f64| Posterior {
        mean: mean.to_vec(),
        variance: variance.to_vec(),
        fourth: vec![0.0; 2],
        effective: vec![effective; 2],
    };
    let reference = Reference {
        truth: Table { names, values: vec![3.0, 0.0, 1.0, 5.0].into() },
        posteriors: vec![
            posterior([1.0, 0.0], [2.0, 4.0], 10.0),
            posterior([1.0, 1.0], [6.0, 8.0], 20.0),
        ],
        prior_variance: vec![9.0, 16.0],
        apart: 1,
    };
    // Means over the outputs: variances 3 and 7, squared errors 2 and 8, their own errors 3/10 and 7/20.
    let limit = &reference.limits()[0];
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-12, "{found} is not {expected}: {limit:?}");
    };
    close(limit.limit, 5.0_f64.sqrt());
    close(limit.limit_standard_error, 0.5 * 2.0 / 5.0_f64.sqrt());
    close(limit.rmse, 4.675_f64.sqrt());
    close(limit.rmse_standard_error, 0.5 * 2.975 / 4.675_f64.sqrt());
    close(limit.prior_rmse, 12.5_f64.sqrt());
    close(limit.monte_carlo_share, 0.325 / 5.325);
    // A decoder that is off the means by 2 and 4: squares 4 and 16, less 0.3 and 0.35.
    let estimates = [3.0, 2.0, 5.0, 5.0];
    let ratio = reference.ratio(&reference.truth, &estimates, &[0, 1]).unwrap();
    let share: f64 = (3.7 + 15.65) / 10.0;
    close(ratio.ratio, (1.0 + share).sqrt());
    let off = [3.7 - 3.0 * share, 15.65 - 7.0 * share];
    let error = f64::midpoint(off[0].powi(2), off[1].powi(2)).sqrt() / 5.0;
    close(ratio.standard_error, 0.5 * error / ratio.ratio);
    let effective = reference.effective();
    assert_eq!((effective.least, effective.median), (10.0, 20.0));
    // Of one output alone, the other does not count.
    let second = &reference.columns(1, 1).limits()[0];
    assert_eq!((second.limit, second.prior_rmse), (6.0_f64.sqrt(), 4.0));
}

//! Recursive least squares.

use taxel_learn::rls::{LARGEST, Rls};
use taxel_learn::train::least_squares::Factor;

#[test]
fn the_largest_usable_numbers_give_finite_weights() {
    let mut rls = Rls::new([2, 1], 1e3, 0.99).unwrap();
    for _ in 0..1000 {
        rls.update(&mut [LARGEST, -LARGEST], &mut [LARGEST]).unwrap();
    }
    assert!(rls.weights().iter().all(|w| w.is_finite()), "{:?}", rls.weights());
}

#[test]
fn unexcited_directions_fade_towards_weight_zero() {
    let mut rls = Rls::new([2, 1], 1e3, 0.9).unwrap();
    for _ in 0..100 {
        rls.update(&mut [0.0, 1.0], &mut [5.0]).unwrap();
        rls.update(&mut [1.0, 0.0], &mut [2.0]).unwrap();
    }
    assert!((rls.weights()[1] - 5.0).abs() < 0.01, "{:?}", rls.weights());
    // Without leakage, weights stay until their information is no normal number: thousands of updates.
    for _ in 0..300 {
        rls.update(&mut [1.0, 0.0], &mut [2.0]).unwrap();
    }
    let weights = rls.weights();
    assert!((weights[0] - 2.0).abs() < 1e-3 && weights[1].abs() < 1e-6, "{weights:?}");
}

#[test]
fn with_forgetting_the_recursion_follows_what_changes() {
    let slope = |forgetting_factor: f64| {
        let mut rls = Rls::new([2, 1], 1e6, forgetting_factor).unwrap();
        for t in 0..2000 {
            let x = f64::from(t % 7);
            let slope = if t < 1000 { 1.0 } else { -1.0 };
            rls.update(&mut [x, 1.0], &mut [slope * x]).unwrap();
        }
        rls.weights()[0]
    };
    assert!((slope(0.99) + 1.0).abs() < 1e-3, "{}", slope(0.99));
    assert!(slope(1.0).abs() < 0.1, "{}", slope(1.0));
}

#[test]
fn hopeless_settings_are_refused() {
    let field = |covariance, factor| Rls::new([2, 1], covariance, factor).unwrap_err().field;
    for covariance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-310] {
        assert_eq!(field(covariance, 1.0), "initial_covariance", "{covariance}");
    }
    for factor in [0.0, -0.5, 1.001, f64::NAN] {
        assert_eq!(field(1.0, factor), "forgetting_factor", "{factor}");
    }
}

#[test]
fn a_direction_without_any_knowledge_gets_weight_0() {
    let (root, projection) = (vec![3.0, 1.0, 0.0, 0.0], vec![6.0, 0.0]);
    let factor = Factor { root, projection, regressors: 2, outputs: 1 };
    assert_eq!(factor.weights(), [2.0, 0.0]);
}

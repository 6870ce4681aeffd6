//! Weights of samples.

use taxel_limit::weights::{effective, normalised};

#[test]
fn equal_weights_are_all_effective_and_one_weight_is_one() {
    assert!((effective(&normalised(&[-3.0; 10])) - 10.0).abs() < 1e-12);
    assert!((effective(&normalised(&[0.0, -800.0, -900.0])) - 1.0).abs() < 1e-12);
    assert_eq!(effective(&normalised(&[f64::NEG_INFINITY; 3])), 0.0);
}

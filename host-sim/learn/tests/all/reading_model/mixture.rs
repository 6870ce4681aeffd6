//! Mixtures of Gaussians.

use nalgebra::DVector;
use taxel_data::{Purpose, Random, Stream};
use taxel_learn::reading_model::mixture::Mixture;

/// Points of two Gaussians: at (0, 0), round, and at (10, 0), long along the diagonal.
fn points(count: usize) -> Vec<f64> {
    let mut random = Random::new(3, Stream::Training, Purpose::Noise, 0, 0);
    let mut points = Vec::new();
    for index in 0..count {
        let (a, b) = (random.normal(), random.normal());
        points.extend(if index % 4 == 0 { [10.0 + 3.0 * a + b, 3.0 * a - b] } else { [a, b] });
    }
    points
}

#[test]
fn a_mixture_finds_the_gaussians_that_points_were_drawn_from() {
    let mixture = Mixture::fit(&points(40_000), 2, 2, 1);
    assert_eq!(mixture.components.len(), 2);
    let log_density = |x: f64, y: f64| mixture.probabilities(&DVector::from_vec(vec![x, y])).1;
    let normal = |x: f64, y: f64| {
        let round = 0.75 * (-0.5 * (x * x + y * y)).exp();
        // a = (x + y − 10)/6, b = (x − y − 10)/2, and a determinant of 6.
        let (a, b) = ((x + y - 10.0) / 6.0, (x - y - 10.0) / 2.0);
        let long = 0.25 / 6.0 * (-0.5 * (a * a + b * b)).exp();
        ((round + long) / std::f64::consts::TAU).ln()
    };
    for (x, y) in [(0.0, 0.0), (1.5, -1.0), (10.0, 0.0), (13.0, 3.0), (7.0, -3.0), (5.0, 0.0)] {
        let difference = log_density(x, y) - normal(x, y);
        assert!(difference.abs() < 0.06, "({x}, {y}): {difference}");
    }
    let probabilities = mixture.probabilities(&DVector::from_vec(vec![10.0, 0.0])).0;
    assert!(probabilities.iter().any(|probability| *probability > 0.999));
}

#[test]
fn points_that_are_few_or_equal_still_make_a_mixture() {
    for points in [vec![1.0, 2.0], vec![1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 1.0, 2.0]] {
        let mixture = Mixture::fit(&points, 2, 4, 1);
        assert_eq!(mixture.components.len(), 1);
        let (probabilities, at) = mixture.probabilities(&DVector::from_vec(vec![1.0, 2.0]));
        let (_, beside) = mixture.probabilities(&DVector::from_vec(vec![1.1, 2.0]));
        assert!(probabilities == [1.0] && at.is_finite() && beside < at, "{at} {beside}");
    }
}

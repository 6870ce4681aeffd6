use nalgebra::DMatrix;

use super::*;
use taxel_data::{Purpose, Random, Stream};

fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

fn predictions(design: &impl Design, samples: usize, factor: &Factor) -> Vec<f64> {
    let (weights, mut h) = (factor.weights(), vec![0.0; factor.regressors]);
    let mut all = Vec::new();
    for i in 0..samples {
        design.fill(i..i + 1, &mut h);
        let at = |output: usize| weights.iter().skip(output).step_by(factor.outputs);
        all.extend(
            (0..factor.outputs).map(|o| h.iter().zip(at(o)).map(|(h, w)| h * w).sum::<f64>()),
        );
    }
    all
}

/// Centres, scaled inputs and targets of a smooth function with noise.
struct Case {
    centres: Vec<f64>,
    scaled: Vec<f64>,
    targets: Vec<f64>,
    inputs: usize,
}

impl Case {
    fn new(samples: usize, centres: usize, inputs: usize, outputs: usize) -> Self {
        let mut random = Random::new(5, Stream::Training, Purpose::Noise, 0, 0);
        let mut draw = |count: usize| (0..count).map(|_| random.unit()).collect::<Vec<f64>>();
        let (centres, scaled) = (draw(centres * inputs), draw(samples * inputs));
        let mut targets = draw(samples * outputs);
        for (targets, x) in targets.chunks_exact_mut(outputs).zip(scaled.chunks_exact(inputs)) {
            for (o, target) in targets.iter_mut().enumerate() {
                *target = 0.1 * *target + (3.0 * x[o % inputs] + o as f64).sin() * x[0];
            }
        }
        Self { centres, scaled, targets, inputs }
    }

    fn regressors<'c>(&'c self, decays: &'c [f64], affine_tail: bool) -> Regressors<'c> {
        Regressors { centres: &self.centres, inputs: self.inputs, decays, affine_tail }
    }
}

#[test]
fn groups_of_rows_give_the_weights_of_the_recursion_whatever_the_shape() {
    let shapes = [
        // Samples, centres, inputs, outputs: partial groups of rows, panels and tiles of every kind.
        (1, 1, 1, 1),
        (7, 3, 2, 1),
        (ROWS_AT_ONCE - 1, 22, 2, 3),
        (ROWS_AT_ONCE + 1, 23, 1, 8),
        (400, 24, 3, 9),
        (1500, 47, 5, 2),
        (2600, 60, 4, 17),
    ];
    for (samples, centres, inputs, outputs) in shapes {
        let case = Case::new(samples, centres, inputs, outputs);
        let decays = [30.0 / inputs as f64];
        let regressors = case.regressors(&decays, samples % 2 == 0);
        let design = regressors.of(&case.scaled);
        let blocked = Factor::new(&design, &case.targets, outputs, 1e2);
        let recursive = Factor::by_recursion(&design, &case.targets, outputs, 1e2);
        for (blocked, recursive) in [
            (&blocked.weights(), &recursive.weights()),
            (&blocked.root, &recursive.root),
            (&blocked.projection, &recursive.projection),
        ] {
            let relative = relative_difference(blocked, recursive);
            assert!(relative <= 1e-10, "{samples} × {centres}: {relative:e}");
        }
    }
}

#[test]
fn groups_of_rows_predict_as_the_recursion_does_where_regressors_are_all_but_dependent() {
    let case = Case::new(3000, 48, 2, 3);
    let regressors = case.regressors(&[0.05], true);
    let design = regressors.of(&case.scaled);
    let n = design.regressors();
    let mut h = vec![0.0; 3000 * n];
    design.fill(0..3000, &mut h);
    let singular = DMatrix::from_row_slice(3000, n, &h).singular_values();
    assert!(singular.max() / singular.min() > 1e12, "the set must be hard");
    // Rounding grows with the condition of R, which the penalty limits to about 4e5 and 1e7 for the last
    // two.
    for (covariance, allowed) in [(1.0, 1e-10), (1e6, 1e-10), (1e9, 1e-9)] {
        let blocked = Factor::new(&design, &case.targets, 3, covariance);
        let recursive = Factor::by_recursion(&design, &case.targets, 3, covariance);
        let predicted = [&blocked, &recursive].map(|factor| predictions(&design, 3000, factor));
        let relative = relative_difference(&predicted[0], &predicted[1]);
        println!("δ = {covariance:e}: predictions differ by {relative:.1e}");
        assert!(relative <= allowed, "δ = {covariance:e}: {relative:e}");
    }
}

#[test]
fn groups_of_activations_are_those_of_single_samples() {
    let case = Case::new(50, 37, 7, 1);
    let own: Vec<f64> = (0..37).map(|k| 0.2 * f64::from(k + 1)).collect();
    for decays in [&[0.1][..], &[5.0], &[900.0], &own] {
        let regressors = case.regressors(decays, true);
        let n = regressors.count();
        let mut blocked = vec![0.0; 50 * n];
        regressors.of(&case.scaled).fill(0..50, &mut blocked);
        let mut single = vec![0.0; n];
        for (line, blocked) in case.scaled.chunks_exact(7).zip(blocked.chunks_exact(n)) {
            regressors.evaluate(line, &mut single);
            for (blocked, single) in blocked.iter().zip(&single) {
                // An exponent of −700 carries its own rounding into the value; below it come subnormals.
                let allowed = 1e-15 * (1.0 - single.max(1e-300).ln()) * single + 1e-307;
                assert!((blocked - single).abs() <= allowed, "{blocked} and {single}");
            }
        }
    }
}

#[test]
fn the_factor_is_the_same_on_any_number_of_threads() {
    let case = Case::new(20_000, 30, 3, 2);
    let regressors = case.regressors(&[3.0], true);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Factor::new(&regressors.of(&case.scaled), &case.targets, 2, 1e6))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(7));
}

#[test]
fn regressors_that_are_never_excited_get_no_weight() {
    struct Half;
    impl Design for Half {
        fn regressors(&self) -> usize {
            30
        }
        fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
            for (i, row) in samples.zip(values.chunks_exact_mut(30)) {
                // Below the root of the smallest f64: squares underflow to 0.
                row.fill(1e-170);
                row[i % 15] = 1.0;
            }
        }
    }
    let targets: Vec<f64> = (0..300).map(|i| f64::from(i % 15)).collect();
    let weights = Factor::new(&Half, &targets, 1, 1e9).weights();
    for (i, weight) in weights.iter().enumerate() {
        let expected = if i < 15 { i as f64 } else { 0.0 };
        assert!((weight - expected).abs() < 1e-6, "{i}: {weight}");
    }
}

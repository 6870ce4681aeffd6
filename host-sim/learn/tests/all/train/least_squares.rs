//! Output weights by least squares, and the exponentials in the way.

use taxel_data::{Purpose, Random, Stream};
use taxel_learn::train::least_squares::{Design, Factor, ROWS_AT_ONCE, Regressors};

fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
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
fn row_groups_of_any_shape_give_the_weights_of_the_recursion() {
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
        let targets = &case.targets[..];
        let blocked = Factor::new(&design, targets, outputs, 1e2);
        let recursive = Factor::by_recursion(&design, targets, outputs, 1e2);
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

/// Activations of a Gaussian at 0 with a decay of 1 for these inputs x: e^(−x²).
fn activations(inputs: &[f64]) -> Vec<f64> {
    let regressors = Regressors { centres: &[0.0], inputs: 1, decays: &[1.0], affine_tail: false };
    let mut values = vec![0.0; 2 * inputs.len()];
    regressors.of(inputs).fill(0..inputs.len(), &mut values);
    values.into_iter().step_by(2).collect()
}

#[test]
fn the_exponential_agrees_with_libm_within_two_ulps() {
    // Samples dense near 0, where activations are, and down to the end of the normal numbers.
    let inputs: Vec<f64> =
        (0..1_000_000).map(|i| (707.9 * (f64::from(i) / 1e6).powi(3)).sqrt()).collect();
    let pairs = activations(&inputs).into_iter().zip(&inputs);
    let worst = pairs.map(|(e, x)| (e / libm::exp(-(x * x)) - 1.0).abs()).fold(0.0, f64::max);
    println!("largest relative difference: {worst:.2e}");
    assert!(worst <= 4.5e-16, "{worst:e}");
}

#[test]
fn the_ends_of_the_exponential_are_exact() {
    let ends = [0.0, -0.0, 708.5_f64.sqrt(), 1e150, f64::MAX];
    assert_eq!(activations(&ends), [1.0, 1.0, 0.0, 0.0, 0.0]);
}

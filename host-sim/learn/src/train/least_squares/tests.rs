use super::*;
use taxel_data::{Purpose, Random, Stream};

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

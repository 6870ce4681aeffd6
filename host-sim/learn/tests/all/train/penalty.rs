//! Penalties on the Gaussians of networks of places.

use taxel_data::{Dataset, Purpose, Random, Stream};
use taxel_learn::train::touch::best_penalty;
use taxel_learn::train::{HiddenLayer, Options};

/// Penalty that is chosen where x follows the place p of 25 presses in 40 frames each, and a bend of the map by so much.
fn chosen(bend: f64) -> f64 {
    let mut random = Random::new(5, Stream::Training, Purpose::Noise, 0, 0);
    let mut data = Dataset::empty(vec!["p".into()], vec!["x_mm".into()], 1, 0);
    for _ in 0..25 {
        let (place, error) = (random.unit(), 0.02 * random.normal());
        for _ in 0..40 {
            let p = place + 0.003 * random.normal();
            data.inputs.values.push(p);
            data.outputs.values.push(p + bend * (9.0 * p).sin() + error);
        }
    }
    let layer =
        HiddenLayer { centres: (0..24).map(|k| f64::from(k) / 23.0).collect(), spread: 0.05 };
    best_penalty(&data, &layer, &Options::default()).unwrap()
}

#[test]
fn gaussians_that_fit_the_errors_of_presses_are_penalised() {
    assert_eq!(chosen(0.0), 0.1, "the largest");
    assert!(chosen(0.3) < 1e-2);
}

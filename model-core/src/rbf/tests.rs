mod assembly;
mod formats;

use super::float32::Parameters;
use super::*;

const SHAPE: Shape = Shape { inputs: 5, centres: 3, outputs: 2 };

/// Numbers from `from` on in equal steps. They are never freed.
fn ramp(count: usize, from: f32, step: f32) -> &'static [f32] {
    (0..count).map(|i| from + step * i as f32).collect::<Vec<_>>().leak()
}

/// `values` with another one. They are never freed.
fn with(values: &[f32], place: usize, value: f32) -> &'static [f32] {
    let mut values = values.to_vec();
    values[place] = value;
    values.leak()
}

fn parameters() -> Parameters<'static> {
    Parameters {
        input_minimum: ramp(5, 50.0, 1.0),
        input_per_span: ramp(5, 0.05, 0.01),
        centres: ramp(15, 0.05, 0.06),
        decay: &[0.5, 2.0, 8.0],
        output_weights: ramp(6, -1.0, 0.7),
        bias: &[0.25, -0.5],
        affine: ramp(10, -0.3, 0.1),
    }
}

fn network() -> float32::Network<'static> {
    float32::Network::try_new(SHAPE, parameters()).unwrap()
}

#[test]
fn lengths_that_do_not_fit_the_shape_are_named() {
    let short = Parameters { output_weights: &[0.0; 5], ..parameters() };
    let length = |what, expected, found| NetworkError::Length { what, expected, found };
    assert_eq!(float32::Network::try_new(SHAPE, short), Err(length("output_weights", 6, 5)));
    let network = Network::from(network());
    let found = network.infer(&[0.0; 4], &mut [0.0; 4], &mut [0.0; 2]);
    assert_eq!(found, Err(length("reading", 5, 4)));
    let mut output = [7.0; 3];
    assert!(network.infer(&[0.0; 5], &mut [0.0; 5], &mut output).is_err());
    assert_eq!(output, [7.0; 3]);
}

#[test]
fn unusable_values_are_named() {
    let network = |change: fn(&mut Parameters<'_>)| {
        let mut parameters = parameters();
        change(&mut parameters);
        float32::Network::try_new(SHAPE, parameters).map(|n| n.shape())
    };
    let not_finite = |what| NetworkError::NotFinite { what };
    for (change, error) in [
        (
            (|p| p.decay = &[0.5, 0.0, 8.0]) as fn(&mut Parameters<'_>),
            NetworkError::InvalidWidth { centre: 1 },
        ),
        (|p| p.decay = &[0.5, 2.0, f32::INFINITY], NetworkError::InvalidWidth { centre: 2 }),
        (|p| p.decay = &[f32::NAN, 2.0, 8.0], NetworkError::InvalidWidth { centre: 0 }),
        (|p| p.input_minimum = &[f32::NAN; 5], not_finite("input_minimum")),
        (|p| p.input_per_span = &[f32::NAN; 5], not_finite("input_per_span")),
        (|p| p.centres = with(p.centres, 4, f32::NAN), not_finite("centres")),
        (|p| p.output_weights = with(p.output_weights, 5, f32::NAN), not_finite("output_weights")),
        (|p| p.bias = &[f32::INFINITY, 0.0], not_finite("bias")),
        (|p| p.affine = with(p.affine, 9, f32::NEG_INFINITY), not_finite("affine")),
        (
            |p| p.input_per_span = with(p.input_per_span, 3, -1.0),
            NetworkError::NegativeSpan { input: 3 },
        ),
    ] {
        assert_eq!(network(change), Err(error));
    }
    assert_eq!(network(|_| ()), Ok(SHAPE));
}

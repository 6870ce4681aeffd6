mod assembly;
mod formats;

use super::float32::Parameters;
use super::*;
use crate::exp::Exponential;
use crate::scale::CLAMP;
use proptest::prelude::*;

const SHAPE: Shape = Shape { inputs: 5, centres: 3, outputs: 2 };

/// Parameters that own their numbers, to borrow from.
struct Sample {
    input_minimum: Vec<f32>,
    input_per_span: Vec<f32>,
    centres: Vec<f32>,
    decay: Vec<f32>,
    output_weights: Vec<f32>,
    bias: Vec<f32>,
    affine: Vec<f32>,
}

impl Sample {
    fn new() -> Self {
        let ramp =
            |n: usize, from: f32, step: f32| (0..n).map(|i| from + step * i as f32).collect();
        Self {
            input_minimum: ramp(5, 50.0, 1.0),
            input_per_span: ramp(5, 0.05, 0.01),
            centres: ramp(15, 0.05, 0.06),
            decay: vec![0.5, 2.0, 8.0],
            output_weights: ramp(6, -1.0, 0.7),
            bias: vec![0.25, -0.5],
            affine: ramp(10, -0.3, 0.1),
        }
    }

    fn parameters(&self) -> Parameters<'_> {
        Parameters {
            input_minimum: &self.input_minimum,
            input_per_span: &self.input_per_span,
            centres: &self.centres,
            decay: &self.decay,
            output_weights: &self.output_weights,
            bias: &self.bias,
            affine: &self.affine,
        }
    }
}

fn infer(network: &Network<'_>, reading: &[f32; 5]) -> [f32; 2] {
    let mut output = [0.0; 2];
    network.infer(reading, &mut [0.0; 5], &mut output).unwrap();
    output
}

/// libm's exponential.
#[derive(Debug)]
struct Libm;

impl Exponential for Libm {
    fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
}

/// Outputs by the formula of the module's documentation, in f64.
fn reference(p: &Parameters<'_>, shape: Shape, reading: &[f32]) -> Vec<f64> {
    let x: Vec<f64> = (0..shape.inputs)
        .map(|i| {
            let span = f64::from(reading[i] - p.input_minimum[i]) * f64::from(p.input_per_span[i]);
            span.clamp(f64::from(CLAMP[0]), f64::from(CLAMP[1]))
        })
        .collect();
    (0..shape.outputs)
        .map(|o| {
            let mut y = f64::from(p.bias[o]);
            for (i, x) in x.iter().enumerate() {
                y += p.affine.get(i * shape.outputs + o).map_or(0.0, |a| f64::from(*a) * x);
            }
            for k in 0..shape.centres {
                let d2: f64 = (0..shape.inputs)
                    .map(|i| (x[i] - f64::from(p.centres[k * shape.inputs + i])).powi(2))
                    .sum();
                let decay = f64::from(p.decay[k]);
                y += f64::from(p.output_weights[k * shape.outputs + o]) * (-decay * d2).exp();
            }
            y
        })
        .collect()
}

#[test]
fn inference_follows_the_formula_with_any_exponential() {
    let mut sample = Sample::new();
    for affine in [true, false] {
        if !affine {
            sample.affine.clear();
        }
        let p = sample.parameters();
        let network = float32::Network::try_new(SHAPE, p).unwrap();
        let reading = [55.0, 53.5, 60.0, 40.0, 1e6];
        let truth = reference(&p, SHAPE, &reading);
        let close = |y: &[f32], tolerance: f64| {
            for (y, t) in y.iter().zip(&truth) {
                assert!((f64::from(*y) - t).abs() <= tolerance, "{y} against {t}");
            }
        };
        close(&infer(&network.into(), &reading), 1e-6);
        let (mut scaled, mut output) = ([0.0; 5], [0.0; 2]);
        network.scale(&reading, &mut scaled);
        network.with_exponential::<Libm>().infer_scaled(&scaled, &mut output);
        close(&output, 1e-6);
    }
}

#[test]
fn lengths_that_do_not_fit_the_shape_are_named() {
    let mut sample = Sample::new();
    sample.output_weights.pop();
    assert_eq!(
        float32::Network::try_new(SHAPE, sample.parameters()),
        Err(NetworkError::Length { what: "output_weights", expected: 6, found: 5 })
    );
    let sample = Sample::new();
    let network = Network::from(float32::Network::try_new(SHAPE, sample.parameters()).unwrap());
    assert_eq!(
        network.infer(&[0.0; 4], &mut [0.0; 4], &mut [0.0; 2]),
        Err(NetworkError::Length { what: "reading", expected: 5, found: 4 })
    );
    let mut output = [7.0; 3];
    assert!(network.infer(&[0.0; 5], &mut [0.0; 5], &mut output).is_err());
    assert_eq!(output, [7.0; 3]);
}

#[test]
fn unusable_values_are_named() {
    let network = |change: fn(&mut Sample)| {
        let mut sample = Sample::new();
        change(&mut sample);
        float32::Network::try_new(SHAPE, sample.parameters()).map(|n| n.shape())
    };
    for (change, error) in [
        ((|s| s.decay[1] = 0.0) as fn(&mut Sample), NetworkError::InvalidWidth { centre: 1 }),
        (|s| s.decay[2] = f32::INFINITY, NetworkError::InvalidWidth { centre: 2 }),
        (|s| s.decay[0] = f32::NAN, NetworkError::InvalidWidth { centre: 0 }),
        (|s| s.input_minimum[1] = f32::NAN, NetworkError::NotFinite { what: "input_minimum" }),
        (|s| s.input_per_span[2] = f32::NAN, NetworkError::NotFinite { what: "input_per_span" }),
        (|s| s.centres[4] = f32::NAN, NetworkError::NotFinite { what: "centres" }),
        (|s| s.output_weights[5] = f32::NAN, NetworkError::NotFinite { what: "output_weights" }),
        (|s| s.bias[0] = f32::INFINITY, NetworkError::NotFinite { what: "bias" }),
        (|s| s.affine[9] = f32::NEG_INFINITY, NetworkError::NotFinite { what: "affine" }),
        (|s| s.input_per_span[3] = -1.0, NetworkError::NegativeSpan { input: 3 }),
    ] {
        assert_eq!(network(change), Err(error));
    }
    assert_eq!(network(|_| ()), Ok(SHAPE));
}

#[test]
fn inference_from_scaled_inputs_is_the_rest_of_inference_bit_for_bit() {
    let sample = Sample::new();
    let network = Network::from(float32::Network::try_new(SHAPE, sample.parameters()).unwrap());
    let reading = [50.0, 52.5, 55.0, 57.5, 60.0];
    let (mut scaled, mut output) = ([0.0; 5], [0.0; 2]);
    network.scale(&reading, &mut scaled).unwrap();
    network.infer_scaled(&mut scaled, &mut output).unwrap();
    assert_eq!(output, infer(&network, &reading));
    let error = NetworkError::Length { what: "scaled", expected: 5, found: 4 };
    assert_eq!(network.infer_scaled(&mut [0.0; 4], &mut output), Err(error));
}

proptest! {
    /// The clamp keeps the outputs of any finite reading within a bound from the weights.
    #[test]
    fn output_is_bounded_for_any_finite_reading(
        reading in prop::array::uniform5(prop::num::f32::NORMAL | prop::num::f32::ZERO),
    ) {
        let sample = Sample::new();
        let network = Network::from(float32::Network::try_new(SHAPE, sample.parameters()).unwrap());
        let sum = |values: &[f32]| values.iter().map(|v| v.abs()).sum::<f32>();
        let bound = sum(&sample.output_weights)
            + sum(&sample.bias)
            + CLAMP[1] * sum(&sample.affine);
        for y in infer(&network, &reading) {
            prop_assert!(y.abs() <= bound, "{} exceeds {}", y, bound);
        }
    }
}

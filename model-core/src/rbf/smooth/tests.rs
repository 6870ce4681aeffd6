use super::*;
use crate::Aligned;
use crate::blob::Model;

macro_rules! blobs {
    ($($name:literal),*) => {
        [$(($name, &Aligned(*include_bytes!(concat!("../../../../testdata/", $name))).0[..])),*]
    };
}

/// A point between the ends of every input's range: `part` runs from 0 to 1.
fn reading(network: &Network<'_>, part: impl Fn(usize) -> f32) -> Vec<f32> {
    (0..network.shape().inputs)
        .map(|i| {
            let [low, high] = network.training_range(i);
            low + (high - low) * part(i)
        })
        .collect()
}

fn infer(smooth: &Smooth<'_>, x: &[f32]) -> (Vec<f32>, Vec<f32>) {
    let outputs = smooth.shape.outputs;
    let (mut values, mut slopes) = (vec![0.0; outputs], vec![0.0; outputs * x.len()]);
    smooth.infer(x, 0, &mut values, &mut slopes, &mut vec![0.0; x.len()]);
    (values, slopes)
}

#[test]
fn every_format_has_the_outputs_of_decoding_and_the_slopes_of_its_outputs() {
    for (name, blob) in blobs![
        "kernels-f32.bin",
        "kernels-fixed16.bin",
        "kernels-f32-direct.bin",
        "array-f32.bin",
        "array-f32-no-tail.bin",
        "array-fixed16.bin",
        "array-fixed16-no-tail.bin",
        "array-f32-direct.bin"
    ] {
        let model = Model::decode(blob).unwrap();
        for network in model.networks() {
            let smooth = Smooth::of(&network);
            let (inputs, outputs) = (network.shape().inputs, network.shape().outputs);
            for seed in 0..20 {
                let reading = reading(&network, |i| ((i * 37 + seed * 11) % 29) as f32 / 28.0);
                let mut decoded = vec![0.0; outputs];
                network.infer(&reading, &mut vec![0.0; inputs], &mut decoded).unwrap();
                let scaled = |(i, r): (usize, &f32)| {
                    let (zero, per_unit) = smooth.scale_of(i);
                    (r - zero) * per_unit
                };
                let mut x: Vec<f32> = reading.iter().enumerate().map(scaled).collect();
                let (values, slopes) = infer(&smooth, &x);
                let size = decoded.iter().fold(0.0_f32, |most, y| most.max(y.abs()));
                for (value, decoded) in values.iter().zip(&decoded) {
                    // 16 bits round inputs, activations and weights.
                    let tolerance = if name.contains("fixed16") { 4e-3 } else { 1e-4 };
                    let difference = (value - decoded).abs();
                    assert!(difference <= tolerance * size, "{name}: {value} for {decoded}");
                }
                // Some outputs alone are the same.
                let (mut some, mut some_slopes) = ([0.0; 1], vec![0.0; inputs]);
                let last = outputs - 1;
                smooth.infer(&x, last, &mut some, &mut some_slopes, &mut vec![0.0; inputs]);
                assert_eq!((some[0], &some_slopes[..]), (values[last], &slopes[last * inputs..]));
                // Slopes are differences of values, far outside as well.
                x[seed % inputs] += if seed % 2 == 0 { 2.0 } else { 0.0 };
                let (_, slopes) = infer(&smooth, &x);
                let (i, step) = ((seed * 5) % inputs, 0.01);
                x[i] -= step;
                let (below, _) = infer(&smooth, &x);
                x[i] += 2.0 * step;
                let (above, _) = infer(&smooth, &x);
                for o in 0..outputs {
                    let expected = (above[o] - below[o]) / (2.0 * step);
                    let found = slopes[o * inputs + i];
                    assert!((found - expected).abs() <= 3e-3 * size, "{name}: {found}, {expected}");
                }
            }
        }
    }
}

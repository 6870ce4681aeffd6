//! Inference over whole tables, to the bit as on the device.

use taxel_core::confidence::{Confidence, Sizes};
use taxel_core::rbf::{Network, Shape};
use taxel_data::widest;

use crate::parallel;

/// Lines that one thread takes at a time.
const LINES_AT_ONCE: usize = 256;

/// Infers the outputs of `network` for every line of `readings` (`lines × inputs`): `lines × outputs`.
///
/// All outputs of a line are NaN if a reading is missing.
pub fn infer(network: &Network<'_>, readings: &[f64]) -> Vec<f64> {
    infer_in_turn(&[*network], readings)
}

/// Infers the outputs of `networks`, which have the same numbers of inputs and outputs, for every line of `readings`:
/// each line holds the inputs of every network in turn. NaN for a network that misses a reading.
pub(crate) fn infer_in_turn(networks: &[Network<'_>], readings: &[f64]) -> Vec<f64> {
    let Some(Shape { inputs, outputs, .. }) = networks.first().map(Network::shape) else {
        return Vec::new();
    };
    let of_piece = |readings: &[f64]| {
        let mut values = vec![0.0; readings.len() / inputs * outputs];
        infer_lines(networks, readings, &mut values);
        values
    };
    parallel::pieces(readings, LINES_AT_ONCE * networks.len() * inputs, &of_piece).concat()
}

/// Whether the device would take `reading` for missing: NaN, or beyond f32.
pub fn is_missing(reading: f64) -> bool {
    !(reading as f32).is_finite()
}

/// Infers the outputs of the networks in turn for lines of readings; all NaN for a network that misses a reading, or
/// whose outputs overflow.
fn infer_lines(networks: &[Network<'_>], readings: &[f64], values: &mut [f64]) {
    let Shape { inputs, outputs, .. } = networks[0].shape();
    let (mut line, mut scaled) = (vec![0.0; inputs], vec![0.0; inputs]);
    let mut inferred = vec![0.0; outputs];
    let lines = values.len() / outputs;
    widest!({
        for (first, network) in networks.iter().enumerate() {
            for number in (first..lines).step_by(networks.len()) {
                let is_whole = read(&readings[number * inputs..], &mut line);
                let done = network.infer(&line, &mut scaled, &mut inferred);
                done.expect("lengths of the network");
                write(&inferred, is_whole, &mut values[number * outputs..]);
            }
        }
    });
}

/// Copies the first `readings` to `line`, and returns whether none is missing.
#[inline(always)]
fn read(readings: &[f64], line: &mut [f32]) -> bool {
    line.iter_mut().zip(readings).for_each(|(place, reading)| *place = *reading as f32);
    line.iter().all(|reading| reading.is_finite())
}

/// Copies the outputs of a line to the first `values`: all NaN if they overflow, or a reading was missing.
#[inline(always)]
fn write(inferred: &[f32], is_whole: bool, values: &mut [f64]) {
    let is_sound = is_whole && inferred.iter().all(|y| y.is_finite());
    let value = |y| if is_sound { f64::from(y) } else { f64::NAN };
    values.iter_mut().zip(inferred).for_each(|(place, y)| *place = value(*y));
}

/// Deviations (`lines × outputs`) and novelty of every line of `inputs`, as a device computes them.
pub(crate) fn assess_lines(confidence: Confidence<'_>, inputs: &[f64]) -> (Vec<f32>, Vec<f64>) {
    let Sizes { readings, outputs, .. } = confidence.sizes();
    let of_piece = |lines: &[f64]| {
        let mut scratch = vec![0.0; confidence.sizes().scratch_floats()];
        let mut deviations = vec![0.0; lines.len() / readings * outputs];
        let lines = lines.chunks_exact(readings).zip(deviations.chunks_exact_mut(outputs));
        let assess = |(line, deviation): (&[f64], &mut [f32])| {
            let line = line.iter().map(|reading| *reading as f32);
            let novelty = confidence.assess(line, &mut scratch, deviation);
            f64::from(novelty.expect("lengths of the confidence"))
        };
        let novelty: Vec<f64> = lines.map(assess).collect();
        (deviations, novelty)
    };
    let (deviations, novelty): (Vec<_>, Vec<_>) =
        parallel::pieces(inputs, LINES_AT_ONCE * readings, &of_piece).into_iter().unzip();
    (deviations.concat(), novelty.concat())
}

#[cfg(test)]
mod tests {
    use taxel_core::rbf::float32;

    use super::*;

    /// Networks that differ in their bias; outputs overflow where all activations are high.
    fn parameters(bias: &[f32; 2]) -> float32::Parameters<'_> {
        float32::Parameters {
            input_minimum: &[40.0; 2],
            input_per_span: &[0.025; 2],
            centres: &[0.5, 0.4, 0.5, 0.6, 0.6, 0.5],
            decay: &[5.0; 3],
            output_weights: &[3e38, 1.0, 3e38, 2.0, -1e38, 3.0],
            bias,
            affine: &[],
        }
    }

    #[test]
    fn lines_of_networks_in_turn_are_those_of_each_network_bit_for_bit() {
        let shape = Shape { inputs: 2, centres: 3, outputs: 2 };
        let networks: Vec<Network<'_>> = [&[0.5, 1.0], &[1.5, -2.0], &[3.0, 4.0]]
            .map(|bias| float32::Network::try_new(shape, parameters(bias)).unwrap().into())
            .into();
        let Shape { inputs, outputs, .. } = shape;
        let reading = |i: usize| match i % 101 {
            0 => f64::NAN,
            1 => 1e300, // beyond f32
            2 => -3e38,
            _ => 35.0 + (i * 37 % 1009) as f64 * 0.07,
        };
        let lines = networks.len() * (2 * LINES_AT_ONCE + 1);
        let readings: Vec<f64> = (0..lines * inputs).map(reading).collect();
        let values = infer_in_turn(&networks, &readings);
        assert_eq!(values.len(), lines * outputs);
        let (mut missing, mut overflowing) = (0, 0);
        let lines = readings.chunks_exact(inputs).zip(values.chunks_exact(outputs));
        for (i, (x, y)) in lines.enumerate() {
            let x: Vec<f32> = x.iter().map(|x| *x as f32).collect();
            let (mut scaled, mut own) = (vec![0.0; inputs], vec![0.0; outputs]);
            networks[i % networks.len()].infer(&x, &mut scaled, &mut own).unwrap();
            let is_missing = x.iter().any(|x| !x.is_finite());
            let overflows = own.iter().any(|y| !y.is_finite());
            missing += usize::from(is_missing);
            overflowing += usize::from(overflows && !is_missing);
            if is_missing || overflows {
                assert!(y.iter().all(|y| y.is_nan()), "{x:?} gives {y:?}");
            } else {
                let bits = |values: &[f64]| values.iter().map(|y| y.to_bits()).collect::<Vec<_>>();
                let own: Vec<f64> = own.iter().map(|y| f64::from(*y)).collect();
                assert_eq!(bits(y), bits(&own), "{x:?}");
            }
        }
        assert!(missing > 10 && overflowing > 10, "{missing} and {overflowing}");
    }
}

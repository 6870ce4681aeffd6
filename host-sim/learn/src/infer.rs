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

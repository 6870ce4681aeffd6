//! Inference over whole tables, to the bit as on the device.

mod side_by_side;

use serde::Serialize;
use taxel_core::confidence::{Confidence, Sizes};
use taxel_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use taxel_core::rbf::{Network, Shape};
use taxel_data::widest;

use crate::parallel;

/// Lines that one thread takes at a time.
const LINES_AT_ONCE: usize = 256;

/// Implementation of the exponential that activations are computed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Exponential {
    /// Polynomial within 2 ulp, and fast: the device's default.
    #[default]
    Polynomial,
    /// The `libm` crate's, within 1 ulp.
    Libm,
    /// The `micromath` crate's, up to 2.4e-3 relative error; to see what that costs.
    Micromath,
}

impl Exponential {
    /// Every exponential, the device's default first.
    pub const ALL: [Self; 3] = [Self::Polynomial, Self::Libm, Self::Micromath];

    /// Name that users choose it by and a device reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Polynomial => Polynomial::NAME,
            Self::Libm => Libm::NAME,
            Self::Micromath => Micromath::NAME,
        }
    }

    /// Accuracy in one line, for help texts and tables.
    pub fn description(self) -> &'static str {
        match self {
            Self::Polynomial => "Within 2 ulp and fast: the device's default",
            Self::Libm => "Within 1 ulp",
            Self::Micromath => "Up to 2.4e-3 relative error; to see what that costs",
        }
    }

    /// Exponential called `name`.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|exponential| exponential.name() == name)
    }
}

/// Infers the outputs of `network` for every line of `readings` (`lines × inputs`): `lines × outputs`.
///
/// All outputs of a line are NaN if a reading is missing.
pub fn infer(network: &Network<'_>, exponential: Exponential, readings: &[f64]) -> Vec<f64> {
    infer_in_turn(&[*network], exponential, readings)
}

/// Infers the outputs of `networks`, which have the same numbers of inputs and outputs, for every line of `readings`:
/// each line holds the inputs of every network in turn. NaN for a network that misses a reading.
pub(crate) fn infer_in_turn(
    networks: &[Network<'_>],
    exponential: Exponential,
    readings: &[f64],
) -> Vec<f64> {
    let Some(Shape { inputs, outputs, .. }) = networks.first().map(Network::shape) else {
        return Vec::new();
    };
    let of_piece = |readings: &[f64]| {
        let mut values = vec![0.0; readings.len() / inputs * outputs];
        match exponential {
            Exponential::Polynomial => infer_lines::<Polynomial>(networks, readings, &mut values),
            Exponential::Libm => infer_lines::<Libm>(networks, readings, &mut values),
            Exponential::Micromath => infer_lines::<Micromath>(networks, readings, &mut values),
        }
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
fn infer_lines<E: ExpKernel>(networks: &[Network<'_>], readings: &[f64], values: &mut [f64]) {
    let Shape { inputs, outputs, .. } = networks[0].shape();
    let (mut line, mut scaled) = (vec![0.0; inputs], vec![0.0; inputs]);
    let mut inferred = vec![0.0; outputs];
    let lines = values.len() / outputs;
    widest!({
        for (first, network) in networks.iter().enumerate() {
            let numbers = (first..lines).step_by(networks.len());
            if let Network::F32(network) = network {
                side_by_side::infer_lines(*network, numbers, readings, values);
                continue;
            }
            for number in numbers {
                let is_whole = read(&readings[number * inputs..], &mut line);
                let done = network.infer_with::<E>(&line, &mut scaled, &mut inferred);
                done.expect("lengths of the network");
                write(inferred.iter().copied(), is_whole, &mut values[number * outputs..]);
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
fn write(inferred: impl Iterator<Item = f32> + Clone, is_whole: bool, values: &mut [f64]) {
    let is_sound = is_whole && inferred.clone().all(f32::is_finite);
    let value = |y| if is_sound { f64::from(y) } else { f64::NAN };
    values.iter_mut().zip(inferred).for_each(|(place, y)| *place = value(y));
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
    use taxel_core::rbf::{direct, expanded};
    use taxel_core::scale::UNITS;

    use super::*;

    /// Networks that differ in their bias; outputs overflow where all activations are high.
    fn parameters(bias: &[f32; 2]) -> direct::Parameters<'_> {
        direct::Parameters {
            input_minimum: &[40.0; 2],
            input_per_span: &[0.025; 2],
            centres: &[0.5, 0.4, 0.5, 0.6, 0.6, 0.5],
            decay: &[5.0],
            output_weights: &[3e38, 1.0, 3e38, 2.0, -1e38, 3.0],
            bias,
            affine: &[],
        }
    }

    /// Asserts that lines of the networks in turn are those of each network, and returns how many lines miss a reading,
    /// and how many others overflow.
    fn assert_in_turn(networks: &[Network<'_>], exponential: Exponential) -> [usize; 2] {
        let Shape { inputs, outputs, .. } = networks[0].shape();
        let reading = |i: usize| match i % 101 {
            0 => f64::NAN,
            1 => 1e300, // beyond f32
            2 => -3e38,
            _ => 35.0 + (i * 37 % 1009) as f64 * 0.07,
        };
        let lines = networks.len() * (2 * LINES_AT_ONCE + 1);
        let readings: Vec<f64> = (0..lines * inputs).map(reading).collect();
        let values = infer_in_turn(networks, exponential, &readings);
        assert_eq!(values.len(), lines * outputs);
        let (mut missing, mut overflowing) = (0, 0);
        let lines = readings.chunks_exact(inputs).zip(values.chunks_exact(outputs));
        for (i, (x, y)) in lines.enumerate() {
            let x: Vec<f32> = x.iter().map(|x| *x as f32).collect();
            let (mut scaled, mut own) = (vec![0.0; inputs], vec![0.0; outputs]);
            let (network, scaled, own) = (&networks[i % networks.len()], &mut scaled, &mut own);
            match exponential {
                Exponential::Polynomial => network.infer_with::<Polynomial>(&x, scaled, own),
                Exponential::Libm => network.infer_with::<Libm>(&x, scaled, own),
                Exponential::Micromath => network.infer_with::<Micromath>(&x, scaled, own),
            }
            .unwrap();
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
        [missing, overflowing]
    }

    #[test]
    fn lines_of_networks_in_turn_are_those_of_each_network_bit_for_bit() {
        let shape = Shape { inputs: 2, centres: 3, outputs: 2 };
        let networks: Vec<Network<'_>> = [&[0.5, 1.0], &[1.5, -2.0], &[3.0, 4.0]]
            .map(|bias| direct::Network::try_new(shape, parameters(bias)).unwrap().into())
            .into();
        for exponential in Exponential::ALL {
            let [missing, overflowing] = assert_in_turn(&networks, exponential);
            assert!(missing > 10 && overflowing > 10, "{missing} and {overflowing}");
        }
    }

    #[test]
    fn lines_side_by_side_are_those_of_the_network_bit_for_bit() {
        // Six inputs fill the four partial sums unevenly.
        let shape = Shape { inputs: 6, centres: 5, outputs: 3 };
        let numbers = |count: usize, scale: f32| -> Vec<f32> {
            (0..count).map(|i| scale * ((i * 29 % 23) as f32 - 11.0)).collect()
        };
        // One b below 0 in front of the a of every centre.
        let rows = numbers(8 * 7, 0.02 / UNITS);
        let of_row = |row: &[f32]| [&[-2.0 + 1e9 * row[0]], &row[1..]].concat();
        let exponents: Vec<f32> = rows.chunks(7).flat_map(of_row).collect();
        let words = |bias: &[f32; 3], affine: &[f32]| -> Vec<u32> {
            let parameters = expanded::Parameters {
                input_midpoint: &[60.0; 6],
                input_per_unit: &[UNITS / 40.0; 6],
                decay: 1.0 / (UNITS * UNITS),
                bias,
                affine,
                exponents: &exponents,
                output_weights: &numbers(8 * 3, 0.1),
            };
            parameters.words().collect()
        };
        let blocks = [words(&[0.5, 1.0, -3.0], &[]), words(&[1.5, -2.0, 0.0], &[])];
        let with_tail = [words(&[0.5, 1.0, -3.0], &numbers(18, 0.01 / UNITS))];
        for (affine, blocks) in [(false, &blocks[..]), (true, &with_tail[..])] {
            let network = |block| expanded::Network::try_new(shape, affine, block).unwrap().into();
            let networks: Vec<Network<'_>> = blocks.iter().map(|block| network(block)).collect();
            let [missing, _] = assert_in_turn(&networks, Exponential::Polynomial);
            assert!(missing > 10, "{missing}");
        }
    }
}

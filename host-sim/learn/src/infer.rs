//! Inference over whole tables, by the same code that runs on the device.

use model_core::confidence::{Confidence, Sizes};
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::{Network, Shape};
use serde::Serialize;
use taxel_data::simd::widest;

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
    widest(
        #[inline(always)]
        || {
            let lines = readings.chunks_exact(inputs).zip(values.chunks_exact_mut(outputs));
            for ((readings, values), network) in lines.zip(networks.iter().cycle()) {
                line.iter_mut().zip(readings).for_each(|(place, r)| *place = *r as f32);
                if line.iter().all(|reading| reading.is_finite()) {
                    let done = network.infer_with::<E>(&line, &mut scaled, &mut inferred);
                    done.expect("lengths of the network");
                } else {
                    inferred.fill(f32::NAN);
                }
                let sound = inferred.iter().all(|value| value.is_finite());
                let value = |value: &f32| if sound { f64::from(*value) } else { f64::NAN };
                values.iter_mut().zip(&inferred).for_each(|(place, y)| *place = value(y));
            }
        },
    );
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
    use model_core::rbf::direct;

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

    #[test]
    fn lines_of_networks_in_turn_are_those_of_each_network_bit_for_bit() {
        let shape = Shape { inputs: 2, centres: 3, outputs: 2 };
        let networks: Vec<Network<'_>> = [&[0.5, 1.0], &[1.5, -2.0], &[3.0, 4.0]]
            .map(|bias| direct::Network::try_new(shape, parameters(bias)).unwrap().into())
            .into();
        let reading = |i: usize| match i % 101 {
            0 => f64::NAN,
            1 => 1e300, // beyond f32
            2 => -3e38,
            _ => 35.0 + (i * 37 % 1009) as f64 * 0.07,
        };
        let readings: Vec<f64> = (0..3 * LINES_AT_ONCE * 6 + 6).map(reading).collect();
        for exponential in Exponential::ALL {
            let values = infer_in_turn(&networks, exponential, &readings);
            assert_eq!(values.len(), readings.len());
            let (mut missing, mut overflowing) = (0, 0);
            for (i, (x, y)) in readings.chunks_exact(2).zip(values.chunks_exact(2)).enumerate() {
                let (x, mut scaled, mut own) = ([x[0] as f32, x[1] as f32], [0.0; 2], [0.0; 2]);
                let (network, scaled) = (&networks[i % 3], &mut scaled);
                match exponential {
                    Exponential::Polynomial => {
                        network.infer_with::<Polynomial>(&x, scaled, &mut own)
                    }
                    Exponential::Libm => network.infer_with::<Libm>(&x, scaled, &mut own),
                    Exponential::Micromath => network.infer_with::<Micromath>(&x, scaled, &mut own),
                }
                .unwrap();
                let is_missing = x.iter().any(|x| !x.is_finite());
                let overflows = own.iter().any(|y| !y.is_finite());
                missing += usize::from(is_missing);
                overflowing += usize::from(overflows && !is_missing);
                let expected = own.map(f64::from).map(f64::to_bits);
                if is_missing || overflows {
                    assert!(y.iter().all(|y| y.is_nan()), "{x:?} gives {y:?}");
                } else {
                    assert_eq!([y[0].to_bits(), y[1].to_bits()], expected, "{x:?}");
                }
            }
            assert!(missing > 10 && overflowing > 10, "{missing} and {overflowing}");
        }
    }
}

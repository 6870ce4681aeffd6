//! Inference over whole tables, by the same code that runs on the device.

use model_core::confidence::{Confidence, Sizes};
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::{Network, Shape};
use rayon::prelude::*;
use serde::Serialize;

use self::batch::Batch;

mod batch;

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
    Prepared::new(&[*network], exponential).infer(readings)
}

/// Networks of one shape, laid out for many lines. Each line holds the inputs of every network in turn.
#[derive(Debug)]
pub(crate) struct Prepared<'n> {
    shape: Shape,
    exponential: Exponential,
    networks: Vec<(Network<'n>, Option<Batch<'n>>)>,
}

impl<'n> Prepared<'n> {
    /// Lays out `networks`, which have the same numbers of inputs and outputs.
    pub(crate) fn new(networks: &[Network<'n>], exponential: Exponential) -> Self {
        let none = Shape { inputs: 0, centres: 0, outputs: 0 };
        let shape = networks.first().map_or(none, Network::shape);
        let of = |network: &Network<'n>| (*network, Batch::of(network, exponential));
        Self { shape, exponential, networks: networks.iter().map(of).collect() }
    }

    /// Networks in turn.
    pub(crate) fn networks(&self) -> impl Iterator<Item = &Network<'n>> {
        self.networks.iter().map(|(network, _)| network)
    }

    /// Number of inputs of each network.
    pub(crate) fn inputs(&self) -> usize {
        self.shape.inputs
    }

    /// Infers the outputs for every line of `readings`; NaN for a network that misses a reading.
    pub(crate) fn infer(&self, readings: &[f64]) -> Vec<f64> {
        let Shape { inputs, outputs, .. } = self.shape;
        let (readings_step, outputs_step) =
            (self.networks.len() * inputs, self.networks.len() * outputs);
        if readings_step == 0 {
            return Vec::new();
        }
        let mut values = vec![0.0; readings.len() / readings_step * outputs_step];
        let pieces = readings.par_chunks(LINES_AT_ONCE * readings_step);
        values.par_chunks_mut(LINES_AT_ONCE * outputs_step).zip(pieces).for_each(
            |(values, readings)| {
                for (row, (network, batch)) in self.networks.iter().enumerate() {
                    let readings = &readings[row * inputs..];
                    let values = &mut values[row * outputs..];
                    if let Some(batch) = batch {
                        batch.infer(readings, readings_step, values, outputs_step);
                    } else {
                        let lines = readings.chunks(readings_step);
                        for (readings, values) in lines.zip(values.chunks_mut(outputs_step)) {
                            let (readings, values) = (&readings[..inputs], &mut values[..outputs]);
                            infer_line(network, self.exponential, readings, values);
                        }
                    }
                }
            },
        );
        values
    }
}

/// Whether the device would take `reading` for missing: NaN, or beyond f32.
pub fn is_missing(reading: f64) -> bool {
    !(reading as f32).is_finite()
}

/// Infers the outputs for one line of readings; all NaN if a reading is missing.
fn infer_line(
    network: &Network<'_>,
    exponential: Exponential,
    readings: &[f64],
    outputs: &mut [f64],
) {
    if readings.iter().any(|reading| is_missing(*reading)) {
        outputs.fill(f64::NAN);
        return;
    }
    match exponential {
        Exponential::Polynomial => infer_with::<Polynomial>(network, readings, outputs),
        Exponential::Libm => infer_with::<Libm>(network, readings, outputs),
        Exponential::Micromath => infer_with::<Micromath>(network, readings, outputs),
    }
}

fn infer_with<E: ExpKernel>(network: &Network<'_>, readings: &[f64], outputs: &mut [f64]) {
    let readings: Vec<f32> = readings.iter().map(|reading| *reading as f32).collect();
    let mut scaled = vec![0.0; readings.len()];
    let mut inferred = vec![0.0; outputs.len()];
    network.infer_with::<E>(&readings, &mut scaled, &mut inferred).expect("lengths of the network");
    let overflow = inferred.iter().any(|value| !value.is_finite());
    let values = inferred.into_iter().map(|value| if overflow { f32::NAN } else { value });
    outputs.iter_mut().zip(values).for_each(|(place, value)| *place = f64::from(value));
}

/// Deviations (`lines × outputs`) and novelty of every line of `inputs`, as a device computes them.
pub(crate) fn assess_lines(confidence: Confidence<'_>, inputs: &[f64]) -> (Vec<f32>, Vec<f64>) {
    let Sizes { readings, outputs, .. } = confidence.sizes();
    let mut deviations = vec![0.0; inputs.len() / readings * outputs];
    let novelty = inputs
        .par_chunks_exact(readings)
        .zip(deviations.par_chunks_exact_mut(outputs))
        .map_init(
            || vec![0.0; confidence.sizes().scratch_floats()],
            |scratch, (line, deviation)| {
                let line = line.iter().map(|reading| *reading as f32);
                let novelty = confidence.assess(line, scratch, deviation);
                f64::from(novelty.expect("lengths of the confidence"))
            },
        )
        .collect();
    (deviations, novelty)
}

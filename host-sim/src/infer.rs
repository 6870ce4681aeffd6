//! Inference over whole tables, by the same code that runs on the device.

use clap::ValueEnum;
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::{Network, Shape};
use rayon::prelude::*;
use serde::Serialize;

use self::batch::Batch;
use crate::dataset::Table;

mod batch;

/// Lines that one thread takes at a time.
const LINES_AT_ONCE: usize = 256;

/// The exponential that activations are computed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kernel {
    /// Within 2 ulp and fast: the device's default.
    #[default]
    Polynomial,
    /// Within 1 ulp.
    Libm,
    /// Up to 2.4e-3 relative error; to see what that costs.
    Micromath,
}

impl Kernel {
    /// The kernel of that [`ExpKernel::NAME`].
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        [
            (Polynomial::NAME, Self::Polynomial),
            (Libm::NAME, Self::Libm),
            (Micromath::NAME, Self::Micromath),
        ]
        .into_iter()
        .find_map(|(known, kernel)| (known == name).then_some(kernel))
    }
}

/// Infers the outputs for every line of `inputs`.
#[must_use]
pub fn infer(network: &Network<'_>, kernel: Kernel, inputs: &Table) -> Vec<f64> {
    infer_rows(&[*network], kernel, inputs)
}

/// Infers the outputs for every line of `readings`, which holds the inputs of each network in turn.
///
/// # Panics
/// If the networks differ in inputs or outputs.
pub(crate) fn infer_rows(networks: &[Network<'_>], kernel: Kernel, readings: &Table) -> Vec<f64> {
    let Some(Shape { inputs, outputs, .. }) = networks.first().map(Network::shape) else {
        return Vec::new();
    };
    let (readings_step, outputs_step) = (networks.len() * inputs, networks.len() * outputs);
    let batches: Vec<Option<Batch<'_>>> =
        networks.iter().map(|network| Batch::of(network, kernel)).collect();
    let mut values = vec![0.0; readings.len() * outputs_step];
    let pieces = readings.values.par_chunks(LINES_AT_ONCE * readings_step);
    values.par_chunks_mut(LINES_AT_ONCE * outputs_step).zip(pieces).for_each(
        |(values, readings)| {
            for (row, (network, batch)) in networks.iter().zip(&batches).enumerate() {
                let readings = &readings[row * inputs..];
                let values = &mut values[row * outputs..];
                if let Some(batch) = batch {
                    batch.infer(readings, readings_step, values, outputs_step);
                } else {
                    let lines = readings.chunks(readings_step);
                    for (readings, values) in lines.zip(values.chunks_mut(outputs_step)) {
                        infer_line(network, kernel, &readings[..inputs], &mut values[..outputs]);
                    }
                }
            }
        },
    );
    values
}

/// Whether the device would take `reading` for missing: NaN, or beyond f32.
#[must_use]
pub fn is_missing(reading: f64) -> bool {
    !(reading as f32).is_finite()
}

/// Infers the outputs for one line of readings; all NaN if a reading is missing.
fn infer_line(network: &Network<'_>, kernel: Kernel, readings: &[f64], outputs: &mut [f64]) {
    if readings.iter().any(|reading| is_missing(*reading)) {
        outputs.fill(f64::NAN);
        return;
    }
    match kernel {
        Kernel::Polynomial => infer_with::<Polynomial>(network, readings, outputs),
        Kernel::Libm => infer_with::<Libm>(network, readings, outputs),
        Kernel::Micromath => infer_with::<Micromath>(network, readings, outputs),
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

//! Networks with few outputs, which are expanded to all: output weights of low rank.
//!
//! The outputs of a whole array lie near a space of few dimensions. Let W be the output weights fitted in full, and V
//! the first r eigenvectors of the covariance of what they predict. Of all weights of rank r, W·V·Vᵀ then fits with
//! the least squared error (Izenman, J. Multivariate Anal. 5, 1975). The network computes r components, with weights
//! W·V, and Vᵀ expands them.
//!
//! The expansion is rounded first. The network is then fitted to components of the targets, as any network is to its
//! targets: that gives W·V but for the rounding of its format, which the fit compensates as usual.
//!
//! Centres and widths are given, wherever they come from, and are those for all outputs.

use nalgebra::DMatrix;
use taxel_core::expansion::Expansion;
use taxel_data::{BadValue, RowTable, Table, require};

use super::format::{self, FittedNetwork, Targets};
use super::hidden_layer::HiddenLayer;
use super::least_squares::{Factor, Regressors};
use super::samples::Ridge;
use super::{Options, Samples, principal, tasks};
use crate::error::Result;
use crate::parallel;

/// Lines that one thread expands at a time.
const LINES_AT_ONCE: usize = 256;

/// Fits a network with the Gaussians of `layer` to the samples' outputs, by way of `rank` components.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for a rank that is not below the number of outputs, or missing outputs; an
/// [`Error`](crate::Error) if the format does not hold the network.
pub(super) fn fit(
    samples: &Samples<'_>,
    layer: &HiddenLayer,
    rank: usize,
    options: &Options,
) -> Result<FittedNetwork> {
    let outputs = &samples.table.outputs;
    check(rank, outputs)?;
    let expansion = expansion(samples, layer, rank, options);
    let table = RowTable {
        inputs: samples.table.inputs.clone(),
        outputs: components(&expansion, rank, outputs),
        common_span: samples.table.common_span,
    };
    let of_components =
        Samples { scale: samples.scale.clone(), scaled: samples.scaled.clone(), table: &table };
    let ridge = Ridge::new(layer, samples.inputs(), options);
    let mut networks = format::fit(&of_components, layer, options, &[ridge])?;
    let network = networks.pop().expect("one network");
    Ok(network.expanded_by(expansion))
}

/// Checks a rank against the `outputs`: their number, and that none is missing.
pub(super) fn check(rank: usize, outputs: &Table) -> std::result::Result<(), BadValue> {
    let count = outputs.names.len();
    require((1..count).contains(&rank), "output_rank", rank, || {
        format!("give from 1 to {}, fewer than there are outputs", count - 1)
    })?;
    tasks::check_complete(outputs, "output_rank", rank)
}

/// Means of the outputs, then their parts of each component (`rank × outputs`), rounded.
pub(super) fn expansion(
    samples: &Samples<'_>,
    layer: &HiddenLayer,
    rank: usize,
    options: &Options,
) -> Vec<f32> {
    let targets = Targets::new(&samples.table.outputs);
    let decays: Vec<f64> = layer.widths().iter().map(|width| 1.0 / (2.0 * width * width)).collect();
    let regressors = Regressors {
        centres: &layer.centres,
        inputs: samples.inputs(),
        decays: &decays,
        affine_tail: options.affine_tail,
    };
    let design = regressors.of(&samples.scaled);
    let outputs = targets.outputs();
    let deviations = &targets.deviations.values;
    let covariance = options.initial_covariance(samples.table.outputs.len());
    let factor = Factor::new(&design, deviations, outputs, covariance);
    // With the triangle R of the regressors and weights W, predictions have the covariance (R·W)ᵀ·(R·W), but for their
    // number; and R·W is what the factor holds.
    let predicted = DMatrix::from_row_slice(factor.regressors, outputs, &factor.projection);
    let directions = principal::directions(predicted.tr_mul(&predicted), rank);
    let means = targets.means.iter().map(|mean| *mean as f32);
    // One column after the other.
    means.chain(directions.iter().map(|part| *part as f32)).collect()
}

/// Components of `outputs` (`samples × outputs`) in the directions of the `expansion`, about its means.
pub(super) fn components(expansion: &[f32], rank: usize, outputs: &Table) -> Table {
    let (means, directions) = expansion.split_at(outputs.names.len());
    let of_line = |line: &[f64]| {
        let deviations: Vec<f64> =
            line.iter().zip(means).map(|(value, mean)| value - f64::from(*mean)).collect();
        let along = |direction: &[f32]| {
            deviations.iter().zip(direction).map(|(d, part)| d * f64::from(*part)).sum::<f64>()
        };
        directions.chunks_exact(means.len()).map(along).collect::<Vec<f64>>()
    };
    Table {
        names: (1..=rank).map(|component| format!("component{component}")).collect(),
        values: outputs.lines().flat_map(of_line).collect(),
    }
}

/// Expands every line of `components` as the device does: `lines × outputs`. A line with a missing component has no
/// output either.
pub fn expand(expansion: Expansion<'_>, components: &[f64]) -> Vec<f64> {
    let (width, outputs) = (expansion.components(), expansion.outputs());
    if width == 0 || outputs == 0 {
        return Vec::new();
    }
    let of_piece = |components: &[f64]| {
        let mut values = vec![f64::NAN; components.len() / width * outputs];
        let (mut given, mut expanded) = (vec![0.0; width], vec![0.0; outputs]);
        for (values, line) in values.chunks_exact_mut(outputs).zip(components.chunks_exact(width)) {
            if line.iter().all(|component| component.is_finite()) {
                given.iter_mut().zip(line).for_each(|(place, value)| *place = *value as f32);
                expansion.expand(&given, &mut expanded);
                values.iter_mut().zip(&expanded).for_each(|(place, y)| *place = f64::from(*y));
            }
        }
        values
    };
    parallel::pieces(components, LINES_AT_ONCE * width, &of_piece).concat()
}

#[cfg(test)]
mod tests;

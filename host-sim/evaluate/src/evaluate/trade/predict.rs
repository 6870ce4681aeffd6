//! Costs that are known before anything is trained: they depend on the sizes of a model, not on its numbers.

use std::collections::HashSet;

use model_core::blob::ModelShape;
use model_core::rbf::Format;
use taxel_data::dataset::Dataset;
use taxel_learn::Exponential;
use taxel_learn::cost::{Cost, Design, Prices};
use taxel_learn::train::projection;

use super::choice::Offer;
use super::device::Wires;
use super::frames::{Frames, Inputs};
use super::{Arithmetic, Plan, SLOT_BYTES};
use crate::error::Result;

/// Ranks of the output weights to try with so many `centres`: full, and for the whole array those of the plan that take
/// fewer multiplications.
pub(super) fn ranks(
    plan: &Plan,
    dataset: &Dataset,
    whole_array: bool,
    centres: usize,
) -> Vec<Option<usize>> {
    let outputs = dataset.outputs.names.len();
    let fewer = |rank: &usize| rank * (centres + outputs) < centres * outputs;
    let of_plan = plan.output_ranks.iter().copied().filter(fewer).map(Some);
    [None].into_iter().chain(of_plan.filter(|_| whole_array)).collect()
}

/// Number of distinct samples of each network's inputs, counted up to `most`: networks have no more centres.
fn distinct_samples(dataset: &Dataset, inputs: &Inputs, most: usize) -> Vec<usize> {
    let seen = projection::seen(inputs.projection.as_deref(), dataset);
    let of_row = seen.inputs.names.len() / seen.rows;
    let distinct = |row: usize| {
        let mut found: HashSet<Vec<u32>> = HashSet::new();
        for line in seen.inputs.lines() {
            let sample = &line[row * of_row..][..of_row];
            // Zero of either sign is one number.
            found.insert(sample.iter().map(|value| (*value as f32 + 0.0).to_bits()).collect());
            if found.len() == most {
                break;
            }
        }
        found.len()
    };
    (0..seen.rows).map(distinct).collect()
}

/// Design of the model that training with these settings gives, with at most as many centres as `distinct` samples of
/// each network.
fn design(
    dataset: &Dataset,
    (inputs, distinct): (&Inputs, &[usize]),
    (format, centres): (Format, usize),
    affine_tail: bool,
    output_rank: Option<usize>,
) -> Design {
    let rows = dataset.rows;
    let of_row = |columns: &[String]| columns.len() / rows;
    let shape = ModelShape {
        rows,
        inputs: of_row(&dataset.inputs.names),
        outputs: of_row(&dataset.outputs.names),
    };
    let mut design = match &inputs.projection {
        None => Design::of_rows(shape, format, centres, affine_tail),
        Some(parameters) => {
            let mut design = Design::of_array(shape, format, centres, affine_tail);
            let features = parameters.len() / (dataset.inputs.names.len() + 1);
            design.networks.iter_mut().for_each(|network| network.shape.inputs = features);
            match output_rank {
                Some(components) => design.with_components(components),
                None => design,
            }
        }
    };
    for (network, most) in design.networks.iter_mut().zip(distinct) {
        network.shape.centres = centres.min(*most);
    }
    design.relative_inputs = dataset.relative_inputs;
    design.in_ram_if_it_fits()
}

/// What every way to decode `frames` can offer at best, with errors of at least `least_error`. Blobs are larger than is
/// said here by less than their units and headers.
pub(super) fn offers(
    frames: &Frames<'_>,
    plan: &Plan,
    wires: Option<Wires>,
    prices: &Prices,
    least_error: f64,
) -> Result<Vec<Offer>> {
    let dataset = frames.training();
    let columns = dataset.inputs.names.iter().chain(&dataset.outputs.names);
    let names_bytes: usize = columns.map(|name| name.len() + 1).sum();
    let scan_ms = plan.device.scan_ms(wires, frames.samples_averaged);
    let mut offers = Vec::new();
    let most_centres = plan.centres.iter().copied().max().unwrap_or(0);
    for inputs in &frames.inputs {
        let distinct = distinct_samples(dataset, inputs, most_centres);
        for &centres in &plan.centres {
            for rank in ranks(plan, dataset, inputs.whole_array(), centres) {
                for Arithmetic { format, exponential } in Arithmetic::all() {
                    for affine_tail in [false, true] {
                        let of_inputs = (inputs, &distinct[..]);
                        let settings = (format, centres);
                        let design = design(dataset, of_inputs, settings, affine_tail, rank);
                        let blob_bytes = names_bytes + design.parameter_bytes();
                        if inputs.whole_array() && blob_bytes > SLOT_BYTES {
                            continue;
                        }
                        let costs = prices.frames(&design, exponential)?;
                        let mut offer = |cost: Cost| {
                            let times = plan.device.times(scan_ms, &cost);
                            let cycles = cost.cycles;
                            offers.push(Offer { rmse: least_error, cycles, blob_bytes, times });
                        };
                        offer(costs.ungated);
                        if exponential == Exponential::default() {
                            let gates = inputs.gates.iter();
                            gates.for_each(|gate| offer(costs.mean_cost(gate.share)));
                        }
                    }
                }
            }
        }
    }
    Ok(offers)
}

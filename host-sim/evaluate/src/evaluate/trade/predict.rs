//! Costs that are known before anything is trained: they depend on the sizes of a model, not on its numbers.

use model_core::blob::ModelShape;
use model_core::rbf::Format;
use taxel_data::dataset::Dataset;
use taxel_learn::Exponential;
use taxel_learn::cost::{Cost, Design, Prices};

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

/// Design of the model that training with these settings gives.
fn design(
    dataset: &Dataset,
    inputs: &Inputs,
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
    for inputs in &frames.inputs {
        for &centres in &plan.centres {
            for rank in ranks(plan, dataset, inputs.whole_array(), centres) {
                for Arithmetic { format, exponential } in Arithmetic::all() {
                    for affine_tail in [false, true] {
                        let design = design(dataset, inputs, (format, centres), affine_tail, rank);
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

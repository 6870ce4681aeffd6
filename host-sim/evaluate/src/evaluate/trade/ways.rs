//! Ways to decode that a plan tries, and their costs, which are known before anything is trained: they depend on the sizes
//! of a model, not on its numbers.

use std::collections::HashSet;

use taxel_core::blob::ModelShape;
use taxel_core::rbf::{Format, Shape};
use taxel_learn::cost::{Cost, Design, FrontDesign, NetworkDesign};
use taxel_learn::train::Start;

use super::choice::Offer;
use super::frames::{Frames, Inputs};
use super::{Device, Plan, SLOT_BYTES};

/// Ways to decode with networks that share their inputs, and have so many centres.
pub(super) struct Ways<'f> {
    pub frames: &'f Frames<'f>,
    pub inputs: &'f Inputs,
    pub centres: usize,
}

/// Formats of the networks to fit, the cheapest first.
pub(super) fn formats() -> impl DoubleEndedIterator<Item = Format> {
    Format::ALL.into_iter().rev()
}

impl<'f> Ways<'f> {
    /// All ways of a plan to decode these `frames`.
    pub fn all(frames: &'f Frames<'f>, plan: &Plan) -> impl Iterator<Item = Self> {
        let of_inputs = |inputs| plan.centres.iter().map(move |centres| (inputs, *centres));
        let ways = frames.inputs.iter().flat_map(of_inputs);
        ways.map(move |(inputs, centres)| Self { frames, inputs, centres })
    }

    /// What every way can offer at best, with an error of 0. Blobs are larger than is said here by less than their units
    /// and headers.
    pub fn offers(&self, device: &Device) -> Vec<Offer> {
        let dataset = self.frames.training();
        let columns = dataset.inputs.names.iter().chain(&dataset.outputs.names);
        let names_bytes: usize = columns.map(|name| name.len() + 1).sum();
        let distinct = distinct_samples(self.inputs, self.centres);
        let mut offers = Vec::new();
        for format in formats() {
            let design = self.design(format, &distinct);
            let blob_bytes = names_bytes + design.parameter_bytes();
            if !self.inputs.each_row() && blob_bytes > SLOT_BYTES {
                continue;
            }
            let cost = Cost::of_frame(&design);
            let times = device.times(self.frames.scan_ms, &cost);
            offers.push(Offer { rmse: 0.0, cycles: cost.cycles, blob_bytes, times });
        }
        offers
    }

    /// Design of the model that training gives, with at most as many centres as `distinct` samples of each network.
    fn design(&self, format: Format, distinct: &[usize]) -> Design {
        let (dataset, centres) = (self.frames.training(), self.centres);
        let of_row = |columns: &[String]| columns.len() / dataset.rows;
        let shape = ModelShape {
            rows: dataset.rows,
            inputs: of_row(&dataset.inputs.names),
            outputs: of_row(&dataset.outputs.names),
        };
        let of_start = |start: &Start| {
            let front = start.front(start.projection.as_ref());
            let (rows, inputs) = match &front {
                Some(front) => (1, front.view().inputs(dataset.inputs.names.len())),
                None => (shape.rows, shape.inputs),
            };
            let shape = Shape { inputs, centres, outputs: start.frames.group.outputs.len() / rows };
            let front = front.map(|front| FrontDesign::new(&front.view()));
            vec![NetworkDesign { format, shape, affine_tail: true, front }; rows]
        };
        let networks: Vec<_> = self.inputs.starts.iter().flat_map(of_start).collect();
        let mut design = Design {
            shape,
            row_network: (0..networks.len()).collect(),
            networks,
            relative_inputs: dataset.relative_inputs,
            weights_in_ram: false,
        };
        for (network, most) in design.networks.iter_mut().zip(distinct) {
            network.shape.centres = centres.min(*most);
        }
        design.in_ram_if_it_fits()
    }
}

/// Number of distinct samples of each network's inputs, counted up to `most`: networks have no more centres.
fn distinct_samples(inputs: &Inputs, most: usize) -> Vec<usize> {
    let of_start = |start: &Start| {
        let seen = start.frames.seen(start.projection.as_deref()).table;
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
        (0..seen.rows).map(distinct).collect::<Vec<_>>()
    };
    inputs.starts.iter().flat_map(of_start).collect()
}

//! Training and judging of the points that share their training and test frames.

use model_core::rbf::Format;
use rayon::prelude::*;
use taxel_data::progress::Progress;
use taxel_learn::cost::{Cost, DecoderRam, Design, Prices};
use taxel_learn::train::{
    Examples, FittedNetwork, Layers, Refinement, Samples, WHOLE_ARRAY_SPREAD, refine,
};
use taxel_learn::{Exponential, ModelBlob, Options, Origin, Trained, pack};

use super::device::Wires;
use super::frames::{Frames, Inputs};
use super::progress::Part;
use super::{Arithmetic, Plan, Point, SLOT_BYTES, predict};
use crate::error::Result;
use crate::metrics;

/// Collector of points, and of the blobs that they decode with.
pub(super) struct Judge<'s> {
    options: Options,
    plan: &'s Plan,
    wires: Option<Wires>,
    prices: &'s Prices,
    pub points: Vec<Point>,
    /// Formats that cannot hold a network of these settings, and why.
    pub left_out: Vec<String>,
    /// Index of each point's blob among the distinct ones.
    pub blobs: Vec<usize>,
    pub distinct: Vec<Vec<u8>>,
}

/// Network to fit on layers that are shared: format, affine tail, rank.
type Variant = (Format, bool, Option<usize>);

impl<'s> Judge<'s> {
    /// Judge of networks trained with `options`, except for the settings that the plan varies. A scan reads `wires`.
    pub fn new(options: Options, plan: &'s Plan, wires: Option<Wires>, prices: &'s Prices) -> Self {
        let (points, left_out, blobs, distinct) = (vec![], vec![], vec![], vec![]);
        Self { options, plan, wires, prices, points, left_out, blobs, distinct }
    }

    /// Trains and judges every format and tail with so many centres.
    pub fn centres(
        &mut self,
        (frames, inputs): (&Frames<'_>, &Inputs),
        centres: usize,
        progress: &dyn Progress,
    ) -> Result<()> {
        let whole_array = inputs.whole_array();
        let ranks = predict::ranks(self.plan, frames.training(), whole_array, centres);
        let variants: Vec<Variant> = (Format::ALL.into_iter().rev())
            .flat_map(|format| [(format, false), (format, true)])
            .flat_map(|(format, affine)| ranks.iter().map(move |rank| (format, affine, *rank)))
            .collect();
        let features = self.options.features.filter(|_| whole_array);
        let defaults = Options { whole_array, features, output_rank: None, ..self.options };
        let spread = match (self.options.whole_array, whole_array) {
            (false, true) => WHOLE_ARRAY_SPREAD * defaults.spread,
            (true, false) => defaults.spread / WHOLE_ARRAY_SPREAD,
            _ => defaults.spread,
        };
        let options = Options { centres, spread, ..defaults };
        options.check(frames.training().frames())?;
        let [refining, fitting] =
            parts(frames, inputs).map(|steps| Part::new(progress, steps, weight(centres)));
        // Layers are shared by all formats and by networks with and without a tail.
        let (layers, options) = layers(frames, inputs, &options, &refining)?;
        refining.finish();
        let fitted = fit(&layers, &options, &variants, &fitting);
        fitting.finish();
        for (variant, &(format, affine, rank)) in variants.iter().enumerate() {
            let of_rows = fitted.iter().map(|row| row[variant].as_ref().cloned());
            let networks = match of_rows.collect::<std::result::Result<_, _>>() {
                Ok(networks) => networks,
                Err(cause) => {
                    self.leave_out((format, centres, rank), whole_array, cause);
                    continue;
                }
            };
            let frames_seen = frames.training().frames();
            let trained =
                Trained { projection: layers.projection.clone(), networks, frames: frames_seen };
            let origin = &frames.set.origin;
            let noise = (origin.noise.0, frames.noise_level);
            let origin = Origin { noise, ..origin.clone() };
            let blob = pack(&trained, frames.training(), &origin)?;
            // A network that fell back to direct distances is the point of that format.
            let fell_back = trained.networks.iter().any(|network| network.format() != format);
            let fits = !whole_array || blob.bytes().len() <= SLOT_BYTES;
            if fell_back || !fits {
                continue;
            }
            for arithmetic in Arithmetic::all().filter(|a| a.format == format) {
                self.points(&blob, (frames, inputs), arithmetic, (affine, rank))?;
            }
            self.distinct.push(blob.bytes().to_vec());
        }
        Ok(())
    }

    /// Notes why a format cannot hold a network of these settings.
    fn leave_out(
        &mut self,
        (format, centres, rank): (Format, usize, Option<usize>),
        whole_array: bool,
        cause: &taxel_learn::Error,
    ) {
        let of = if whole_array { " array" } else { "" };
        let note = |rank: &str| format!("{}{of}, K = {centres}{rank}: {cause}", format.name());
        // What holds for full rank need not be said again.
        let rank = rank.filter(|_| !self.left_out.contains(&note("")));
        let note = note(&rank.map_or(String::new(), |rank| format!(", rank {rank}")));
        if !self.left_out.contains(&note) {
            self.left_out.push(note);
        }
    }

    /// Adds the points of a network: without a gate, and behind every gate that was measured with its
    /// exponential.
    fn points(
        &mut self,
        blob: &ModelBlob,
        (frames, inputs): (&Frames<'_>, &Inputs),
        arithmetic: Arithmetic,
        (affine_tail, output_rank): (bool, Option<usize>),
    ) -> Result<()> {
        let test = &frames.test;
        let model = blob.prepare(arithmetic.exponential).of_inputs();
        let design = Design::new(blob);
        let ram = DecoderRam::new(&design);
        // Fewer than asked for where there are fewer distinct samples.
        let centres = design.networks.iter().map(|network| network.shape.centres).max();
        let centres = centres.unwrap_or_default();
        let costs = self.prices.frames(&design, arithmetic.exponential)?;
        let estimate = model.decode_lines(&test.inputs.values);
        let scan_ms = self.plan.device.scan_ms(self.wires, frames.samples_averaged);
        let mut add = |gate_k: Option<f64>, frame: Cost, estimate: &[f64]| {
            self.points.push(Point {
                arithmetic,
                whole_array: inputs.whole_array(),
                centres,
                output_rank,
                spread: blob.spread(),
                affine_tail,
                samples_averaged: frames.samples_averaged,
                gate_k,
                errors: metrics::by_group(&test.outputs, estimate, &frames.measure),
                ratio_to_best: vec![],
                frame,
                times: self.plan.device.times(scan_ms, &frame),
                blob_bytes: blob.bytes().len(),
                ram_bytes: if gate_k.is_some() { ram.gated_bytes() } else { ram.bytes() },
                on_front: false,
            });
            self.blobs.push(self.distinct.len());
        };
        add(None, costs.ungated, &estimate);
        // Behind a gate with the firmware's exponential alone.
        if arithmetic.exponential == Exponential::default() {
            let rest_outputs = model.decode_lines(&inputs.gates.rest_inputs.values);
            for gate in inputs.gates.iter() {
                let frame = costs.mean_cost(gate.share);
                add(Some(gate.k), frame, &gate.gated(&estimate, &rest_outputs));
            }
        }
        Ok(())
    }
}

/// Steps of progress that [`Judge::centres`] takes.
pub(super) fn steps(frames: &Frames<'_>, inputs: &Inputs, centres: usize) -> usize {
    weight(centres) * parts(frames, inputs).iter().sum::<usize>()
}

/// Steps of refinement, and of fitting weights, which take about as long each.
fn parts(frames: &Frames<'_>, inputs: &Inputs) -> [usize; 2] {
    let networks = if inputs.whole_array() { 1 } else { frames.training().rows };
    let steps = Refinement::default().steps;
    let refining = match frames.set.examples() {
        None => 0,
        Some(Examples::Fresh(_)) => steps,
        Some(Examples::Folds(_)) => refine::fold_steps(steps, networks),
    };
    [refining, networks]
}

/// Steps of progress that a step with so many centres is worth: about its share of the time, which for many centres
/// grows with their square.
fn weight(centres: usize) -> usize {
    8 + centres * centres / 640
}

/// Layers of networks trained with `options`, and the options for fitting their weights.
fn layers<'f>(
    frames: &'f Frames<'_>,
    inputs: &Inputs,
    options: &Options,
    progress: &dyn Progress,
) -> Result<(Layers<'f>, Options)> {
    let dataset = frames.training();
    let start = Layers::behind(inputs.projection.clone(), dataset, options);
    let settings = Refinement::default();
    let Some(examples) = frames.set.examples() else { return Ok((start, *options)) };
    let layers = refine::refine(dataset, &start, options, &settings, examples, progress)?;
    Ok((layers, settings.options(options)))
}

/// Networks of every variant on the same layers, for every row.
fn fit(
    layers: &Layers<'_>,
    options: &Options,
    variants: &[Variant],
    progress: &dyn Progress,
) -> Vec<Vec<taxel_learn::Result<FittedNetwork>>> {
    let rows = layers.hidden.par_iter().enumerate();
    rows.map(|(row, layer)| {
        let table = layers.seen.row_table(row);
        let samples = Samples::new(&table);
        let fit = |&(format, affine_tail, output_rank): &Variant| {
            let options = Options { affine_tail, format, output_rank, ..*options };
            samples.fit_layer(layer, &options)
        };
        let fitted = variants.par_iter().map(fit).collect();
        progress.step();
        fitted
    })
    .collect()
}

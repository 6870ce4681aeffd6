//! Training and judging of the points that share their training and test frames.

use model_core::rbf::Format;
use rayon::prelude::*;
use taxel_data::dataset::Dataset;
use taxel_data::progress::{Progress, Silent};
use taxel_learn::cost::{Cost, DecoderRam, Design, Prices};
use taxel_learn::train::{
    Examples, FittedNetwork, Layers, Refinement, Samples, WHOLE_ARRAY_SPREAD, projection, refine,
};
use taxel_learn::{Exponential, ModelBlob, Options, Origin, Trained, pack};

use super::gating::Gates;
use super::{Arithmetic, Plan, Point, SLOT_BYTES};
use crate::error::Result;
use crate::experiment::MoreFrames;
use crate::metrics::{self, Measure};

/// Settings that distinguish points with the same frames, besides format, tail and gate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knobs {
    pub whole_array: bool,
    pub centres: usize,
    pub samples_averaged: usize,
}

/// Frames to train on and to test on, and what is found on them for all K.
pub(super) struct Sets<'s> {
    /// Noise level of the averaged readings, as a fraction.
    noise_level: f64,
    training: &'s Dataset,
    test: &'s Dataset,
    gates: &'s Gates,
    /// Projection of the whole array.
    projection: Option<Vec<f32>>,
    /// Further frames, if training is to be refined.
    more: Option<MoreFrames<'s>>,
}

impl<'s> Sets<'s> {
    /// Sets of frames; for networks of the whole array with a projection to so many `features`, or the usual number.
    pub fn new(
        noise_level: f64,
        [training, test]: [&'s Dataset; 2],
        gates: &'s Gates,
        (whole_array, features): (bool, Option<usize>),
        more: Option<MoreFrames<'s>>,
    ) -> Result<Self> {
        let projection = whole_array.then(|| projection::fit(training, features));
        let projection = projection.transpose()?;
        Ok(Self { noise_level, training, test, gates, projection, more })
    }

    /// Layers of networks trained with `options`, and the options for fitting their weights.
    fn layers(&self, options: &Options, progress: &dyn Progress) -> Result<(Layers, Options)> {
        let start = Layers { projection: self.projection.clone(), hidden: vec![] };
        let start = start.with_centres(self.training, options);
        let Some(more) = &self.more else { return Ok((start, *options)) };
        let settings = Refinement::default();
        let examples = Examples::Fresh(more);
        let layers = refine::refine(self.training, &start, options, &settings, examples, progress)?;
        Ok((layers, settings.options(options)))
    }
}

/// Collector of points, and of the blobs that they decode with.
pub(super) struct Judge<'s> {
    options: Options,
    origin: Origin,
    /// Measure of the errors of the points to come.
    pub measure: Measure,
    plan: &'s Plan,
    pub prices: Prices,
    pub points: Vec<Point>,
    /// Formats that cannot hold a network of these settings, and why.
    pub left_out: Vec<String>,
    /// Index of each point's blob among the distinct ones.
    pub blobs: Vec<usize>,
    pub distinct: Vec<Vec<u8>>,
}

impl<'s> Judge<'s> {
    /// Judge of networks trained with `options`, except for the settings that the plan varies.
    pub fn new(
        options: Options,
        origin: Origin,
        measure: Measure,
        plan: &'s Plan,
        prices: Prices,
    ) -> Self {
        let (points, left_out, blobs, distinct) = (vec![], vec![], vec![], vec![]);
        Self { options, origin, measure, plan, prices, points, left_out, blobs, distinct }
    }

    /// Trains and judges every format and tail with so many centres.
    pub fn centres(
        &mut self,
        sets: &Sets<'_>,
        knobs: Knobs,
        progress: &dyn Progress,
    ) -> Result<()> {
        let formats = Format::ALL.into_iter().rev();
        let ranks = self.ranks(sets, knobs);
        let variants: Vec<(Format, bool, Option<usize>)> = formats
            .flat_map(|format| [(format, false), (format, true)])
            .flat_map(|(format, affine)| ranks.iter().map(move |rank| (format, affine, *rank)))
            .collect();
        let Knobs { whole_array, .. } = knobs;
        let features = self.options.features.filter(|_| whole_array);
        let defaults = Options { whole_array, features, output_rank: None, ..self.options };
        let spread = match (self.options.whole_array, whole_array) {
            (false, true) => WHOLE_ARRAY_SPREAD * defaults.spread,
            (true, false) => defaults.spread / WHOLE_ARRAY_SPREAD,
            _ => defaults.spread,
        };
        let options = Options { centres: knobs.centres, spread, ..defaults };
        options.check(sets.training.frames())?;
        // Layers are shared by all formats and by networks with and without a tail.
        let (layers, options) = sets.layers(&options, &Silent)?;
        let seen = layers.seen(sets.training);
        let rows: Vec<Vec<taxel_learn::Result<FittedNetwork>>> = layers
            .hidden
            .par_iter()
            .enumerate()
            .map(|(row, layer)| {
                let table = seen.row_table(row);
                let samples = Samples::new(&table);
                let fit = |&(format, affine_tail, output_rank): &(Format, bool, Option<usize>)| {
                    let spread = layer.spread;
                    let options = Options { spread, affine_tail, format, output_rank, ..options };
                    samples.fit(&layer.centres, &options)
                };
                let fitted = variants.par_iter().map(fit).collect();
                progress.step();
                fitted
            })
            .collect();
        for (variant, &(format, affine, rank)) in variants.iter().enumerate() {
            let of_rows = rows.iter().map(|row| row[variant].as_ref().cloned());
            let networks = match of_rows.collect::<std::result::Result<_, _>>() {
                Ok(networks) => networks,
                Err(cause) => {
                    let of = if knobs.whole_array { " array" } else { "" };
                    let note = |rank: &str| {
                        format!("{}{of}, K = {}{rank}: {cause}", format.name(), knobs.centres)
                    };
                    // What holds for full rank need not be said again.
                    let rank = rank.filter(|_| !self.left_out.contains(&note("")));
                    let note = note(&rank.map_or(String::new(), |rank| format!(", rank {rank}")));
                    if !self.left_out.contains(&note) {
                        self.left_out.push(note);
                    }
                    continue;
                }
            };
            let trained = Trained { projection: layers.projection.clone(), networks };
            let noise = (self.origin.noise.0, sets.noise_level);
            let origin = Origin { noise, ..self.origin.clone() };
            let blob = pack(&trained, sets.training, &origin)?;
            // A network that fell back to direct distances is the point of that format.
            let fell_back = trained.networks.iter().any(|network| network.format() != format);
            let fits = !knobs.whole_array || blob.bytes().len() <= SLOT_BYTES;
            if fell_back || !fits {
                continue;
            }
            for arithmetic in Arithmetic::all().filter(|a| a.format == format) {
                self.points(&blob, sets, arithmetic, (knobs, affine, rank))?;
            }
            self.distinct.push(blob.bytes().to_vec());
        }
        Ok(())
    }

    /// Ranks of the output weights: full, and for the whole array those of the plan that take fewer multiplications.
    fn ranks(&self, sets: &Sets<'_>, knobs: Knobs) -> Vec<Option<usize>> {
        let outputs = sets.training.outputs.names.len();
        let fewer = |rank: &usize| rank * (knobs.centres + outputs) < knobs.centres * outputs;
        let of_plan = self.plan.output_ranks.iter().copied().filter(fewer).map(Some);
        [None].into_iter().chain(of_plan.filter(|_| knobs.whole_array)).collect()
    }

    /// Adds the points of a network: without a gate, and behind every gate that was measured with its
    /// exponential.
    fn points(
        &mut self,
        blob: &ModelBlob,
        sets: &Sets<'_>,
        arithmetic: Arithmetic,
        (knobs, affine_tail, output_rank): (Knobs, bool, Option<usize>),
    ) -> Result<()> {
        let Knobs { whole_array, centres, samples_averaged } = knobs;
        let test = sets.test;
        let model = blob.prepare(arithmetic.exponential).of_inputs();
        let design = Design::of(blob);
        let ram = DecoderRam::of(&design);
        let frames = self.prices.frames(&design, arithmetic.exponential)?;
        let estimate = model.decode_lines(&test.inputs.values);
        let mut add = |gate_k: Option<f64>, frame: Cost, estimate: &[f64]| {
            self.points.push(Point {
                arithmetic,
                whole_array,
                centres,
                output_rank,
                spread: blob.spread(),
                affine_tail,
                samples_averaged,
                gate_k,
                errors: metrics::by_group(&test.outputs, estimate, &self.measure),
                ratio_to_best: vec![],
                frame,
                frame_us: frame.cycles as f64 / self.plan.clock_mhz,
                flash_bytes: blob.bytes().len(),
                ram_bytes: if gate_k.is_some() { ram.gated_bytes() } else { ram.bytes() },
                on_front: false,
            });
            self.blobs.push(self.distinct.len());
        };
        add(None, frames.ungated, &estimate);
        // Behind a gate with the firmware's exponential alone.
        if arithmetic.exponential == Exponential::default() {
            let rest_outputs = model.decode_lines(&sets.gates.rest_inputs.values);
            for gate in sets.gates.iter() {
                let frame = frames.mean_cost(gate.share);
                add(Some(gate.k), frame, &gate.gated(&estimate, &rest_outputs));
            }
        }
        Ok(())
    }
}

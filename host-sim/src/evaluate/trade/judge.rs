//! Training and judging of the points that share their training and test frames.

use model_core::rbf::Format;
use rayon::prelude::*;
use taxel_data::dataset::Dataset;
use taxel_data::progress::Progress;
use taxel_learn::cost::{Cost, DecoderRam, Design, Prices};
use taxel_learn::train::{self, FittedNetwork, Samples, WHOLE_ARRAY_SPREAD, projection};
use taxel_learn::{Exponential, ModelBlob, Options, Origin, Trained, pack};

use super::gating::Gates;
use super::{Arithmetic, Plan, Point, SLOT_BYTES};
use crate::error::Result;
use crate::metrics::{self, Measure};

/// Settings that distinguish points with the same frames, besides format, tail and gate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knobs {
    pub whole_array: bool,
    pub centres: usize,
    pub samples_averaged: usize,
}

/// Frames to train on and to test on, and the data derived from them alone.
pub(super) struct Sets<'s> {
    /// Noise level of the averaged readings, as a fraction.
    noise_level: f64,
    training: &'s Dataset,
    test: &'s Dataset,
    gates: &'s Gates,
    /// Projection of the whole array, and the training frames behind it.
    projected: Option<(Vec<f32>, Dataset)>,
}

impl<'s> Sets<'s> {
    pub fn new(
        noise_level: f64,
        training: &'s Dataset,
        test: &'s Dataset,
        gates: &'s Gates,
        whole_array: bool,
    ) -> Result<Self> {
        let projected = if whole_array {
            let parameters = projection::fit(training)?;
            let seen = projection::apply(train::view(&parameters, training), training);
            Some((parameters, seen))
        } else {
            None
        };
        Ok(Self { noise_level, training, test, gates, projected })
    }

    /// Data on which the networks are trained.
    fn seen(&self) -> &Dataset {
        self.projected.as_ref().map_or(self.training, |(_, seen)| seen)
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
        let variants: Vec<(Format, bool)> =
            formats.flat_map(|format| [false, true].map(|affine| (format, affine))).collect();
        let defaults = self.options;
        let spread = if knobs.whole_array { WHOLE_ARRAY_SPREAD } else { 1.0 } * defaults.spread;
        let options = Options { centres: knobs.centres, spread, ..defaults };
        let seen = sets.seen();
        options.check(seen.frames())?;
        // Centres are shared by all formats of a row.
        let rows: Vec<Vec<taxel_learn::Result<FittedNetwork>>> = (0..seen.rows)
            .into_par_iter()
            .map(|row| {
                let table = seen.row_table(row);
                let samples = Samples::new(&table);
                let found = samples.centres(&options, row);
                let fit = |&(format, affine_tail): &(Format, bool)| {
                    samples.fit(&found, &Options { affine_tail, format, ..options })
                };
                let fitted = variants.par_iter().map(fit).collect();
                progress.step();
                fitted
            })
            .collect();
        for (variant, &(format, affine)) in variants.iter().enumerate() {
            let of_rows = rows.iter().map(|row| row[variant].as_ref().cloned());
            let networks = match of_rows.collect::<std::result::Result<_, _>>() {
                Ok(networks) => networks,
                Err(cause) => {
                    let of = if knobs.whole_array { " array" } else { "" };
                    let note = format!("{}{of}, K = {}: {cause}", format.name(), knobs.centres);
                    if !self.left_out.contains(&note) {
                        self.left_out.push(note);
                    }
                    continue;
                }
            };
            let projection = sets.projected.as_ref().map(|(parameters, _)| parameters.clone());
            let trained = Trained { projection, networks };
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
                self.points(&blob, sets, arithmetic, (knobs, affine, spread))?;
            }
            self.distinct.push(blob.bytes().to_vec());
        }
        Ok(())
    }

    /// Adds the points of a network: without a gate, and behind every gate that was measured with its
    /// exponential.
    fn points(
        &mut self,
        blob: &ModelBlob,
        sets: &Sets<'_>,
        arithmetic: Arithmetic,
        (knobs, affine_tail, spread): (Knobs, bool, f64),
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
                spread,
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

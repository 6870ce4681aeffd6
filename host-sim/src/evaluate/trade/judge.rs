//! Training and judging the points that share their training and test frames.

use model_core::rbf::Format;
use rayon::prelude::*;

use super::super::cost::{Cost, Costs, kernel_name};
use super::super::metrics::{self, Measure};
use super::super::ram::DecoderRam;
use super::gating::Gates;
use super::{Plan, Point, SLOT_BYTES};
use crate::dataset::Dataset;
use crate::error::{Error, Result};
use crate::infer::Kernel;
use crate::model::{self, LoadedModel, Origin};
use crate::number_format::NumberFormat;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::train::{self, FittedNetwork, Samples, Trained, WHOLE_ARRAY_SPREAD, projection};

/// What tells points with the same frames apart, beyond format, tail and gate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knobs {
    pub whole_array: bool,
    pub centres: usize,
    pub samples_averaged: usize,
}

/// Frames to train on and to test on, and what follows from them alone.
pub(super) struct Sets<'s> {
    averaged: &'s Scene,
    training: &'s Dataset,
    test: &'s Dataset,
    gates: &'s Gates,
    /// Of the whole array, and the training frames behind it.
    projected: Option<(Vec<f32>, Dataset)>,
}

impl<'s> Sets<'s> {
    pub fn new(
        averaged: &'s Scene,
        training: &'s Dataset,
        test: &'s Dataset,
        gates: &'s Gates,
        whole_array: bool,
    ) -> Result<Self> {
        let projected = if whole_array {
            let block = projection::fit(training)?;
            let seen = projection::apply(train::view(&block, training), training);
            Some((block, seen))
        } else {
            None
        };
        Ok(Self { averaged, training, test, gates, projected })
    }

    /// What the networks are trained on.
    fn seen(&self) -> &Dataset {
        self.projected.as_ref().map_or(self.training, |(_, seen)| seen)
    }
}

/// How errors of this scene are measured.
pub(super) fn measure(scene: &Scene) -> Measure {
    let Origin { full_scale, thickness_mm, .. } = Origin::of_scene(scene);
    Measure { full_scale, thickness_mm }
}

/// Collects points and the blobs that they decode with.
pub(super) struct Judge<'s> {
    scene: &'s Scene,
    plan: &'s Plan,
    pub costs: Costs,
    pub points: Vec<Point>,
    /// Of each point, which of the distinct ones.
    pub blobs: Vec<usize>,
    pub distinct: Vec<Vec<u8>>,
}

impl<'s> Judge<'s> {
    pub fn new(scene: &'s Scene, plan: &'s Plan, costs: Costs) -> Self {
        Self { scene, plan, costs, points: vec![], blobs: vec![], distinct: vec![] }
    }

    /// Every format and tail with so many centres.
    pub fn centres(&mut self, sets: &Sets<'_>, knobs: Knobs, progress: &Progress) -> Result<()> {
        let variants: Vec<(NumberFormat, bool)> =
            [NumberFormat::Fixed16, NumberFormat::F32, NumberFormat::F32Direct]
                .into_iter()
                .flat_map(|format| [false, true].map(|affine| (format, affine)))
                .collect();
        let defaults = model::options_of(sets.averaged);
        let spread = if knobs.whole_array { WHOLE_ARRAY_SPREAD } else { 1.0 } * defaults.spread;
        let options = train::Options { centres: knobs.centres, spread, ..defaults };
        let seen = sets.seen();
        options.check(seen.frames())?;
        // Centres are those of the row, whatever the format.
        let rows: Vec<Vec<FittedNetwork>> = (0..seen.rows)
            .into_par_iter()
            .map(|row| {
                let block = seen.block(row);
                let samples = Samples::new(&block);
                let found = samples.centres(&options, row);
                let fit = |&(format, affine_tail): &(NumberFormat, bool)| {
                    samples.fit(&found, &train::Options { affine_tail, format, ..options })
                };
                let fitted = variants.par_iter().map(fit).collect();
                progress.step();
                fitted
            })
            .collect::<Result<_>>()?;
        for (variant, (format, affine)) in variants.iter().enumerate() {
            let networks = rows.iter().map(|row| row[variant].clone()).collect();
            let projection = sets.projected.as_ref().map(|(block, _)| block.clone());
            let trained = Trained { projection, networks };
            let blob = model::encode(&trained, sets.training, &Origin::of_scene(sets.averaged))?;
            let loaded = LoadedModel::from_bytes("the model just trained".as_ref(), &blob)?;
            let formats: Vec<Format> = loaded.model().networks().map(|n| n.format()).collect();
            let exponentials: &[Kernel] = match format {
                // A network that fell back to direct distances is the point of that format.
                NumberFormat::F32 if formats.contains(&Format::F32Direct) => continue,
                // It fits no slot, so its cycles were not measured: those of rows are a network's.
                _ if knobs.whole_array && blob.len() > SLOT_BYTES => continue,
                NumberFormat::F32Direct => &[Kernel::Polynomial, Kernel::Libm, Kernel::Micromath],
                _ => &[Kernel::Polynomial],
            };
            for &exponential in exponentials {
                self.points(&loaded, sets, (formats[0], exponential), (knobs, *affine, spread))?;
            }
            self.distinct.push(blob);
        }
        Ok(())
    }

    /// A network without a gate, and behind every gate that was measured with its exponential.
    fn points(
        &mut self,
        loaded: &LoadedModel,
        sets: &Sets<'_>,
        (format, exponential): (Format, Kernel),
        (knobs, affine_tail, spread): (Knobs, bool, f64),
    ) -> Result<()> {
        let Knobs { whole_array, centres, samples_averaged } = knobs;
        let (kernel, test) = (kernel_name(format, exponential), sets.test);
        let ram = DecoderRam::of(&loaded.model());
        // Fewer centres than asked for are decoded as fast as the measured number or faster.
        let kind = (kernel.as_str(), centres, affine_tail, whole_array);
        let ungated = self.costs.frame(kind).ok_or_else(|| {
            Error::Failed(format!(
                "firmware/cycles.csv has no figure for {kernel}, K = {centres}, whole array: {whole_array}"
            ))
        })?;
        let frames = self.costs.frames(kind);
        let estimate = loaded.decode(exponential, &test.inputs).values;
        let mut add = |gate_k: Option<f64>, frame: Cost, estimate: &[f64]| {
            self.points.push(Point {
                kernel: kernel.clone(),
                whole_array,
                centres,
                spread,
                affine_tail,
                samples_averaged,
                gate_k,
                errors: metrics::by_group(&test.outputs, estimate, &measure(self.scene)),
                ratio_to_best: vec![],
                frame,
                frame_us: frame.cycles as f64 / self.plan.clock_mhz,
                flash_bytes: loaded.bytes().len(),
                ram_bytes: if gate_k.is_some() { ram.gated_bytes() } else { ram.bytes() },
                on_front: false,
            });
            self.blobs.push(self.distinct.len());
        };
        add(None, ungated, &estimate);
        if let Some(frames) = frames {
            let rest_outputs = loaded.decode(exponential, &sets.gates.baseline).values;
            for gate in sets.gates.iter() {
                let frame = frames.mean_cost(gate.share);
                add(Some(gate.k), frame, &gate.gated(&estimate, &rest_outputs));
            }
        }
        Ok(())
    }
}

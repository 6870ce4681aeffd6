//! The trade between speed and accuracy: every knob of a scene's decoder, its errors and its cost.
//!
//! Errors are measured on test frames through the blob that a device would get; instructions and cycles are
//! those measured of the firmware's own code ([`Costs`]), so only shapes that were measured can be traded.

use std::collections::BTreeMap;

use model_core::rbf::Format;
use rayon::prelude::*;
use serde::Serialize;

use super::cost::{Cost, Costs, MEASURED_SHAPE, kernel_name};
use super::gate;
use super::metrics::{self, Errors, Measure};
use crate::dataset::Dataset;
use crate::error::{Error, Result};
use crate::infer::Kernel;
use crate::model::{self, LoadedModel, Origin};
use crate::number_format::NumberFormat;
use crate::progress::Progress;
use crate::random::Stream;
use crate::scene::Scene;
use crate::synth;
use crate::train::{FittedNetwork, Samples, Trained};

mod choice;
mod gating;

pub use choice::Limits;
use gating::Gates;

/// Bytes of stack that the f32 kernel keeps activations in.
const F32_ACTIVATIONS_BYTES: usize = 512;

/// What to vary.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Centres of each row's network, K.
    pub centres: Vec<usize>,
    /// Samples averaged for each reading: white noise falls with the root.
    pub samples_averaged: Vec<usize>,
    /// Tolerances of gates, in standard deviations of the averaged readings' noise; there are always points
    /// without a gate as well.
    pub gate_k: Vec<f64>,
    /// Clock of the device, for times.
    pub clock_mhz: f64,
}

/// One way to decode, what it costs and how far it errs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// Format and exponential, as `cargo xtask cycles` names them.
    pub kernel: String,
    /// Centres of each row's network, K.
    pub centres: usize,
    /// Whether there is an affine tail.
    pub affine_tail: bool,
    /// Samples averaged for each reading.
    pub samples_averaged: usize,
    /// Tolerance of the gate, in standard deviations of the averaged readings' noise; `None` without a gate.
    pub gate_k: Option<f64>,
    /// Errors on the test frames, by group.
    pub errors: Vec<Errors>,
    /// RMSE over the smallest of all points, by group.
    pub ratio_to_best: Vec<f64>,
    /// One frame on a Cortex-M4F; behind a gate the mean of the test frames.
    #[serde(flatten)]
    pub frame: Cost,
    /// The same in µs at the plan's clock.
    pub frame_us: f64,
    /// The blob.
    pub flash_bytes: usize,
    /// Decoder, frame, estimate and working space; for a gate also the baseline and the answer to it.
    pub ram_bytes: usize,
    /// Whether no other point is at least as good in cycles, samples and the RMSE of the chosen group, and
    /// better in one.
    pub on_front: bool,
}

impl Point {
    /// RMSE of a group.
    #[must_use]
    pub fn rmse(&self, group: &str) -> f64 {
        self.errors.iter().find(|e| e.group == group).map_or(f64::NAN, |e| e.rmse)
    }

    /// The point's knobs in a few words.
    #[must_use]
    pub fn name(&self) -> String {
        let tail = if self.affine_tail { " + tail" } else { "" };
        let average = match self.samples_averaged {
            1 => String::new(),
            samples => format!(", {samples} samples"),
        };
        let gate = self.gate_k.map_or(String::new(), |k| format!(", gate k = {k}"));
        format!("{}, K = {}{tail}{average}{gate}", self.kernel, self.centres)
    }
}

/// Every point of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trade {
    /// Name of the scene.
    pub scene: String,
    /// Noise level of one sample.
    pub noise_level: f64,
    /// Test frames.
    pub test_frames: usize,
    /// Whose code the costs are.
    pub compiler: String,
    /// Clock for times.
    pub clock_mhz: f64,
    /// The group that front and choice go by.
    pub group: String,
    /// Its unit.
    pub unit: String,
    /// RMSE by group of always answering the training mean.
    pub mean: Vec<Errors>,
    /// All points.
    pub points: Vec<Point>,
    /// The point that the limits pick.
    pub chosen: Option<usize>,
    /// Every point's blob: points that differ in the exponential alone share one.
    #[serde(skip)]
    blobs: Vec<usize>,
    #[serde(skip)]
    distinct_blobs: Vec<Vec<u8>>,
}

impl Trade {
    /// The blob of a point.
    #[must_use]
    pub fn blob(&self, point: usize) -> &[u8] {
        &self.distinct_blobs[self.blobs[point]]
    }

    /// What a device is configured with for a point behind a gate: its tolerance, relative to each reading.
    #[must_use]
    pub fn rest_tolerance(&self, point: usize) -> Option<f64> {
        let point = &self.points[point];
        point.gate_k.map(|k| k * self.noise_level / (point.samples_averaged as f64).sqrt())
    }
}

/// Trains and judges every point of `plan` for `scene`; front and choice go by the RMSE of `group`.
///
/// # Errors
/// [`Error::Usage`] for a scene of another shape than was measured, for a plan that was not measured, and for
/// limits that no point meets.
pub fn compute(
    scene: &Scene,
    plan: &Plan,
    group: &str,
    limits: &Limits,
    progress: &Progress,
) -> Result<Trade> {
    let costs = Costs::measured()?;
    check(scene, plan, &costs)?;
    limits.check()?;
    progress
        .stage("trade", plan.samples_averaged.len() * plan.centres.len() * scene.read_rows.len());
    let mut judge = Judge { scene, plan, costs, points: vec![], blobs: vec![], distinct: vec![] };
    let mut mean = Vec::new();
    for &samples in &plan.samples_averaged {
        let mut averaged = scene.clone();
        averaged.noise.level = scene.noise.level / (samples as f64).sqrt();
        let training = synth::synthesise(&averaged, Stream::Training, scene.training.frames);
        let test = synth::synthesise(&averaged, Stream::Test, scene.training.test_frames);
        if mean.is_empty() {
            let means = training.outputs.means().repeat(test.frames());
            mean = metrics::by_group(&test.outputs, &means, &measure(scene));
        }
        let gates = Gates::new(&averaged, &test.inputs, &plan.gate_k);
        for &centres in &plan.centres {
            judge.centres(&averaged, [&training, &test], &gates, (centres, samples), progress)?;
        }
    }
    let Judge { costs, mut points, blobs, distinct, .. } = judge;
    compare(&mut points, group);
    let unit = mean.iter().find(|e| e.group == group).map_or(String::new(), |e| e.unit.clone());
    let chosen = limits.choose(&points, group, &unit)?;
    Ok(Trade {
        scene: scene.name.clone(),
        noise_level: scene.noise.level,
        test_frames: scene.training.test_frames,
        compiler: costs.compiler,
        clock_mhz: plan.clock_mhz,
        group: group.into(),
        unit,
        mean,
        points,
        chosen,
        blobs,
        distinct_blobs: distinct,
    })
}

fn check(scene: &Scene, plan: &Plan, costs: &Costs) -> Result<()> {
    let electrodes = scene.sensor.electrodes_per_row_wire * scene.outputs.axes.len();
    let shape = [scene.read_rows.len(), scene.sensor.column_wires, electrodes];
    if shape != MEASURED_SHAPE {
        let [rows, inputs, outputs] = shape;
        let [r, i, o] = MEASURED_SHAPE;
        return Err(Error::Usage(format!(
            "the scene has {rows} rows of {inputs} readings and {outputs} outputs; cycles are measured for \
             {r} rows of {i} and {o}: give a scene of that shape"
        )));
    }
    let measured = costs.centres();
    if let Some(centres) = plan.centres.iter().find(|centres| !measured.contains(centres)) {
        return Err(Error::Usage(format!(
            "--centres {centres}: cycles are measured for {measured:?}"
        )));
    }
    if let Some(samples) =
        plan.samples_averaged.iter().find(|samples| !(1..=256).contains(*samples))
    {
        return Err(Error::Usage(format!(
            "--average {samples}: the firmware averages 1 to 256 samples"
        )));
    }
    if !plan.gate_k.is_empty() {
        // Averaging only lowers the noise.
        gate::check(scene, "--gate", &plan.gate_k)?;
    }
    Ok(())
}

fn measure(scene: &Scene) -> Measure {
    let Origin { full_scale, thickness_mm, .. } = Origin::of_scene(scene);
    Measure { full_scale, thickness_mm }
}

struct Judge<'s> {
    scene: &'s Scene,
    plan: &'s Plan,
    costs: Costs,
    points: Vec<Point>,
    blobs: Vec<usize>,
    distinct: Vec<Vec<u8>>,
}

impl Judge<'_> {
    /// Every format and tail with so many centres.
    fn centres(
        &mut self,
        averaged: &Scene,
        [training, test]: [&Dataset; 2],
        gates: &Gates,
        (centres, samples): (usize, usize),
        progress: &Progress,
    ) -> Result<()> {
        let variants: Vec<(NumberFormat, bool)> =
            [NumberFormat::Fixed16, NumberFormat::F32, NumberFormat::F32Direct]
                .into_iter()
                .flat_map(|format| [false, true].map(|affine| (format, affine)))
                .collect();
        let defaults = model::options_of(averaged);
        // Centres are those of the row, whatever the format.
        let rows: Vec<Vec<FittedNetwork>> = (0..training.rows)
            .into_par_iter()
            .map(|row| {
                let block = training.block(row);
                let samples = Samples::new(&block);
                let options = crate::train::Options { centres, ..defaults };
                options.check(training.frames())?;
                let found = samples.centres(&options, row);
                let fit = |&(format, affine_tail): &(NumberFormat, bool)| {
                    samples.fit(&found, &crate::train::Options { affine_tail, format, ..options })
                };
                let fitted = variants.iter().map(fit).collect();
                progress.step();
                fitted
            })
            .collect::<Result<_>>()?;
        for (variant, (format, affine)) in variants.iter().enumerate() {
            let networks: Vec<FittedNetwork> =
                rows.iter().map(|row| row[variant].clone()).collect();
            let blob = model::encode(
                &Trained { projection: None, networks },
                training,
                &Origin::of_scene(averaged),
            )?;
            let loaded = LoadedModel::from_bytes("the model just trained".as_ref(), &blob)?;
            let formats: Vec<Format> = loaded.model().networks().map(|n| n.format()).collect();
            let exponentials: &[Kernel] = match format {
                // A network that fell back to direct distances is the point of that format.
                NumberFormat::F32 if formats.contains(&Format::F32Direct) => continue,
                NumberFormat::F32Direct => &[Kernel::Polynomial, Kernel::Libm, Kernel::Micromath],
                _ => &[Kernel::Polynomial],
            };
            let actual = formats[0];
            for &exponential in exponentials {
                let knobs = (centres, *affine, samples);
                self.points(&loaded, test, gates, (actual, exponential), knobs)?;
            }
            self.distinct.push(blob);
        }
        Ok(())
    }

    /// A network without a gate, and behind every gate that was measured with its exponential.
    fn points(
        &mut self,
        loaded: &LoadedModel,
        test: &Dataset,
        gates: &Gates,
        (format, exponential): (Format, Kernel),
        (centres, affine_tail, samples_averaged): (usize, bool, usize),
    ) -> Result<()> {
        let kernel = kernel_name(format, exponential);
        // Fewer centres than asked for are decoded as fast as the measured number or faster.
        let ungated = self.costs.of(&kernel, centres, affine_tail, "frame").ok_or_else(|| {
            Error::Failed(format!("firmware/cycles.csv has no figure for {kernel}, K = {centres}"))
        })?;
        let frames = self.costs.frames(&kernel, centres, affine_tail);
        let estimate = loaded.decode(exponential, &test.inputs).values;
        let [rows, inputs, outputs] = MEASURED_SHAPE;
        let float = size_of::<f32>();
        let working =
            inputs * float + if format == Format::F32 { F32_ACTIVATIONS_BYTES } else { 0 };
        let (frame_bytes, estimate_bytes) = (rows * inputs * float, rows * (outputs * float + 1));
        let ram_bytes =
            model_core::decoder_ram_bytes(rows) + frame_bytes + estimate_bytes + working;
        let mut add = |gate_k: Option<f64>, frame: Cost, estimate: &[f64]| {
            self.points.push(Point {
                kernel: kernel.clone(),
                centres,
                affine_tail,
                samples_averaged,
                gate_k,
                errors: metrics::by_group(&test.outputs, estimate, &measure(self.scene)),
                ratio_to_best: vec![],
                frame,
                frame_us: frame.cycles as f64 / self.plan.clock_mhz,
                flash_bytes: loaded.bytes().len(),
                // The baseline is a frame, and the answer to it an estimate.
                ram_bytes: ram_bytes + gate_k.map_or(0, |_| frame_bytes + estimate_bytes),
                on_front: false,
            });
            self.blobs.push(self.distinct.len());
        };
        add(None, ungated, &estimate);
        if let Some(frames) = frames {
            let rest_outputs = loaded.decode(exponential, &gates.baseline).values;
            for gate in gates.iter() {
                let frame = frames.mean_cost(gate.share);
                add(Some(gate.k), frame, &gate.gated(&estimate, &rest_outputs));
            }
        }
        Ok(())
    }
}

/// Fills in what compares points with each other.
fn compare(points: &mut [Point], group: &str) {
    let mut best: BTreeMap<String, f64> = BTreeMap::new();
    for errors in points.iter().flat_map(|point| &point.errors) {
        let least = best.entry(errors.group.clone()).or_insert(f64::INFINITY);
        *least = least.min(errors.rmse);
    }
    let rank = |point: &Point| (point.frame.cycles, point.samples_averaged, point.rmse(group));
    let ranks: Vec<_> = points.iter().map(rank).collect();
    for (point, own) in points.iter_mut().zip(&ranks) {
        point.ratio_to_best = point.errors.iter().map(|e| e.rmse / best[&e.group]).collect();
        let beaten = |other: &(u64, usize, f64)| {
            other != own && other.0 <= own.0 && other.1 <= own.1 && other.2 <= own.2
        };
        point.on_front = !ranks.iter().any(beaten);
    }
}

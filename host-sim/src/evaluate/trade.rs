//! The trade between speed and accuracy: every knob of a scene's decoder, its errors and its cost.
//!
//! Errors are measured on test frames through the blob that a device would get; instructions and cycles are
//! those measured of the firmware's own code ([`Costs`]), so only shapes that were measured can be traded.

use std::collections::BTreeMap;

use serde::Serialize;

use super::cost::{Cost, Costs, MEASURED_SHAPE};
use super::gate;
use super::metrics::{self, Errors};
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::random::Stream;
use crate::scene::Scene;
use crate::synth;

mod choice;
mod gating;
mod judge;

pub use choice::Limits;
use gating::Gates;
use judge::{Judge, Knobs, Sets, measure};

/// The largest blob that a slot of the firmware's images holds.
pub const SLOT_BYTES: usize = 131_072;

/// What to vary.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Centres of each network, K.
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
    /// Whether one network decodes all rows, behind a projection, instead of one a row.
    pub whole_array: bool,
    /// Centres of each network, K.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
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

    /// The kernel, and whether it decodes the whole array at once.
    #[must_use]
    pub fn way(&self) -> String {
        format!("{}{}", self.kernel, if self.whole_array { " array" } else { "" })
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
        format!("{}, K = {}{tail}{average}{gate}", self.way(), self.centres)
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
    /// The point that [`Trade::choose`] picked.
    pub chosen: Option<usize>,
    /// Every point's blob: points that differ in the exponential alone share one.
    #[serde(skip)]
    blobs: Vec<usize>,
    #[serde(skip)]
    distinct_blobs: Vec<Vec<u8>>,
}

impl Trade {
    /// Picks the point within `limits`, if any are given.
    ///
    /// # Errors
    /// [`Error::Usage`] if no point is within them.
    pub fn choose(&mut self, limits: &Limits) -> Result<()> {
        self.chosen = limits.choose(&self.points, &self.group, &self.unit)?;
        Ok(())
    }

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

/// Trains and judges every point of `plan` for `scene`; the front goes by the RMSE of `group`.
///
/// # Errors
/// [`Error::Usage`] for a scene of another shape than was measured, and for a plan that was not measured.
pub fn compute(scene: &Scene, plan: &Plan, group: &str, progress: &Progress) -> Result<Trade> {
    let costs = Costs::measured()?;
    check(scene, plan, &costs)?;
    // Each row's network, and one for the array.
    let networks = scene.read_rows.len() + 1;
    progress.stage("trade", plan.samples_averaged.len() * plan.centres.len() * networks);
    let mut judge = Judge::new(scene, plan, costs);
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
        for whole_array in [false, true] {
            let gates = Gates::new(&averaged, &test.inputs, &plan.gate_k, whole_array);
            let sets = Sets::new(&averaged, &training, &test, &gates, whole_array)?;
            for &centres in &plan.centres {
                let knobs = Knobs { whole_array, centres, samples_averaged: samples };
                judge.centres(&sets, knobs, progress)?;
            }
        }
    }
    let Judge { costs, mut points, blobs, distinct, .. } = judge;
    compare(&mut points, group);
    let unit = mean.iter().find(|e| e.group == group).map_or(String::new(), |e| e.unit.clone());
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
        chosen: None,
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

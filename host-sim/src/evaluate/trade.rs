//! Trade between speed and accuracy: every setting of a scene's decoder, its errors and its cost.
//!
//! Errors are measured on test frames through the blob that a device would get. Instructions and cycles are predicted by
//! the price list of the firmware's own code ([`Prices`]).

use std::borrow::Cow;
use std::collections::BTreeMap;

use model_core::rbf::Format;
use serde::Serialize;
use taxel_data::BadValue;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_learn::cost::{Cost, Prices, kernel_name};
use taxel_learn::decoders::{BASELINES, Baseline};
use taxel_learn::{Exponential, Options};
use taxel_simulate::Synthesis;
use taxel_simulate::outputs::Outputs;

use super::gate;
use crate::error::{Error, NoPoint, Result};
use crate::experiment::{Experiment, MoreFrames};
use crate::metrics::{self, DecoderErrors, Errors, LimitSummary};

mod choice;
mod gating;
mod judge;

pub use choice::Bounds;
use gating::Gates;
use judge::{Judge, Knobs, Sets};

/// Largest blob in bytes that a slot of the firmware's images holds: 128 KiB less the record behind it.
pub const SLOT_BYTES: usize = 131_056;

/// Settings that a trade varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Numbers of centres K of each network.
    pub centres: Vec<usize>,
    /// Numbers of components that a network for the whole array may compute, which are expanded to its outputs. There
    /// are always points that compute all outputs as well.
    pub output_ranks: Vec<usize>,
    /// Numbers of samples averaged for each reading: white noise falls with the square root.
    pub samples_averaged: Vec<usize>,
    /// Tolerances of gates, in standard deviations of the averaged readings' noise. There are always
    /// points without a gate as well.
    pub gate_k: Vec<f64>,
    /// Clock of the device, for times.
    pub clock_mhz: f64,
}

/// Number format and exponential with which networks are decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arithmetic {
    /// Number format.
    pub format: Format,
    /// Exponential.
    pub exponential: Exponential,
}

impl Arithmetic {
    /// Every arithmetic of the points, the cheapest format first.
    ///
    /// Direct distances are decoded with every exponential, the other formats with their own.
    pub fn all() -> impl Iterator<Item = Self> {
        Format::ALL.into_iter().rev().flat_map(|format| {
            let all: &[Exponential] = match format {
                Format::F32Direct => &Exponential::ALL,
                _ => &[Exponential::Polynomial],
            };
            all.iter().map(move |&exponential| Self { format, exponential })
        })
    }

    /// Name of the arithmetic, as `cargo xtask cycles` spells it.
    #[must_use]
    pub fn name(self) -> String {
        kernel_name(self.format, self.exponential)
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn by_name<S: serde::Serializer>(
    arithmetic: &Arithmetic,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_str(&arithmetic.name())
}

/// Way to decode, with its cost and its errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// Format and exponential.
    #[serde(rename = "kernel", serialize_with = "by_name")]
    pub arithmetic: Arithmetic,
    /// Whether one network decodes all rows, behind a projection, instead of one a row.
    pub whole_array: bool,
    /// Number of centres K of each network.
    pub centres: usize,
    /// Number of components that the network computes, which are expanded to all outputs; `None` if it computes these.
    pub output_rank: Option<usize>,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Whether the networks have an affine tail.
    pub affine_tail: bool,
    /// Number of samples averaged for each reading.
    pub samples_averaged: usize,
    /// Tolerance of the gate, in standard deviations of the averaged readings' noise; `None` without a gate.
    pub gate_k: Option<f64>,
    /// Errors on the test frames, by group.
    pub errors: Vec<Errors>,
    /// Ratio of the RMSE to the smallest of all points, by group.
    pub ratio_to_best: Vec<f64>,
    /// Cost of one frame on a Cortex-M4F; behind a gate, the mean over the test frames.
    #[serde(flatten)]
    pub frame: Cost,
    /// Time of one frame in µs, at the plan's clock.
    pub frame_us: f64,
    /// Size of the blob.
    pub flash_bytes: usize,
    /// Size of decoder, frame, estimate and working memory; for a gate also the baseline and its
    /// estimate.
    pub ram_bytes: usize,
    /// Whether the point is on the Pareto front: no other point is at least as good in cycles, samples
    /// and the RMSE of the chosen group, and better in one.
    pub on_front: bool,
}

impl Point {
    /// RMSE of a group, in its unit.
    #[must_use]
    pub fn rmse(&self, group: &str) -> f64 {
        self.errors.iter().find(|e| e.group == group).map_or(f64::NAN, |e| e.rmse)
    }

    /// Ratio of the RMSE of a group to the limit, where that is known.
    #[must_use]
    pub fn ratio_to_limit(&self, group: &str) -> Option<f64> {
        self.errors.iter().find(|e| e.group == group)?.ratio_to_limit
    }

    /// Arithmetic of the point, and whether it decodes the whole array at once.
    #[must_use]
    pub fn way(&self) -> String {
        format!("{}{}", self.arithmetic.name(), if self.whole_array { " array" } else { "" })
    }

    /// Settings of the point in a few words.
    #[must_use]
    pub fn name(&self) -> String {
        let tail = if self.affine_tail { " + tail" } else { "" };
        let average = match self.samples_averaged {
            1 => String::new(),
            samples => format!(", {samples} samples"),
        };
        let gate = self.gate_k.map_or(String::new(), |k| format!(", gate k = {k}"));
        let rank = self.output_rank.map_or(String::new(), |rank| format!(", rank {rank}"));
        format!("{}, K = {}{rank}{tail}{average}{gate}", self.way(), self.centres)
    }
}

/// Trade of a scene: every point, and the one chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trade {
    /// Name of the scene.
    pub scene: String,
    /// Noise level of one sample, as a fraction.
    pub noise_level: f64,
    /// Number of test frames.
    pub test_frames: usize,
    /// Compiler of the code whose costs are given.
    pub compiler: String,
    /// Clock for times.
    pub clock_mhz: f64,
    /// Group of outputs by which front and choice are determined.
    pub group: String,
    /// Unit of that group.
    pub unit: String,
    /// Least possible errors with the first number of samples a reading, of a decoder that sees all readings of a frame.
    /// Ratios to the limit are to that of the point's own number of samples.
    pub limit: Option<LimitSummary>,
    /// Errors of the baselines, from one sample a reading.
    pub baselines: Vec<DecoderErrors>,
    /// Every point that was judged.
    pub points: Vec<Point>,
    /// Formats that cannot hold a network of some settings, and why.
    pub left_out: Vec<String>,
    /// Index of the point that [`Trade::choose`] picked.
    pub chosen: Option<usize>,
    /// Index of every point's blob: points that differ only in the exponential share one.
    #[serde(skip)]
    blobs: Vec<usize>,
    #[serde(skip)]
    distinct_blobs: Vec<Vec<u8>>,
}

impl Trade {
    /// Picks the point within `bounds`, if any are given.
    ///
    /// # Errors
    /// [`NoPoint`] if no point is within them.
    pub fn choose(&mut self, bounds: &Bounds) -> std::result::Result<(), NoPoint> {
        self.chosen = bounds.choose(&self.points, &self.group, &self.unit)?;
        Ok(())
    }

    /// Groups of outputs, with their units.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &str)> {
        let errors = self.baselines.first().map_or(&[][..], |baseline| &baseline.errors);
        errors.iter().map(|errors| (errors.group.as_str(), errors.unit.as_str()))
    }

    /// Blob of a point.
    #[must_use]
    pub fn blob(&self, point: usize) -> &[u8] {
        &self.distinct_blobs[self.blobs[point]]
    }

    /// Tolerance for the configuration of a device, relative to each reading, for a point behind a gate.
    #[must_use]
    pub fn rest_tolerance(&self, point: usize) -> Option<f64> {
        let point = &self.points[point];
        point.gate_k.map(|k| k * self.noise_level / (point.samples_averaged as f64).sqrt())
    }
}

/// Trains and judges every point of `plan` for the scene. The front is determined by the RMSE of
/// `group`.
///
/// # Errors
/// [`Error`] for a plan that cannot be carried out, or a scene that cannot be trained.
pub fn compute(
    experiment: &Experiment,
    plan: &Plan,
    group: &str,
    progress: &dyn Progress,
) -> Result<Trade> {
    let prices = Prices::accepted()?;
    check(experiment, plan)?;
    let (world, t) = (&experiment.world, &experiment.training);
    // One network for each row, and one for the array of several rows; that alone where outputs belong to no row.
    let rows = world.read_rows.len();
    let arrays: &[bool] = match world.outputs {
        Outputs::Contact(_) => &[true],
        Outputs::Electrodes(_) if rows > 1 => &[false, true],
        Outputs::Electrodes(_) => &[false],
    };
    let networks = arrays.iter().map(|array| if *array { 1 } else { rows }).sum::<usize>();
    let mut judge =
        Judge::new(experiment.options(), experiment.origin(), experiment.measure(), plan, prices);
    let mut limit = None;
    let mut baselines = Vec::new();
    for &samples in &plan.samples_averaged {
        let noise_level = world.noise.level / (samples as f64).sqrt();
        let frames = Synthesis::of(world).noise_level(noise_level);
        let training = experiment.dataset(&frames, Stream::Training, t.frames);
        let test = experiment.dataset(&frames, Stream::Test, t.test_frames);
        let (measure, summary) =
            experiment.measure_beside_limit(noise_level, t.test_frames, progress);
        limit.get_or_insert(summary);
        // The gate compares readings in Ω.
        let readings_ohm = if t.relative_inputs {
            Cow::Owned(frames.frames(Stream::Test, t.test_frames).inputs)
        } else {
            Cow::Borrowed(&test.inputs)
        };
        if baselines.is_empty() {
            let judged = |baseline: &Baseline| {
                metrics::judge(baseline.fit(&training).as_ref(), &test, &measure)
            };
            baselines = BASELINES.iter().map(judged).collect();
        }
        judge.measure = measure;
        progress.stage(&format!("trade, {samples} averaged"), plan.centres.len() * networks);
        for &whole_array in arrays {
            let gates = Gates::new(
                &frames,
                noise_level,
                &readings_ohm,
                &plan.gate_k,
                (whole_array, t.relative_inputs),
            );
            let more = t.refine.then_some(MoreFrames { experiment, synthesis: frames.clone() });
            let sets = Sets::new(
                noise_level,
                [&training, &test],
                &gates,
                (whole_array, t.features),
                more,
            )?;
            for &centres in &plan.centres {
                let knobs = Knobs { whole_array, centres, samples_averaged: samples };
                judge.centres(&sets, knobs, progress)?;
            }
        }
    }
    let Judge { prices, mut points, left_out, blobs, distinct, .. } = judge;
    if let (true, Some(cause)) = (points.is_empty(), left_out.first()) {
        return Err(Error::Failed(format!("no way to decode the scene can be trained: {cause}")));
    }
    compare(&mut points, group);
    let of_group = baselines.first().and_then(|b| b.errors.iter().find(|e| e.group == group));
    Ok(Trade {
        scene: experiment.name.clone(),
        noise_level: world.noise.level,
        test_frames: t.test_frames,
        compiler: prices.compiler,
        clock_mhz: plan.clock_mhz,
        group: group.into(),
        unit: of_group.map_or(String::new(), |errors| errors.unit.clone()),
        limit,
        baselines,
        points,
        left_out,
        chosen: None,
        blobs,
        distinct_blobs: distinct,
    })
}

fn check(experiment: &Experiment, plan: &Plan) -> std::result::Result<(), BadValue> {
    let world = &experiment.world;
    for &centres in &plan.centres {
        Options { centres, ..experiment.options() }.check(experiment.training.frames)?;
    }
    if let Some(samples) =
        plan.samples_averaged.iter().find(|samples| !(1..=256).contains(*samples))
    {
        return Err(BadValue::new("average", samples, "the firmware averages 1 to 256 samples"));
    }
    if plan.output_ranks.contains(&0) {
        return Err(BadValue::new("output-rank", 0, "a network computes one component at least"));
    }
    if !plan.gate_k.is_empty() {
        // Averaging only lowers the noise.
        gate::check(world, &plan.gate_k)
            .map_err(|bad| if bad.field == "k" { bad.named("gate") } else { bad })?;
    }
    Ok(())
}

/// Fills in the fields that compare points with each other.
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

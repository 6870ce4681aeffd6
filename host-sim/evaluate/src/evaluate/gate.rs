//! Gating: the work saved by skipping untouched rows, and the touches missed.

use serde::Serialize;
use taxel_core::gate::is_at_rest;
use taxel_data::{BadValue, Progress, Stream, Table};
use taxel_learn::cost::Frames;
use taxel_learn::decoders::mean;
use taxel_learn::{PreparedModel, relative};
use taxel_simulate::noise::NoiseKind;
pub use taxel_simulate::synth::BASELINE_FRAMES;
use taxel_simulate::{Synthesis, World};

use crate::experiment::Experiment;
use crate::measurements::Measurements;
use crate::metrics::{self, DecoderErrors, Errors, LimitSummary, NETWORK};

mod frames;

use frames::GateFrames;
pub use frames::GateRest;

/// Deformations in mm beyond which a row that is skipped counts as missed.
pub const MISSED_OVER_MM: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

/// Tolerance that `docs/gating.md` recommends, in standard deviations of a reading's noise.
pub const RECOMMENDED_K: f64 = 3.5;

/// Settings of a measurement of gates.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Tolerances, in standard deviations of a reading's noise.
    pub k: Vec<f64>,
    /// Number of frames of the scene, and as many of the untouched sensor.
    pub frames: usize,
    /// Number of frames of the untouched sensor whose mean is the baseline.
    pub baseline_frames: usize,
    /// Cycles of a frame at zero wait.
    pub frame_cycles: Frames<u64>,
    /// Cycles of a frame from flash, if they are known.
    pub flash_frame_cycles: Option<Frames<u64>>,
}

/// Checks that these tolerances `k` and `baseline_frames` make gates for `world`.
pub fn check_settings(world: &World, k: &[f64], baseline_frames: usize) -> Result<(), BadValue> {
    check(world, k)?;
    if baseline_frames == 0 {
        return Err(BadValue::new("baseline-frames", 0, "give at least 1 frame to average"));
    }
    if k.is_empty() {
        return Err(BadValue::new("k", "[]", "give at least one number, such as 3.5"));
    }
    Ok(())
}

/// Checks that `world` has noise that a gate's tolerance can be derived from.
pub fn check_noise(world: &World) -> Result<(), BadValue> {
    if world.noise.kind != NoiseKind::Relative {
        let rule = "the gate's tolerance is relative to each reading; use a scene with noise.kind = \"relative\"";
        return Err(BadValue::new("noise.kind", "\"span\"", rule));
    }
    if world.noise.is_none() {
        let rule = "the gate's tolerance is k times it; give a positive one, such as 0.005";
        return Err(BadValue::new("noise level", 0, rule));
    }
    Ok(())
}

/// Checks that tolerances `k`, in standard deviations of a reading's noise, make gates for `world`.
pub fn check(world: &World, k: &[f64]) -> Result<(), BadValue> {
    check_noise(world)?;
    check_tolerances(world.noise.total_level(), k)
}

/// Checks tolerances `k`, in standard deviations of a reading's relative noise `level`.
fn check_tolerances(level: f64, k: &[f64]) -> Result<(), BadValue> {
    match k.iter().find(|k| !(**k > 0.0 && *k * level < 1.0)) {
        Some(k) => {
            let rule = format!(
                "give positive numbers with k × noise below 1, such as 3.5 (noise is {level})"
            );
            Err(BadValue::new("k", k, rule))
        }
        None => Ok(()),
    }
}

/// Rows that were moved by more than `over_mm`, and how many of them were skipped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Missed {
    /// Bound in mm on the largest ‖Δ‖ of the row's electrodes.
    pub over_mm: f64,
    /// Number of rows that were moved farther.
    pub rows: usize,
    /// Number of these rows that were not decoded.
    pub missed: usize,
}

impl Missed {
    /// Share of such rows that is missed; `None` if there are none.
    pub fn share(&self) -> Option<f64> {
        (self.rows > 0).then(|| self.missed as f64 / self.rows as f64)
    }
}

/// Result of a gate with one tolerance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Tolerance k, in standard deviations of a reading's noise.
    pub k: f64,
    /// Tolerance relative to the reading, for the configuration of a device.
    pub rest_tolerance: f64,
    /// Share of the scene's rows that is not decoded.
    pub skipped: f64,
    /// Share of rows that is decoded although nothing touches the sensor.
    pub woken: f64,
    /// Upper bound on that share, [by theory](woken_by_theory).
    pub woken_by_theory: f64,
    /// Rows of the scene that are missed, by [`MISSED_OVER_MM`]; empty where deformations are not known.
    pub missed: Vec<Missed>,
    /// Largest ‖Δ‖ in mm of a row that was not decoded.
    pub largest_missed_mm: Option<f64>,
    /// Errors over the scene with this gate.
    pub errors: Vec<Errors>,
    /// Mean cycles of a frame of the scene at zero wait, relative to one without a gate.
    pub relative_cost: f64,
    /// Mean cycles of a frame of the untouched sensor at zero wait, relative to one without a gate.
    pub relative_cost_untouched: f64,
}

/// Results of a scene behind gates of several tolerances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateResult {
    /// Name of the scene or data.
    pub subject: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// Relative noise of a reading, as a fraction.
    pub noise_level: f64,
    /// Number of frames of the touched sensor.
    pub frames: usize,
    /// Number of frames of the untouched sensor.
    pub untouched_frames: usize,
    pub rows: usize,
    /// Number of frames whose mean is the baseline.
    pub baseline_frames: usize,
    /// CRC-32 of the model, in hexadecimal.
    pub model_crc: String,
    /// Cycles of a frame at zero wait.
    pub frame_cycles: Frames<u64>,
    /// Cycles of a frame from flash, if they are known.
    pub flash_frame_cycles: Option<Frames<u64>>,
    /// Least possible errors, of a decoder that sees all readings of a frame.
    pub limit: LimitSummary,
    /// Errors over the scene: of the network without a gate, then of always predicting the mean of these frames.
    pub decoders: Vec<DecoderErrors>,
    /// Results by tolerance.
    pub lines: Vec<Line>,
}

impl GateResult {
    /// Errors of the network without a gate.
    pub fn ungated_errors(&self) -> &[Errors] {
        metrics::of_decoder(&self.decoders, NETWORK)
    }

    /// Errors of always predicting the mean.
    pub fn mean_errors(&self) -> &[Errors] {
        metrics::of_decoder(&self.decoders, mean::NAME)
    }
}

/// Upper bound on the share of untouched rows of n `readings` that noise alone wakes: 1 − (1 −
/// 2Q(k'))^(n + 1).
///
/// It holds for the readings and their sum (Šidák's inequality), with Q the upper tail of the normal
/// distribution. k' = k/√(1 + 1/B) accounts for the noise that is left in a baseline of B frames.
pub fn woken_by_theory(k: f64, readings: usize, baseline_frames: usize) -> f64 {
    let k = k / (1.0 + 1.0 / baseline_frames as f64).sqrt();
    let beyond = libm::erfc(k / std::f64::consts::SQRT_2); // 2Q(k)
    -libm::expm1((readings + 1) as f64 * libm::log1p(-beyond))
}

/// Puts every row of the scene's test frames, and of as many frames of the untouched sensor, through
/// gates for `settings`.
///
/// Rows that are not skipped are decoded with `model`, whose columns must be the scene's.
pub fn measure(
    experiment: &Experiment,
    model: &PreparedModel<'_>,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<GateResult, BadValue> {
    Ok(judge(GateFrames::of_scene(experiment, model, settings, progress)?, model, settings))
}

/// Puts every row of measured test frames, and of frames at rest, through gates for `settings`, which number neither of
/// them.
pub fn measure_data(
    data: &Measurements,
    model: &PreparedModel<'_>,
    settings: &Settings,
) -> Result<GateResult, BadValue> {
    Ok(judge(GateFrames::of_measurements(data, model, settings)?, model, settings))
}

fn judge(frames: GateFrames, model: &PreparedModel<'_>, settings: &Settings) -> GateResult {
    let gate = &frames.gate;
    let relative_inputs = model.model().metadata().relative_inputs;
    let model = model.clone().of_inputs();
    let decode = |readings: &Table| {
        if relative_inputs {
            model.decode_lines(&relative::inputs(readings, &gate.baseline).values)
        } else {
            model.decode_lines(&readings.values)
        }
    };
    let rest_outputs = decode(&gate.baseline);
    let ungated = decode(&frames.readings);
    let errors = |estimate: &[f64]| metrics::by_group(&frames.outputs, estimate, &frames.measure);
    let line = |k: f64| {
        let rest_tolerance = k * frames.noise_level;
        let at_rest = gate.at_rest(&frames.readings, rest_tolerance);
        let untouched_at_rest = gate.at_rest(&frames.untouched, rest_tolerance);
        let skipped = share(&at_rest);
        let sizes_mm = frames.sizes_mm.as_deref();
        let cost = |at_rest: f64| settings.frame_cycles.relative(at_rest);
        let sizes_at_rest =
            sizes_mm.unwrap_or(&[]).iter().zip(&at_rest).filter(|(_, at_rest)| **at_rest);
        Line {
            k,
            rest_tolerance,
            skipped,
            woken: 1.0 - share(&untouched_at_rest),
            woken_by_theory: gate.woken_by_theory(k, frames.baseline_frames),
            missed: sizes_mm.map_or(vec![], |sizes_mm| missed(sizes_mm, &at_rest)),
            largest_missed_mm: sizes_at_rest.map(|(size_mm, _)| *size_mm).reduce(f64::max),
            errors: errors(&gated(&ungated, &rest_outputs, &at_rest)),
            relative_cost: cost(skipped),
            relative_cost_untouched: cost(share(&untouched_at_rest)),
        }
    };
    let means = frames.outputs.means().repeat(frames.outputs.len());
    let lines = settings.k.iter().copied().map(line).collect();
    let decoders = vec![
        DecoderErrors::new(NETWORK, errors(&ungated)),
        DecoderErrors::new(mean::NAME, errors(&means)),
    ];
    GateResult {
        lines,
        decoders,
        frames: frames.outputs.len(),
        untouched_frames: frames.untouched.len(),
        subject: frames.name,
        seed: frames.seed,
        noise_level: frames.noise_level,
        rows: frames.rows,
        baseline_frames: frames.baseline_frames,
        model_crc: format!("{:08x}", model.model().crc()),
        frame_cycles: settings.frame_cycles,
        flash_frame_cycles: settings.flash_frame_cycles,
        limit: frames.limit,
    }
}

/// Touched rows that are missed, by [`MISSED_OVER_MM`].
fn missed(sizes_mm: &[f64], at_rest: &[bool]) -> Vec<Missed> {
    let over = MISSED_OVER_MM.map(|over_mm| {
        let rows = || sizes_mm.iter().zip(at_rest).filter(|(size_mm, _)| **size_mm > over_mm);
        let missed = rows().filter(|(_, at_rest)| **at_rest).count();
        Missed { over_mm, rows: rows().count(), missed }
    });
    over.to_vec()
}

/// Number of row-wires in a row of the model: all, if outputs belong to none of them.
fn rows_of_a_model_row(world: &World) -> usize {
    let rows = world.read_rows.len();
    rows / world.outputs.row_tables(rows)
}

/// Whether each session has a baseline of its own, which a gate must use. Without it, one baseline serves all.
pub(super) fn has_sessions(world: &World, relative_inputs: bool) -> bool {
    relative_inputs || world.drift.is_some()
}

/// Gate of a device, applied to tables.
pub(super) struct Gate {
    /// Baseline: the readings of all rows in Ω, on one line, or on one for each test frame.
    pub baseline: Table,
    readings: usize,
    /// Whether rows are skipped all together or not at all, as behind a projection.
    whole_array: bool,
}

impl Gate {
    /// Gate whose baseline is the mean of so many of these `frames` of the untouched sensor: one for all, or one
    /// for each of the first `sessions` test frames.
    pub fn new(
        frames: &Synthesis<'_>,
        baseline_frames: usize,
        whole_array: bool,
        sessions: Option<usize>,
    ) -> Self {
        let baseline = if let Some(sessions) = sessions {
            frames.baselines(Stream::Test, sessions, baseline_frames)
        } else {
            let at_rest = frames.clone().untouched().frames(Stream::Training, baseline_frames);
            Table { values: at_rest.inputs.means(), names: at_rest.inputs.names }
        };
        let world = frames.world();
        let readings = rows_of_a_model_row(world) * world.sensor.column_wires;
        Self { baseline, readings, whole_array }
    }

    /// Gate of measured frames of so many `rows`, with this `baseline` on one line, or on one for each test frame.
    pub fn at(baseline: Table, rows: usize, whole_array: bool) -> Self {
        Self { readings: baseline.names.len() / rows, baseline, whole_array }
    }

    /// Upper bound by [`woken_by_theory`]; the array wakes with any of its rows.
    fn woken_by_theory(&self, k: f64, baseline_frames: usize) -> f64 {
        let of_row = woken_by_theory(k, self.readings, baseline_frames);
        let rows = self.baseline.names.len() / self.readings;
        if self.whole_array { -libm::expm1(rows as f64 * libm::log1p(-of_row)) } else { of_row }
    }

    /// Whether each row of each line is untouched within the tolerance.
    pub fn at_rest(&self, readings: &Table, tolerance: f64) -> Vec<bool> {
        let tolerance = tolerance as f32;
        let baseline = to_f32(&self.baseline.values);
        let baselines = baseline.chunks_exact(self.baseline.names.len()).cycle();
        let of_line = |(line, baseline): (&[f64], &[f32])| {
            let line = to_f32(line);
            let rows = line.chunks_exact(self.readings).zip(baseline.chunks_exact(self.readings));
            let mut at_rest: Vec<bool> =
                rows.map(|(row, baseline)| is_at_rest(row, baseline, tolerance)).collect();
            if self.whole_array {
                let all = at_rest.iter().all(|at_rest| *at_rest);
                at_rest.fill(all);
            }
            at_rest
        };
        readings.lines().zip(baselines).flat_map(of_line).collect()
    }
}

/// Estimate with the outputs `rest_outputs` in the places of untouched rows.
pub(super) fn gated(ungated: &[f64], rest_outputs: &[f64], at_rest: &[bool]) -> Vec<f64> {
    let per_row = ungated.len() / at_rest.len();
    let mut estimate = ungated.to_vec();
    let rest = rest_outputs.chunks_exact(per_row).cycle();
    for ((outputs, rest), at_rest) in estimate.chunks_exact_mut(per_row).zip(rest).zip(at_rest) {
        if *at_rest {
            outputs.copy_from_slice(rest);
        }
    }
    estimate
}

/// Share of values that are true.
pub(super) fn share(of: &[bool]) -> f64 {
    of.iter().filter(|b| **b).count() as f64 / of.len() as f64
}

fn to_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn theory_is_the_normal_distributions() {
        // Q(3) = 0.001 349 898; a baseline without noise.
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        close(woken_by_theory(3.0, 0, usize::MAX), 2.0 * 0.001_349_898_031_630_1);
        close(
            woken_by_theory(3.0, 17, usize::MAX),
            1.0 - (1.0 - 0.002_699_796_063_26_f64).powi(18),
        );
        // A baseline of one frame is as noisy as a reading: the difference has √2 times the noise.
        close(woken_by_theory(3.0, 1, 1), woken_by_theory(3.0 / 2.0_f64.sqrt(), 1, usize::MAX));
    }

    #[test]
    fn rows_at_rest_take_the_outputs_at_rest() {
        let ungated = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let at_rest = [true, false, false, true];
        let expected = [-1.0, -2.0, 3.0, 4.0, 5.0, 6.0, -3.0, -4.0];
        assert_eq!(gated(&ungated, &[-1.0, -2.0, -3.0, -4.0], &at_rest), expected);
    }
}

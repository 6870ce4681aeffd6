//! Frames that gates are measured on: of a scene, or measured.

use taxel_data::rest::BASELINE_LINES;
use taxel_data::{BadValue, Progress, Rest, Stream, Table};
use taxel_learn::PreparedModel;
use taxel_limit::Refusal;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::{Synthesis, World};

use super::{Gate, Settings, check_settings, check_tolerances, has_sessions, rows_of_a_model_row};
use crate::experiment::Experiment;
use crate::measurements::Measurements;
use crate::metrics::{LimitSummary, Measure};

/// Frames of a sensor that is touched, and of the same sensor at rest.
pub(super) struct GateFrames {
    pub name: String,
    pub seed: u64,
    /// Relative noise of a reading, as a fraction.
    pub noise_level: f64,
    /// Number of frames whose mean is the baseline.
    pub baseline_frames: usize,
    pub rows: usize,
    pub gate: Gate,
    /// Readings and outputs while the sensor is touched.
    pub readings: Table,
    pub outputs: Table,
    /// Readings of the untouched sensor that the baseline does not contain.
    pub untouched: Table,
    /// Largest ‖Δ‖ in mm of each row of each touched frame, where deformations are known.
    pub sizes_mm: Option<Vec<f64>>,
    pub measure: Measure,
    pub limit: LimitSummary,
}

impl GateFrames {
    /// Test frames of a scene, and as many of the untouched sensor.
    pub fn of_scene(
        experiment: &Experiment,
        model: &PreparedModel<'_>,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Self, BadValue> {
        let world = &experiment.world;
        check_settings(world, &settings.k, settings.baseline_frames)?;
        let frames = Synthesis::new(world);
        let relative_inputs = model.model().metadata().relative_inputs;
        let sessions = has_sessions(world, relative_inputs).then_some(settings.frames);
        let whole_array = model.model().projection().is_some();
        let touched = frames.frames(Stream::Test, settings.frames);
        let (measure, limit) =
            experiment.measure_beside_limit(world.noise, settings.frames, progress);
        Ok(Self {
            name: experiment.name.clone(),
            seed: world.seed,
            noise_level: world.noise.total_level(),
            baseline_frames: settings.baseline_frames,
            rows: world.read_rows.len() / rows_of_a_model_row(world),
            gate: Gate::new(&frames, settings.baseline_frames, whole_array, sessions),
            readings: touched.inputs,
            outputs: touched.outputs,
            untouched: frames.untouched().frames(Stream::Test, settings.frames).inputs,
            sizes_mm: Some(largest_deformations_mm(world, settings.frames)),
            measure,
            limit,
        })
    }

    /// Measured test frames, and those at rest, which tell how often noise wakes a row.
    pub fn of_measurements(
        data: &Measurements,
        model: &PreparedModel<'_>,
        settings: &Settings,
    ) -> Result<Self, BadValue> {
        let rest = GateRest::new(data, &settings.k)?;
        let rows = data.test.rows;
        Ok(Self {
            name: data.name.clone(),
            seed: data.options.seed,
            noise_level: rest.noise_level,
            baseline_frames: rest.baseline_frames,
            rows,
            gate: Gate::at(rest.baseline, rows, model.model().projection().is_some()),
            readings: data.test_readings.clone(),
            outputs: data.test.outputs.clone(),
            untouched: rest.untouched,
            sizes_mm: None,
            measure: data.measure(),
            limit: LimitSummary::new(&Err(Refusal::Measured)),
        })
    }
}

/// What measured frames of the untouched sensor tell.
pub struct GateRest {
    /// Relative noise of a reading, as a fraction.
    pub noise_level: f64,
    /// Baseline of the test frames: on one line, or of a log on one for each, since a device takes a new one in each pause.
    pub(in super::super) baseline: Table,
    /// Number of frames whose mean a baseline is.
    pub(super) baseline_frames: usize,
    /// Readings that no baseline contains, as they are beside the baseline on the line of the same number.
    pub(super) untouched: Table,
}

impl GateRest {
    /// Frames of `data` at rest, which must allow gates with tolerances `k` in standard deviations of the noise.
    ///
    /// # Errors
    /// [`BadValue`] for a sensor that is not known at rest, has no noise there or readings near zero, or the first
    /// tolerance that makes no gate.
    pub fn new(data: &Measurements, k: &[f64]) -> Result<Self, BadValue> {
        let rule = "a gate compares readings with those at rest: name columns that are zero there (--rest), or give \
                    --baseline FILE, with two frames of the untouched sensor or more without a missing reading, and no \
                    channel that is zero at rest";
        let frames = data.test_rest.as_ref().map_or(0, |rest| complete(&rest.readings).len());
        let known = data.test_rest.as_ref().filter(|_| frames > 1).zip(data.noise_level());
        let Some((rest, noise_level)) = known else {
            return Err(BadValue::new("complete frames at rest", frames, rule));
        };
        if noise_level <= 0.0 {
            let rule =
                "the gate's tolerance is k times it: give frames at rest with the sensor's noise";
            return Err(BadValue::new("noise at rest", noise_level, rule));
        }
        if noise_level >= 1.0 {
            let rule = "readings are near zero at rest, so that a tolerance relative to them makes no gate: give readings \
                        from which no baseline is subtracted";
            let percent = format!("{:.0} %", 100.0 * noise_level);
            return Err(BadValue::new("noise relative to the readings at rest", percent, rule));
        }
        check_tolerances(noise_level, k)?;
        Ok(match &rest.lines {
            Some(lines) => Self::of_log(rest, lines, data, noise_level),
            None => Self::of_file(&complete(&rest.readings), noise_level),
        })
    }

    /// The first half of the frames makes the baseline.
    fn of_file(rest: &Table, noise_level: f64) -> Self {
        let baseline_frames = rest.len() / 2;
        let all: Vec<usize> = (0..rest.names.len()).collect();
        let part = |from: usize, to: usize| rest.part(&(from..to).collect::<Vec<_>>(), &all);
        let baseline = part(0, baseline_frames).mean_line();
        Self {
            noise_level,
            baseline,
            baseline_frames,
            untouched: part(baseline_frames, rest.len()),
        }
    }

    /// Each line has the baseline of the pauses before it. Lines that are in the first baseline do not count as untouched.
    fn of_log(rest: &Rest, lines: &[usize], data: &Measurements, noise_level: f64) -> Self {
        let baseline = rest.baselines(&data.test_log.lines);
        let baseline_frames = BASELINE_LINES.min(lines.len() / 2);
        let later: Vec<usize> = (baseline_frames..lines.len()).collect();
        let all: Vec<usize> = (0..rest.readings.names.len()).collect();
        let own = rest.baselines(&later.iter().map(|at| lines[*at]).collect::<Vec<_>>());
        // Each by its own baseline, and times the one that it is compared with.
        let mut untouched = rest.readings.part(&later, &all);
        let beside = untouched.values.iter_mut().zip(&own.values);
        for ((value, own), shown) in beside.zip(baseline.values.iter().cycle()) {
            *value *= shown / own;
        }
        Self { noise_level, baseline, baseline_frames, untouched }
    }
}

/// Lines of `table` without a missing value.
fn complete(table: &Table) -> Table {
    let lines = table.lines().filter(|line| !line.iter().any(|value| value.is_nan()));
    Table { names: table.names.clone(), values: lines.flatten().copied().collect() }
}

/// Largest ‖Δ‖ in mm of each row of each test frame, whatever the world's outputs are.
fn largest_deformations_mm(world: &World, frames: usize) -> Vec<f64> {
    let synthesis = Synthesis::new(world).ideal().outputs(Outputs::all_deformations());
    let deformations_mm = synthesis.frames(Stream::Test, frames).outputs.values;
    let length = |delta: &[f64]| delta.iter().map(|d| d * d).sum::<f64>().sqrt();
    deformations_mm
        .chunks_exact(3 * world.sensor.electrodes_per_row_wire * rows_of_a_model_row(world))
        .map(|row| row.chunks_exact(3).map(length).fold(0.0, f64::max))
        .collect()
}

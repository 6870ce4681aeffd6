//! Moving contacts that points are judged by, and the settings of a filter in time for each of them.

use std::sync::{Arc, Mutex, PoisonError};

use model_core::filter::Settings;
use taxel_data::dataset::Dataset;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_data::{BadValue, columns};
use taxel_learn::PreparedModel;
use taxel_learn::filtered::{Movement, settings_for};
use taxel_simulate::Synthesis;
use taxel_simulate::path::Path;

use super::device::Times;
use crate::experiment::Experiment;
use crate::metrics::{self, Errors, Measure};
use crate::moving::Moving;

/// Trajectories on which a decoder's noise is measured.
const FEW_TRAJECTORIES: usize = 8;
/// Moments over which movement is measured to begin with: 5 ms.
const USUAL_MOMENTS: usize = 5;

/// Moving contacts of a scene, with one number of samples a reading.
pub struct Touches<'s> {
    scene: &'s Experiment,
    synthesis: Synthesis<'s>,
    path: Path,
    /// Group of outputs for whose errors filters are set.
    group: String,
    /// Frames of the period that was asked for last.
    last: Mutex<Option<Arc<OfPeriod>>>,
}

/// Frames of one period, and what setting a filter needs to know of them.
pub struct OfPeriod {
    pub moving: Moving,
    scan_ms: f64,
    period_ms: f64,
    /// Frames of the first trajectories without noise.
    ideal: Dataset,
    /// Weight of each output's square; 0 for outputs of other groups.
    weights: Vec<f64>,
}

impl<'s> Touches<'s> {
    /// Contacts of `scene` along `path`, from a `synthesis` of its world. Filters are set for the errors of `group`.
    pub fn new(scene: &'s Experiment, synthesis: Synthesis<'s>, path: Path, group: &str) -> Self {
        Self { scene, synthesis, path, group: group.into(), last: Mutex::new(None) }
    }

    /// Frames of a device that scans and decodes in these `times`. Their period is rounded up to two digits, so that decoders
    /// that take about as long share their frames.
    ///
    /// # Errors
    /// [`BadValue`] for times that [`Moving::new`] refuses.
    pub fn at(&self, times: &Times) -> Result<Arc<OfPeriod>, BadValue> {
        self.of(times.scan_ms.unwrap_or_default(), times.period_ms())
    }

    /// Frames of a device whose decoding takes no time.
    ///
    /// # Errors
    /// As [`at`](Self::at).
    pub fn while_scanned(&self, scan_ms: Option<f64>) -> Result<Arc<OfPeriod>, BadValue> {
        self.of(scan_ms.unwrap_or_default(), scan_ms.unwrap_or_default())
    }

    fn of(&self, scan_ms: f64, period_ms: f64) -> Result<Arc<OfPeriod>, BadValue> {
        let digit = 10_f64.powf(period_ms.log10().floor() - 1.0);
        let period_ms = (period_ms / digit - 1e-9).ceil() * digit;
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(same) = last.as_ref().filter(|last| last.period_ms == period_ms) {
            return Ok(Arc::clone(same));
        }
        let found = Arc::new(OfPeriod::new(self, scan_ms, period_ms)?);
        *last = Some(Arc::clone(&found));
        Ok(found)
    }
}

impl OfPeriod {
    fn new(touches: &Touches<'_>, scan_ms: f64, period_ms: f64) -> Result<Self, BadValue> {
        let Touches { scene, synthesis, path, group, .. } = touches;
        let moving = Moving::new(scene, synthesis, *path, [scan_ms, period_ms])?;
        let few = path.trajectories.min(FEW_TRAJECTORIES) * moving.timetable.scans();
        let ideal = synthesis.clone().ideal().along(*path, moving.timetable.clone());
        let ideal = scene.dataset(&ideal, Stream::Test, few);
        let weights = weights(&moving.truth, group);
        Ok(Self { moving, scan_ms, period_ms, ideal, weights })
    }

    /// Settings of a filter behind `model`, whose `estimates` are those of all frames: those of least expected error by the
    /// [rule](taxel_learn::filtered#rule). The model's noise is what noise on the readings adds to its estimates.
    pub fn filter_settings(
        &self,
        model: &PreparedModel<'_>,
        estimates: &[f64],
        age_ms: f64,
    ) -> Settings {
        let without = model.decode_lines(&self.ideal.inputs.values);
        let outputs = self.weights.len();
        let of_noise: Vec<f64> = without.iter().zip(estimates).map(|(a, b)| b - a).collect();
        // Steps from frame to frame: what is the same in both is no white noise, and no filter lowers it. White noise's
        // steps have twice its variance.
        let of_trajectories = of_noise.chunks_exact(outputs * self.moving.timetable.scans());
        let steps = of_trajectories.flat_map(|of| {
            of.iter().zip(&of[outputs..]).map(|(before, after)| after - before).collect::<Vec<_>>()
        });
        let noise = (0.5 * weighted_mean_square(steps, &self.weights)).sqrt();
        let settings = |moments: usize| {
            let movement = self.movement(moments);
            settings_for(noise, movement, 1000.0 * self.period_ms, 1000.0 * age_ms)
        };
        // The movement over about the time constant that it leads to.
        let usual = settings(USUAL_MOMENTS);
        let moments = f64::from(usual.time_constant_us) / 1e6 / self.step_s();
        settings((moments.round() as usize).clamp(1, self.moving.moments_s.len() / 4))
    }

    /// Time between two moments at which the truth is known.
    fn step_s(&self) -> f64 {
        self.moving.moments_s[1] - self.moving.moments_s[0]
    }

    /// Movement of the true outputs, by differences over so many `moments`.
    fn movement(&self, moments: usize) -> Movement {
        let outputs = self.weights.len();
        let (over, step_s) = (outputs * moments, self.step_s() * moments as f64);
        let of_trajectories =
            || self.moving.truth.values.chunks_exact(outputs * self.moving.moments_s.len());
        let first = of_trajectories().flat_map(|of| {
            of.iter().zip(&of[over..]).map(|(a, b)| (b - a) / step_s).collect::<Vec<_>>()
        });
        let second = of_trajectories().flat_map(|of| {
            let three = of.iter().zip(&of[over..]).zip(&of[2 * over..]);
            three.map(|((a, b), c)| (a - 2.0 * b + c) / (step_s * step_s)).collect::<Vec<_>>()
        });
        let [rate_per_s, acceleration_per_s2] = [
            weighted_mean_square(first, &self.weights),
            weighted_mean_square(second, &self.weights),
        ]
        .map(f64::sqrt);
        Movement { rate_per_s, acceleration_per_s2 }
    }

    /// Errors of the `estimates` of all frames, or of what a filter with these `settings` makes of them.
    pub fn errors(
        &self,
        estimates: &[f64],
        settings: Settings,
        times: &Times,
        measure: &Measure,
    ) -> Vec<Errors> {
        let finished_ms = times.frame_ms;
        if !settings.is_on() {
            return self.moving.errors(estimates, finished_ms, measure);
        }
        self.moving.errors(&self.moving.filtered(estimates, settings), finished_ms, measure)
    }

    /// Errors of the `estimates` of a decoder that takes no time.
    pub fn errors_at_once(&self, estimates: &[f64], measure: &Measure) -> Vec<Errors> {
        self.moving.errors(estimates, self.scan_ms, measure)
    }
}

/// Weight of each output's square: 1 for those of `group`, 0 for others; for all groups one over each output's variance.
fn weights(truth: &Table, group: &str) -> Vec<f64> {
    if group == metrics::ALL {
        let deviations = truth.deviations();
        return deviations.iter().map(|it| if *it > 0.0 { it.powi(-2) } else { 0.0 }).collect();
    }
    let of_group = |name: &String| f64::from(u8::from(columns::group_of(name) == group));
    truth.names.iter().map(of_group).collect()
}

/// Weighted mean square of `values`, which are those of one output after the other; NaN does not count.
fn weighted_mean_square(values: impl Iterator<Item = f64>, weights: &[f64]) -> f64 {
    let weighted = values.zip(weights.iter().cycle()).filter(|(value, _)| !value.is_nan());
    let (sum, weight) = weighted.fold((0.0, 0.0), |(sum, all), (value, weight)| {
        (sum + weight * value * value, all + weight)
    });
    if weight > 0.0 { sum / weight } else { 0.0 }
}

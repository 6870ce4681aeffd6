//! Moving contacts that points are judged by, and the settings of a filter in time for each of them.

use std::sync::{Arc, Mutex, PoisonError};

use taxel_core::filter::Settings;
use taxel_data::columns;
use taxel_data::dataset::Dataset;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::cost::Cost;
use taxel_learn::filtered::{Movement, settings_for};
use taxel_learn::{Decoder, ModelBlob, PreparedModel, Tracked};
use taxel_limit::{Reference, Refusal};
use taxel_simulate::Synthesis;
use taxel_simulate::path::Path;

use crate::device::{Device, Times};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::metrics::{self, Blocks, DecoderErrors, Errors, Measure};
use crate::moving::{GRID_S, Moving};

/// Trajectories on which a decoder's noise is measured.
const FEW_TRAJECTORIES: usize = 8;
/// Time in s over which movement is measured to begin with.
const USUAL_S: f64 = 0.005;
/// Step of the logarithms of periods whose frames are made.
const PERIOD_STEP: f64 = 0.02;

/// Moving contacts of a scene, with one number of samples a reading.
pub struct Touches<'s> {
    scene: &'s Experiment,
    synthesis: Synthesis<'s>,
    path: Path,
    /// Number of passes over the rows that a scan consists of.
    passes: usize,
    /// Group of outputs for whose errors filters are set.
    group: String,
    /// Frames of the two periods that were asked for last: one without a filter, and one with it.
    last: Mutex<Vec<Arc<OfPeriod>>>,
}

/// A model on moving contacts.
pub struct Touched {
    /// Frames as they come where a filter works behind it.
    pub of_period: Arc<OfPeriod>,
    /// Its estimates of all these frames, and what the filter makes of them.
    pub estimates: Vec<f64>,
    pub filtered: Vec<f64>,
    /// Without a filter, behind one, and behind the model's tracker if it has one.
    pub ways: Vec<Way>,
}

/// One way to decode moving contacts.
pub struct Way {
    pub filter: Settings,
    /// Whether the model's tracker stands behind it, in place of a filter.
    pub is_tracked: bool,
    pub cost: Cost,
    pub times: Times,
    pub errors: Vec<Errors>,
    pub blocks: Blocks,
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
    /// Contacts of `scene` along `path`, from a `synthesis` of its world, in scans of so many `passes`. Filters are set for the
    /// errors of `group`.
    pub fn new(
        scene: &'s Experiment,
        synthesis: Synthesis<'s>,
        (path, passes): (Path, usize),
        group: &str,
    ) -> Self {
        Self { scene, synthesis, path, passes, group: group.into(), last: Mutex::default() }
    }

    /// Errors of the model in `blob` as a `device` runs it that scans in `scan_ms`: without a filter in time, behind one, and
    /// behind its tracker.
    /// Its decoding has this `cost`.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for times that [`Moving::new`] refuses.
    pub fn judge(
        &self,
        (blob, model): (&ModelBlob, &PreparedModel<'_>),
        cost: Cost,
        (device, scan_ms): (&Device, Option<f64>),
        measure: &Measure,
    ) -> Result<Touched> {
        let behind_filter = cost.plus(Cost::of_filter(blob.parse().shape()));
        let [times, filter_times] = [cost, behind_filter].map(|cost| device.times(scan_ms, &cost));
        let decode =
            |of_period: &OfPeriod| model.decode_lines(&of_period.moving.frames.inputs.values);
        let of_period = self.at(&times)?;
        let estimates = decode(&of_period);
        let (errors, blocks) = of_period.moving.errors(&estimates, times.frame_ms, measure);
        let filter = Settings::default();
        let plain = Way { filter, is_tracked: false, cost, times, errors, blocks };
        let tracked = self.tracked((blob, model), (device, scan_ms), measure)?;
        // Behind a filter frames take longer, if only a little.
        let slower = self.at(&filter_times)?;
        let estimates = if Arc::ptr_eq(&slower, &of_period) { estimates } else { decode(&slower) };
        let age_ms = filter_times.age_ms.unwrap_or_default();
        let filter = slower.filter_settings(model, &estimates, age_ms);
        let filtered = slower.moving.filtered(&estimates, filter);
        let (errors, blocks) = slower.moving.errors(&filtered, filter_times.frame_ms, measure);
        let (cost, times) = (behind_filter, filter_times);
        let behind = Way { filter, is_tracked: false, cost, times, errors, blocks };
        let ways = [plain, behind].into_iter().chain(tracked).collect();
        Ok(Touched { of_period: slower, estimates, filtered, ways })
    }

    /// Errors of the model behind its tracker; `None` if it has none. Outputs are those expected in the middle of the time for
    /// which an estimate is held.
    fn tracked(
        &self,
        (blob, model): (&ModelBlob, &PreparedModel<'_>),
        (device, scan_ms): (&Device, Option<f64>),
        measure: &Measure,
    ) -> Result<Option<Way>> {
        let parsed = blob.parse();
        let Some(tracker) = parsed.tracker() else { return Ok(None) };
        // The network decodes a frame at a start alone.
        let cost = Cost::of_tracker(tracker.sizes());
        let times = device.times(scan_ms, &cost);
        let of_period = self.at(&times)?;
        let ahead_ms = times.frame_ms + 0.5 * of_period.period_ms;
        let decoder = Tracked::new(model.clone(), tracker, None, (1000.0 * ahead_ms) as f32);
        let estimates = of_period.moving.decoded(&decoder);
        let (errors, blocks) = of_period.moving.errors(&estimates, times.frame_ms, measure);
        let filter = Settings::default();
        Ok(Some(Way { filter, is_tracked: true, cost, times, errors, blocks }))
    }

    /// Frames of a device that scans and decodes in these `times`. Their period is rounded up, by a fiftieth at most, so that
    /// decoders that take about as long share their frames.
    fn at(&self, times: &Times) -> Result<Arc<OfPeriod>> {
        self.of(times.scan_ms.unwrap_or_default(), times.period_ms())
    }

    /// Errors of a `decoder` that takes no time, behind scans that take `scan_ms`.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for times that [`Moving::new`] refuses.
    pub fn judge_at_once(
        &self,
        decoder: &dyn Decoder,
        scan_ms: Option<f64>,
        measure: &Measure,
    ) -> Result<DecoderErrors> {
        let scan_ms = scan_ms.unwrap_or_default();
        let scanned = self.of(scan_ms, scan_ms)?;
        let estimates = decoder.decode_all(&scanned.moving.frames.inputs.values, 1);
        let (errors, _) = scanned.moving.errors(&estimates.values, scanned.scan_ms, measure);
        Ok(DecoderErrors::new(decoder.name(), errors))
    }

    /// Limit at a moment of each of so many trajectories, from all scans of `scan_ms` that are finished by then: one after the
    /// other. It takes no time.
    ///
    /// # Errors
    /// [`Refusal`] for contacts that are not modelled, and if the sample does not carry the figures.
    pub fn limit(
        &self,
        scan_ms: Option<f64>,
        trajectories: Option<usize>,
    ) -> std::result::Result<Reference, Refusal> {
        /// Golden section, by whose multiples moments are spread evenly.
        const SECTION: f64 = 0.618_033_988_749_895;
        let (scan_ms, trajectories) =
            (scan_ms.unwrap_or_default(), trajectories.ok_or(Refusal::Moving)?);
        let scanned = self.of(scan_ms, scan_ms);
        let scanned = scanned.map_err(|_| Refusal::MovingWith("such a scan"))?;
        let Moving { timetable, moments_s, .. } = &scanned.moving;
        let moments = (0..trajectories).map(|number| {
            let share = ((number as f64 + 0.5) * SECTION).fract();
            moments_s[(share * moments_s.len() as f64) as usize]
        });
        let moments: Vec<f64> = moments.collect();
        Reference::moving(&self.scene.world, (timetable, scan_ms / 1000.0), &moments)
    }

    fn of(&self, scan_ms: f64, period_ms: f64) -> Result<Arc<OfPeriod>> {
        let period_ms = ((period_ms.ln() / PERIOD_STEP - 1e-9).ceil() * PERIOD_STEP).exp();
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(same) = last.iter().find(|last| last.period_ms == period_ms) {
            return Ok(Arc::clone(same));
        }
        let found = Arc::new(OfPeriod::new(self, scan_ms, period_ms)?);
        last.insert(0, Arc::clone(&found));
        last.truncate(2);
        Ok(found)
    }
}

impl OfPeriod {
    fn new(touches: &Touches<'_>, scan_ms: f64, period_ms: f64) -> Result<Self> {
        let Touches { scene, synthesis, path, passes, group, .. } = touches;
        let moving = Moving::new(scene, synthesis, *path, ([scan_ms, period_ms], *passes))?;
        let few = path.trajectories.min(FEW_TRAJECTORIES) * moving.timetable.scans();
        let ideal = synthesis.clone().ideal().along(*path, moving.timetable.clone());
        let ideal = scene.dataset(&ideal, Stream::Test, few);
        let weights = weights(&moving.truth, group);
        Ok(Self { moving, scan_ms, period_ms, ideal, weights })
    }

    /// Settings of a filter behind `model`, whose `estimates` are those of all frames: those of least expected error by the
    /// [rule](taxel_learn::filtered#rule). The model's noise is what noise on the readings adds to its estimates.
    fn filter_settings(
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
        let settings = |over_s: f64| {
            let moments = (over_s / GRID_S).round() as usize;
            let moments = moments.clamp(1, self.moving.moments_s.len() / 4);
            let movement = self.movement(moments);
            settings_for(noise, movement, 1000.0 * self.period_ms, 1000.0 * age_ms)
        };
        // The movement over about the time constant that it leads to.
        let usual = settings(USUAL_S);
        settings(f64::from(usual.time_constant_us) / 1e6)
    }

    /// Movement of the true outputs, by differences over so many `moments`.
    fn movement(&self, moments: usize) -> Movement {
        let outputs = self.weights.len();
        let (over, step_s) = (outputs * moments, GRID_S * moments as f64);
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

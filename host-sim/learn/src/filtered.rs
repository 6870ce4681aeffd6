//! Decoders behind a filter in time, bit for bit as a device filters, and the rule for its settings.
//!
//! # Rule
//!
//! An output with white noise of standard deviation σ, rate v and acceleration a is read each dt, extrapolated by the lead
//! L, and used when it is A old. Behind a [filter](taxel_core::filter) with θ = e^(−dt/τ), value and rate have these variances, and the estimate
//! lags behind the truth (Brookner, Tracking and Kalman Filtering Made Easy, 1998, ch. 1):
//!
//! - value: σ²·(1 − θ)·(1 + 4θ + 5θ²)/(1 + θ)³; rate: σ²·2(1 − θ)³/(1 + θ)³/dt²; both together:
//!   σ²·(1 − θ)²·(1 + 3θ)/(1 + θ)³/dt;
//! - lag of the value: a·dt²·θ²/(1 − θ)²; of the rate: a·dt·(1 + 3θ)/(2(1 − θ)); of a line that goes on for A: a·A²/2;
//! - what a lead shorter than A leaves out: v·(A − L).
//!
//! [`settings_for`] takes the τ and L with the least sum of variance and squares. Of an output that is used at once, and for a
//! τ far above dt, the sum is σ²·1.25·dt/τ + a²·τ⁴. It is least at τ = (0.3125·σ²·dt/a²)^(1/5).

use taxel_core::filter::{Settings, State, Track};
use taxel_core::{Estimate, RowStatus};

use crate::decoder::{Estimates, FrameDecoder, Frames};

/// Decoder whose outputs are filtered in time, as a device does. Deviations and novelty stay those of each frame.
///
/// Outputs are rounded to f32. A frame whose time is not known starts the filter anew, so that it is not filtered.
///
/// ```
/// use taxel_core::filter::Settings;
/// use taxel_data::random::Stream;
/// use taxel_learn::{Decoder, Filtered, Frames, Options, Origin, Timing, pack, train::train};
/// use taxel_simulate::{World, synthesise};
///
/// let world = World { read_rows: vec![3], ..World::press() }; // one row-wire
/// let frames = synthesise(&world, Stream::Training, 500);
/// let trained = train(&frames, &Options { centres: 8, ..Options::default() }, &taxel_data::progress::Silent)?;
/// let blob = pack(&trained, &frames, &Origin::of_data("row 4", 0, 1, &frames))?;
/// let settings = Settings { time_constant_us: 5000, lead_us: 2000 };
/// let filtered = Filtered::new(blob.prepare(), settings);
///
/// let start_us: Vec<u64> = (0..500).map(|frame| 1000 * frame).collect();
/// let timing = Timing { start_us: &start_us, reading_offset_us: &[] }; // when each reading is taken: not needed here
/// let frames = Frames { readings: &frames.inputs.values, timing: Some(timing) };
/// let estimates = filtered.decode_frames(frames, 500); // one trajectory
/// assert_eq!(estimates.values.len(), 500 * 18);
/// # Ok::<(), taxel_learn::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Filtered<D> {
    decoder: D,
    settings: Settings,
    name: String,
}

impl<D: FrameDecoder> Filtered<D> {
    /// Filter with these `settings` behind `decoder`.
    pub fn new(decoder: D, settings: Settings) -> Self {
        let name = format!("{}, filtered", decoder.name());
        Self { decoder, settings, name }
    }
}

impl<D: FrameDecoder> FrameDecoder for Filtered<D> {
    /// State of the decoder, and that of the filter once there was a frame.
    type State = (D::State, Option<State<Vec<Track>>>);

    fn name(&self) -> &str {
        &self.name
    }

    fn inputs(&self) -> usize {
        self.decoder.inputs()
    }

    fn decode(&self, (state, filter): &mut Self::State, frames: Frames<'_>) -> Estimates {
        let mut estimates = self.decoder.decode(state, frames);
        let Some(timing) = frames.timing else {
            *filter = None;
            return estimates;
        };
        let outputs = estimates.values.len().checked_div(timing.start_us.len()).unwrap_or(0);
        let filter = filter.get_or_insert_with(|| State::new(vec![[0.0; 2]; outputs]));
        filter_frames(filter, self.settings, timing.start_us, &mut estimates.values);
        estimates
    }
}

/// Filters `values`, which are the outputs of frames that began at these times. Outputs that are NaN are not decoded.
pub fn filter_frames(
    filter: &mut State<Vec<Track>>,
    settings: Settings,
    start_us: &[u64],
    values: &mut [f64],
) {
    let outputs = values.len().checked_div(start_us.len()).unwrap_or(0).max(1);
    for (frame, start_us) in values.chunks_exact_mut(outputs).zip(start_us) {
        let mut filtered: Vec<f32> = frame.iter().map(|value| *value as f32).collect();
        // Each output is a row of its own: a device's rows are decoded with all of their outputs or none.
        let status = |value: &f32| {
            if value.is_nan() { RowStatus::MissingReading } else { RowStatus::Decoded }
        };
        let mut status: Vec<RowStatus> = filtered.iter().map(status).collect();
        let mut estimate = Estimate { outputs: &mut filtered, status: &mut status };
        filter.filter(settings, *start_us, &mut estimate);
        frame.iter_mut().zip(filtered).for_each(|(value, filtered)| *value = f64::from(filtered));
    }
}

/// How fast an output changes, as root mean squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Movement {
    /// Change in a second.
    pub rate_per_s: f64,
    /// Change of that rate in a second. What a filter sees is the change over about its time constant: where a contact ends,
    /// the rate jumps, and any shorter time would give a larger number.
    pub acceleration_per_s2: f64,
}

/// Leads that are tried, from 0 to the age.
const LEADS: u32 = 16;

/// Settings of least expected error for an output with white noise of standard deviation `noise`, and this `movement`, which
/// is read each `period_us` and used when it is `age_us` old: see the [rule](self#rule).
///
/// # Panics
/// If a number is negative or not finite, or the period is 0.
pub fn settings_for(noise: f64, movement: Movement, period_us: f64, age_us: f64) -> Settings {
    let Movement { rate_per_s, acceleration_per_s2 } = movement;
    let numbers = [noise, rate_per_s, acceleration_per_s2, period_us, age_us];
    let are_good = numbers.iter().all(|number| number.is_finite() && *number >= 0.0);
    assert!(are_good && period_us > 0.0, "noise, movement, period and age: {numbers:?}");
    let of_lead = |step: u32| {
        let lead_us = age_us * f64::from(step) / f64::from(LEADS);
        let (time_constant_us, squared) =
            time_constant_for([noise, acceleration_per_s2], period_us, [lead_us, age_us]);
        let moved = rate_per_s * (age_us - lead_us) * 1e-6;
        (squared + moved * moved, [time_constant_us, lead_us])
    };
    let best = (0..=LEADS).map(of_lead).min_by(|(a, _), (b, _)| a.total_cmp(b));
    let [time_constant_us, lead_us] = best.map_or([0.0; 2], |(_, settings)| settings);
    let whole = |us: f64| us.round().clamp(0.0, f64::from(Settings::MOST_US)) as u32;
    Settings { time_constant_us: whole(time_constant_us).max(1), lead_us: whole(lead_us) }
}

/// Time constant in µs of least expected squared error with this lead, for an output that is used at this age, and that error.
pub fn time_constant_for(
    of_output: [f64; 2],
    period_us: f64,
    [lead_us, age_us]: [f64; 2],
) -> (f64, f64) {
    let times_s = [period_us, lead_us, age_us].map(|us| us * 1e-6);
    let error = |log_us: f64| squared_error(of_output, log_us.exp() * 1e-6, times_s);
    // A sum of powers of τ has one minimum over its logarithm: golden sections of that. A filter starts anew after ten time
    // constants: a fifth of a period leaves room for one frame that is lost.
    let (mut low, mut high) = ((period_us / 5.0).ln(), f64::from(Settings::MOST_US).ln());
    while high - low > 1e-9 {
        let third = (high - low) * 0.381_966;
        if error(low + third) <= error(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    (low.exp(), error(low))
}

/// Expected squared error of an output that does not move but accelerates, behind a filter with the time constant `tau_s`; see
/// the [rule](self#rule).
fn squared_error(
    [noise, acceleration]: [f64; 2],
    tau_s: f64,
    [dt_s, lead_s, age_s]: [f64; 3],
) -> f64 {
    let theta = (-dt_s / tau_s).exp();
    let rest = -(-dt_s / tau_s).exp_m1();
    let variance = rest * (1.0 + 4.0 * theta + 5.0 * theta * theta)
        + 2.0 * lead_s / dt_s * rest * rest * (1.0 + 3.0 * theta)
        + (lead_s / dt_s).powi(2) * 2.0 * rest.powi(3);
    let lag = (dt_s * theta / rest).powi(2)
        + lead_s * dt_s * (1.0 + 3.0 * theta) / (2.0 * rest)
        + age_s * age_s / 2.0;
    noise * noise * variance / (1.0 + theta).powi(3) + (acceleration * lag).powi(2)
}

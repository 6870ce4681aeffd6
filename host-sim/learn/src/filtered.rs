//! Decoders behind a filter in time, bit for bit as a device filters, and the rule for its settings.
//!
//! # Rule
//!
//! An output with white noise of standard deviation σ and acceleration a is read each dt, and extrapolated by the lead
//! L. Behind a [filter](model_core::filter) with θ = e^(−dt/τ), value and rate have these variances, and the estimate
//! lags behind the truth (Brookner, Tracking and Kalman Filtering Made Easy, 1998, ch. 1):
//!
//! - value: σ²·(1 − θ)·(1 + 4θ + 5θ²)/(1 + θ)³; rate: σ²·2(1 − θ)³/(1 + θ)³/dt²; both together:
//!   σ²·(1 − θ)²·(1 + 3θ)/(1 + θ)³/dt;
//! - lag of the value: a·dt²·θ²/(1 − θ)²; of the rate: a·dt·(1 + 3θ)/(2(1 − θ)); of a line that goes on for L: a·L²/2.
//!
//! [`settings_for`] takes the τ with the least sum of variance and squared lag. Without a lead, and for a τ far above dt,
//! the sum is σ²·1.25·dt/τ + a²·τ⁴. It is least at τ = (0.3125·σ²·dt/a²)^(1/5).

use model_core::filter::{Settings, State, Track};
use model_core::{Estimate, RowStatus};

use crate::decoder::{Estimates, FrameDecoder, Frames};

/// Decoder whose outputs are filtered in time, as a device does. Deviations and novelty stay those of each frame.
///
/// Outputs are rounded to f32. A frame whose time is not known starts the filter anew, so that it is not filtered.
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

/// Mean age of an estimate in µs when it is used: from the middle of its scan until the middle of the period for which it
/// is the newest. It is the lead that a filter needs.
///
/// Readings are taken half a scan after its start in the mean. The estimate is there when the scan and its decoding have
/// ended, and the next one comes a period later.
pub fn mean_age_us(scan_us: f64, decode_us: f64, period_us: f64) -> f64 {
    scan_us / 2.0 + decode_us + period_us / 2.0
}

/// Settings of least expected error for an output with white noise of standard deviation `noise`, and accelerations of
/// this root mean square (the output's unit per s²), which is read each `period_us` and extrapolated by `lead_us`.
///
/// # Panics
/// If a number is negative or not finite, or the period is 0.
pub fn settings_for(noise: f64, acceleration: f64, period_us: f64, lead_us: f64) -> Settings {
    let numbers = [noise, acceleration, period_us, lead_us];
    let are_good = numbers.iter().all(|number| number.is_finite() && *number >= 0.0);
    assert!(are_good && period_us > 0.0, "noise, acceleration, period and lead: {numbers:?}");
    let most_us = f64::from(Settings::MOST_US);
    let error = |log_us: f64| {
        squared_error([noise, acceleration], log_us.exp() * 1e-6, period_us * 1e-6, lead_us * 1e-6)
    };
    // A sum of powers of τ has one minimum over its logarithm: golden sections of that.
    let (mut low, mut high) = ((period_us / 10.0).ln(), most_us.ln());
    while high - low > 1e-9 {
        let third = (high - low) * 0.381_966;
        if error(low + third) <= error(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    let whole = |us: f64| us.round().clamp(0.0, most_us) as u32;
    Settings { time_constant_us: whole(low.exp()).max(1), lead_us: whole(lead_us) }
}

/// Expected squared error of an output behind a filter with the time constant `tau_s`; see the [rule](self#rule).
fn squared_error([noise, acceleration]: [f64; 2], tau_s: f64, dt_s: f64, lead_s: f64) -> f64 {
    let theta = (-dt_s / tau_s).exp();
    let rest = -(-dt_s / tau_s).exp_m1();
    let variance = rest * (1.0 + 4.0 * theta + 5.0 * theta * theta)
        + 2.0 * lead_s / dt_s * rest * rest * (1.0 + 3.0 * theta)
        + (lead_s / dt_s).powi(2) * 2.0 * rest.powi(3);
    let lag = (dt_s * theta / rest).powi(2)
        + lead_s * dt_s * (1.0 + 3.0 * theta) / (2.0 * rest)
        + lead_s * lead_s / 2.0;
    noise * noise * variance / (1.0 + theta).powi(3) + (acceleration * lag).powi(2)
}

#[cfg(test)]
mod tests;

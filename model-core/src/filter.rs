//! Filter in time: an α–β filter (constant velocity) on each output of successive estimates.
//!
//! Each output has a value y and a rate v. A frame that comes dt after the one before, and is decoded to x, predicts
//! y + v·dt, and corrects by the innovation e = x − (y + v·dt):
//!
//! y ← y + v·dt + α·e, v ← v + β·e/dt, with α = 1 − θ² and β = (1 − θ)², θ = e^(−dt/τ).
//!
//! This is the *critically damped g–h filter*, or fading-memory filter of first degree (Brookner, Tracking and Kalman
//! Filtering Made Easy, 1998, ch. 1): the newest point of the line that fits the past best, where a frame of age t has the
//! weight e^(−t/τ). It follows a ramp without lag. Kalata (The tracking index, IEEE Transactions on Aerospace and
//! Electronic Systems 20, 1984) relates α and β to the ratio of acceleration and noise.
//!
//! The output is y + v·*lead*: what is expected so much later.
//! dt comes from the frames' times, not from an assumed period. `docs/rate.md` explains it.

use crate::estimate::{Estimate, RowStatus};
use crate::exp::exp;

/// Settings of the filter. The default is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// Time constant τ in µs, at most [`MOST_US`](Self::MOST_US); with 0, outputs are not filtered.
    pub time_constant_us: u32,
    /// Time in µs by which outputs are extrapolated, at most [`MOST_US`](Self::MOST_US).
    pub lead_us: u32,
}

impl Settings {
    /// Longest time constant and lead in µs. With it, coefficients have an error of 0.1 % at a frame each 0.1 ms (tested).
    pub const MOST_US: u32 = 1_000_000;
    /// Number of time constants after which a gap starts the filter anew.
    pub const MOST_TIME_CONSTANTS: u32 = 10;

    /// Whether outputs are filtered.
    pub fn is_on(self) -> bool {
        self.time_constant_us > 0
    }

    /// Coefficients for a frame that comes `gap_us` after the one before; `None` if no time has passed, or too much.
    fn step(self, gap_us: u64) -> Option<Step> {
        let tau_us = self.time_constant_us.min(Self::MOST_US);
        let gap_us = u32::try_from(gap_us).ok()?;
        if gap_us == 0 || gap_us > Self::MOST_TIME_CONSTANTS * tau_us {
            return None;
        }
        let theta = exp(-(gap_us as f32 / tau_us as f32));
        let (rest, dt_s) = (1.0 - theta, gap_us as f32 * 1e-6);
        Some(Step { dt_s, alpha: rest * (1.0 + theta), beta_per_s: rest * rest / dt_s })
    }
}

/// Coefficients of one step.
#[derive(Debug, Clone, Copy)]
struct Step {
    dt_s: f32,
    alpha: f32,
    beta_per_s: f32,
}

/// Value of an output, and its rate a second.
pub type Track = [f32; 2];

/// State of the filter: a [`Track`] for each output in `M`, and the time of the last frame.
///
/// ```
/// use taxel_core::filter::{Settings, State};
/// use taxel_core::{Estimate, RowStatus};
/// let settings = Settings { time_constant_us: 5000, lead_us: 1000 };
/// let mut state = State::new([[0.0; 2]]); // one output
/// let mut filtered = |start_us, mm| {
///     let (mut outputs, mut status) = ([mm], [RowStatus::Decoded]);
///     let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
///     state.filter(settings, start_us, &mut estimate);
///     outputs[0]
/// };
/// assert_eq!(filtered(0, 0.5), 0.5); // the first frame as it is
/// let second = filtered(1000, 0.6);
/// assert!(second > 0.5 && second < 0.6);
/// assert_eq!(filtered(1000, 0.7), second); // a frame of the same time changes nothing
/// for frame in 2..200 {
///     filtered(1000 * frame, 0.01 * frame as f32); // 10 mm/s
/// }
/// assert!((filtered(200_000, 2.0) - 2.01).abs() < 1e-4); // no lag, 1 ms ahead
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State<M> {
    tracks: M,
    /// Start of the last frame in µs; `None` before the first one.
    last_us: Option<u64>,
}

impl<M: AsMut<[Track]>> State<M> {
    /// Makes a state with room for as many outputs as there are `tracks`.
    pub const fn new(tracks: M) -> Self {
        Self { tracks, last_us: None }
    }

    /// Lets the next frame be the first one.
    pub fn restart(&mut self) {
        self.last_us = None;
    }

    /// Filters the estimate of a frame that began at `start_us`, by a clock of any start. Outputs for which there is no
    /// room in the state stay as they are.
    ///
    /// - A row that could not be decoded keeps NaN, and its filter starts anew at the next frame that can be.
    /// - A frame of the same time as the last one changes nothing, and gets the same outputs: it is a repeated request.
    /// - After a gap of more than [ten](Settings::MOST_TIME_CONSTANTS) time constants, and if the time goes back, the
    ///   filter starts anew.
    #[inline]
    pub fn filter(&mut self, settings: Settings, start_us: u64, estimate: &mut Estimate<'_>) {
        if !settings.is_on() {
            return;
        }
        let tracks = self.tracks.as_mut();
        let gap_us = self.last_us.and_then(|last_us| start_us.checked_sub(last_us));
        self.last_us = Some(start_us);
        let step = gap_us.and_then(|gap_us| settings.step(gap_us));
        if step.is_none() && gap_us != Some(0) {
            tracks.fill([f32::NAN; 2]);
        }
        advance(tracks, step, settings.lead_us as f32 * 1e-6, estimate);
    }
}

/// Takes all outputs one step further; with `None`, no time has passed.
///
/// Not inlined on a device, so that it is compiled with this crate, for speed.
#[cfg_attr(cortex_m4f, inline(never))]
fn advance(tracks: &mut [Track], step: Option<Step>, lead_s: f32, estimate: &mut Estimate<'_>) {
    let outputs = estimate.outputs.len().checked_div(estimate.status.len()).unwrap_or(0).max(1);
    let rows = tracks.chunks_mut(outputs).zip(estimate.outputs.chunks_exact_mut(outputs));
    for ((tracks, outputs), status) in rows.zip(estimate.status.iter()) {
        let of_row = tracks.iter_mut().zip(outputs);
        match status {
            // An output that is a place without a touch is NaN: its filter starts anew.
            RowStatus::Decoded | RowStatus::NoTouch => of_row.for_each(|(track, output)| {
                let [mut value, mut rate] = *track;
                if let Some(Step { dt_s, alpha, beta_per_s }) = step {
                    value += rate * dt_s;
                    let innovation = *output - value;
                    value += alpha * innovation;
                    rate += beta_per_s * innovation;
                }
                let ahead = value + rate * lead_s;
                if ahead.is_finite() {
                    (*track, *output) = ([value, rate], ahead);
                } else {
                    *track = [*output, 0.0]; // the filter of this output starts
                    *output += 0.0; // −0 becomes 0, as it does if the frame is repeated
                }
            }),
            RowStatus::MissingReading | RowStatus::Overflow => {
                of_row.for_each(|(track, _)| *track = [f32::NAN; 2]);
            }
        }
    }
}

#[cfg(test)]
mod tests;

//! A model on trial: in force without being kept as that, so that every restart brings the previous one back, whether the watchdog
//! or the power caused it.

/// Longest trial in ms.
const MOST_TRIAL_MS: u32 = 1_800_000;

/// Whether a model is on trial.
#[derive(Debug, Clone, Copy, Default)]
pub struct Trial {
    slot: Option<usize>,
    /// Time in µs since the start at which it ends.
    ends_us: u64,
}

impl Trial {
    /// Slot of the model on trial.
    pub fn slot(self) -> Option<usize> {
        self.slot
    }

    /// Whether there is one.
    pub fn is_going_on(self) -> bool {
        self.slot.is_some()
    }

    /// Puts the model in `slot` on trial.
    pub fn begin(&mut self, slot: usize) {
        self.slot = Some(slot);
    }

    /// Lets the trial last for `trial_ms` from `now_us` on, but at most half an hour.
    pub fn set_end(&mut self, now_us: u64, trial_ms: u32) {
        self.ends_us = now_us + 1000 * u64::from(trial_ms.min(MOST_TRIAL_MS));
    }

    /// Whether there is one, and its time is over.
    pub fn is_over(&self, now_us: u64) -> bool {
        self.is_going_on() && now_us >= self.ends_us
    }
}

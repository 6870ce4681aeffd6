//! A model on trial: in force without being kept as that, so that every restart brings the previous one back, whether the watchdog
//! or the power caused it.

use super::lease::MOST_LEASE_MS;

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

    /// Lets the trial last for `lease_ms` from `now_us` on, but at most half an hour.
    pub fn lease(&mut self, now_us: u64, lease_ms: u32) {
        self.ends_us = now_us + 1000 * u64::from(lease_ms.min(MOST_LEASE_MS));
    }

    /// Whether there is one, and its time is over.
    pub fn is_over(&self, now_us: u64) -> bool {
        self.is_going_on() && now_us >= self.ends_us
    }
}

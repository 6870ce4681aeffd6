//! A model on trial: in force without a record, so that every restart brings the previous one back, whether the watchdog
//! or the power caused it.

/// Whether a model is on trial.
#[derive(Debug, Clone, Copy, Default)]
pub struct Trial {
    slot: Option<u8>,
    /// Number of the request to confirm it.
    confirms: Option<u16>,
}

impl Trial {
    /// Slot of the model on trial.
    pub fn slot(self) -> Option<usize> {
        self.slot.map(usize::from)
    }

    /// Whether there is one.
    pub fn is_going_on(self) -> bool {
        self.slot.is_some()
    }

    /// Puts the model in `slot` on trial.
    pub fn begin(&mut self, slot: u8) {
        self.slot = Some(slot);
    }

    /// Number of the request to confirm the model, if there was one.
    pub fn confirms(&mut self) -> Option<u16> {
        self.confirms.take()
    }

    /// Lets the next session confirm the model, and answer request `number`: the slot is not borrowed then.
    pub fn confirm(&mut self, number: u16) {
        self.confirms = Some(number);
    }
}

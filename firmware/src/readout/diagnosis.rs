//! What a readout finds when it tests itself.

use serde::{Deserialize, Serialize};

/// Number of pins that converters sample.
pub const PINS: usize = 9;

/// Result of a readout's self-test, in counts of its converters. A converter that does not answer gives
/// [`NO_ANSWER`](Self::NO_ANSWER).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Diagnosis {
    /// The internal reference voltage.
    pub reference: u16,
    /// The temperature sensor.
    pub temperature: u16,
    /// Factory measurements at 3.3 V: the reference, and the temperature sensor at 30 °C and at 110 °C.
    pub factory: [u16; 3],
    /// Each pin with its own pull-up on, and the pull-downs of all others.
    pub pulled_up: [u16; PINS],
    /// Each pin while the pull-downs of all are on.
    pub pulled_down: [u16; PINS],
    /// Other pins that rise with each pin, above half of the range: a bit each.
    pub rise_along: [u16; PINS],
    /// Items that each stream of a pass has not moved: rows, switches, numbers, end.
    pub items_left: [u16; 4],
    /// Items that it was to move.
    pub items: [u16; 4],
    /// Whether the timer of the rows has stopped behind the last one.
    pub has_stopped: bool,
    /// Whether a converter lost a number.
    pub has_overrun: bool,
    /// Cycles of the processor from the pass's start until it was seen to end, or was given up.
    pub pass_cycles: u32,
}

impl Diagnosis {
    /// Value in place of counts if the converter did not answer.
    pub const NO_ANSWER: u16 = u16::MAX;

    /// Parts of a pass that move items, in the order in which one needs the other.
    pub const PARTS: [&'static str; 4] = ["rows", "switches", "numbers", "end"];

    /// The first part of a pass that has not moved all its items.
    pub fn stalled_part(&self) -> Option<&'static str> {
        let place = self.items_left.iter().position(|left| *left != 0);
        place.and_then(|place| Self::PARTS.get(place)).copied()
    }
}

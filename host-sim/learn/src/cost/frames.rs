//! Costs of a frame, without a gate and behind gates.

use serde::Serialize;

/// Cost of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles at zero wait states, by a model of the processor.
    pub cycles: u64,
    /// Cycles with code in flash at 5 wait states, by a model of an STM32F446's flash. The weights are in RAM, if the
    /// images have room for them there; else they are in flash, and this is a lower bound.
    pub flash_cycles: u64,
}

impl Cost {
    /// Cost of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            instructions: self.instructions + other.instructions,
            cycles: self.cycles + other.cycles,
            flash_cycles: self.flash_cycles + other.flash_cycles,
        }
    }
}

/// Costs of a frame without a gate and behind one, in any measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Frames<T> {
    /// Cost without a gate.
    pub ungated: T,
    /// Cost behind a gate that finds all rows untouched.
    pub at_rest: T,
    /// Cost behind a gate that finds all rows touched, each by its last reading.
    pub awake: T,
}

impl<T> Frames<T> {
    /// Costs in another measure, by `of`.
    pub fn map<U>(self, of: impl Fn(T) -> U) -> Frames<U> {
        Frames { ungated: of(self.ungated), at_rest: of(self.at_rest), awake: of(self.awake) }
    }
}

impl Frames<u64> {
    /// Mean cost of frames behind a gate, with this share of untouched rows. It lies between the
    /// costs of frames with all rows untouched and all touched.
    pub fn mean(&self, share_at_rest: f64) -> f64 {
        let [awake, at_rest] = [self.awake, self.at_rest].map(|cost| cost as f64);
        awake + share_at_rest * (at_rest - awake)
    }

    /// Mean cost of frames behind a gate, relative to a frame without a gate.
    pub fn relative(&self, share_at_rest: f64) -> f64 {
        self.mean(share_at_rest) / self.ungated as f64
    }
}

impl Frames<Cost> {
    /// Mean cost of frames behind a gate, rounded.
    pub fn mean_cost(&self, share_at_rest: f64) -> Cost {
        let mean = |of: fn(Cost) -> u64| self.map(of).mean(share_at_rest).round() as u64;
        Cost {
            instructions: mean(|cost| cost.instructions),
            cycles: mean(|cost| cost.cycles),
            flash_cycles: mean(|cost| cost.flash_cycles),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gates_frames_cost_between_all_at_rest_and_all_awake() {
        let cost = |instructions, cycles| Cost { instructions, cycles, flash_cycles: 2 * cycles };
        let frames =
            Frames { ungated: cost(90, 1000), at_rest: cost(11, 100), awake: cost(100, 1050) };
        let means = [0.0, 0.25, 1.0].map(|share| frames.mean_cost(share));
        // 1050 - 0.25·950 = 812.5; 100 - 0.25·89 = 77.75
        let quarter = Cost { instructions: 78, cycles: 813, flash_cycles: 1625 };
        assert_eq!(means, [cost(100, 1050), quarter, cost(11, 100)]);
        let cycles = frames.map(|cost| cost.cycles);
        assert_eq!([0.0, 0.5, 1.0].map(|share| cycles.relative(share)), [1.05, 0.575, 0.1]);
    }
}

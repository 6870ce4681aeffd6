//! What the file of a board holds.

use serde::Serialize;
use taxel_firmware::link::message::Memory;

/// Largest difference of the emulated board's scan from its plan, as a share.
const SCAN_OFF: f64 = 0.03;

/// A measured number beside what is predicted.
#[derive(Serialize)]
pub struct Beside<T> {
    pub measured: T,
    pub predicted: T,
}

/// How a model decodes.
#[derive(Serialize)]
pub struct Decoding {
    /// Format and number of centres; *array* if one network decodes the whole array, *confidence* if the model has one.
    pub model: String,
    pub frames: usize,
    /// Frames whose every output has the bits of the host's; all are predicted.
    pub bit_identical: Beside<usize>,
    /// Cycles of the fastest frame, its readings checked and its contact told; predicted is decoding alone, from memory that never waits.
    pub cycles: Beside<u64>,
    /// What the stack has taken at most since the start with this model.
    pub stack_bytes: u32,
}

/// What the file holds.
#[derive(Serialize)]
pub struct Record<'a> {
    pub is_emulated: bool,
    /// Revision of the repository.
    pub revision: Option<String>,
    pub compiler: String,
    pub board: &'a str,
    /// Its version, as the board tells.
    pub firmware: &'a str,
    /// Number of the chip, as hexadecimal digits.
    pub unique_id: &'a str,
    pub memory: Memory,
    /// What the stack took at most.
    pub stack_bytes: Beside<u32>,
    pub decoding: Vec<Decoding>,
    pub scan_us: Beside<u32>,
    pub erase_ms: Beside<Vec<u32>>,
    pub keeps_its_model_over_a_restart: Beside<bool>,
}

impl Beside<u32> {
    /// Whether the measured number is off by no more than this share.
    fn is_within(&self, share: f64) -> bool {
        f64::from(self.measured.abs_diff(self.predicted)) <= share * f64::from(self.predicted)
    }
}

impl Record<'_> {
    /// Whether everything is right that must be. Cycles may differ, and on silicon times too.
    pub fn is_as_predicted(&self) -> bool {
        self.decoding.iter().all(|it| it.bit_identical.measured == it.bit_identical.predicted)
            && (!self.is_emulated || self.scan_us.is_within(SCAN_OFF))
            && self.keeps_its_model_over_a_restart.measured
            && self.stack_bytes.measured <= self.stack_bytes.predicted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_of_the_emulated_board_must_be_as_planned_and_one_on_silicon_is_recorded() {
        let is_right = |is_emulated, measured| {
            let record = Record {
                is_emulated,
                revision: None,
                compiler: String::new(),
                board: "",
                firmware: "",
                unique_id: "",
                memory: Memory::default(),
                stack_bytes: Beside { measured: 1, predicted: 1 },
                decoding: Vec::new(),
                scan_us: Beside { measured, predicted: 1000 },
                erase_ms: Beside { measured: Vec::new(), predicted: Vec::new() },
                keeps_its_model_over_a_restart: Beside { measured: true, predicted: true },
            };
            record.is_as_predicted()
        };
        assert!(is_right(true, 970) && is_right(true, 1030) && is_right(false, 1100));
        assert!(!is_right(true, 969) && !is_right(true, 1031));
    }
}

//! What the file of a board holds.

use serde::Serialize;
use taxel_firmware::link::message::Memory;

use super::stage::Stage;

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

impl Decoding {
    pub fn is_identical(&self) -> bool {
        self.bit_identical.measured == self.bit_identical.predicted
    }
}

/// What the file holds.
#[derive(Serialize)]
pub struct Record {
    pub is_emulated: bool,
    /// Revision of the repository.
    pub revision: Option<String>,
    pub compiler: String,
    pub board: String,
    /// Its version, as the board tells.
    pub firmware: String,
    /// Number of the chip, as hexadecimal digits.
    pub unique_id: String,
    pub memory: Memory,
    /// What was checked, in order.
    pub stages: Vec<Stage>,
    pub decoding: Vec<Decoding>,
}

impl Record {
    /// Adds stages, and prints them.
    pub fn add(&mut self, stages: impl IntoIterator<Item = Stage>) {
        for stage in stages {
            stage.tell();
            self.stages.push(stage);
        }
    }

    /// Whether every stage so far is as allowed.
    pub fn is_right(&self) -> bool {
        self.stages.iter().all(Stage::is_right)
    }
}

//! A model that can be recalibrated, and presses to do so.

use firmware::link::message::{RecalibrationStep, Report, Request};
use model_core::blob::Floats;
use model_core::{AlignedBytes, Decoder};

use crate::bench::Running;
use crate::board::Board;
use crate::host::ask;
use crate::shape::{COLS, ROWS};

const READINGS: usize = ROWS * COLS;
/// Number of presses of a recalibration.
const PRESSES: usize = 12;
/// How far readings have moved since training, in Ω.
const SHIFTS: [f32; READINGS] = [4.0, -3.0, 5.0, -6.0, 2.0, 3.0];

/// What the sensor read in training for press number `i`, in Ω.
fn press(i: usize) -> [f32; READINGS] {
    let seeds = [13, 29, 31, 37, 41, 53];
    seeds.map(|seed| 52.0 + 16.0 * ((i * seed) % 97) as f32 / 97.0)
}

/// Begins a recalibration of the model `trained`, which is in force, and adds all presses. The device must not scan.
pub fn add(session: &mut Running<'_, '_>, board: &Board, trained: &AlignedBytes) {
    let decoder = Decoder::<ROWS>::load(trained).expect("a model");
    ask(session, board, &Request::Recalibrate(RecalibrationStep::Begin), |_| ());
    for i in 0..PRESSES {
        let before = press(i);
        let stated = decoder.decode(&before[..]).expect("a frame").outputs;
        let mut today = before;
        today.iter_mut().zip(SHIFTS).for_each(|(reading, shift)| *reading += shift);
        let shown = Request::Decode { frame: 1, readings_ohm: Floats::of(&today) };
        ask(session, board, &shown, |report| assert!(matches!(report, Report::Estimate(_))));
        let outputs = Floats::of(&stated);
        let step = RecalibrationStep::Press { before: i as u16, frames: 0, outputs };
        ask(session, board, &Request::Recalibrate(step), |_| ());
    }
}

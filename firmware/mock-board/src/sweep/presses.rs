//! A model that can be recalibrated, and presses to do so.

use firmware::link::message::{RecalibrationStep, Report, Request};
use model_core::blob::Floats;
use model_core::{AlignedBytes, Decoder};

use super::device::{Device, Outcome, recalibration_step};
use crate::bench::Running;
use crate::board::Board;
use crate::host::ask;
use crate::models::blob_to_recalibrate;
use crate::shape::{COLS, ROWS};

const READINGS: usize = ROWS * COLS;
/// Number of presses of a recalibration.
const PRESSES: usize = 12;
/// How far readings have moved since training, in Ω.
const SHIFTS: [f32; READINGS] = [4.0, -3.0, 5.0, -6.0, 2.0, 3.0];

/// A model that can be recalibrated.
pub fn model() -> AlignedBytes {
    blob_to_recalibrate(2)
}

/// What the sensor read in training for press number `i`, in Ω.
fn press(i: usize) -> [f32; READINGS] {
    let seeds = [13, 29, 31, 37, 41, 53];
    seeds.map(|seed| 52.0 + 16.0 * ((i * seed) % 97) as f32 / 97.0)
}

/// Recalibrates the model of [`model`], as far as the power lasts.
pub fn recalibrate(device: &mut Device, cut_after: Option<u64>) -> Outcome {
    let supply = device.supply.clone();
    device.session(cut_after, |session, board| {
        add(session, board, &model());
        let outcome = recalibration_step(session, board, RecalibrationStep::Commit);
        if supply.borrow().gone { Outcome::Cut } else { outcome }
    })
}

/// Begins a recalibration of the model `trained`, which is in force, and adds all presses. The device must not scan.
pub fn add(session: &mut Running<'_, '_>, board: &Board, trained: &AlignedBytes) {
    let decoder = Decoder::<ROWS>::load(trained).expect("a model");
    recalibration_step(session, board, RecalibrationStep::Begin);
    for i in 0..PRESSES {
        let before = press(i);
        let stated = decoder.decode(&before[..]).expect("a frame").outputs;
        let mut today = before;
        today.iter_mut().zip(SHIFTS).for_each(|(reading, shift)| *reading += shift);
        let shown = Request::Decode { frame: 1, readings_ohm: Floats::of(&today) };
        ask(session, board, &shown, |report| assert!(matches!(report, Report::Estimate(_))));
        let outputs = Floats::of(&stated);
        let step = RecalibrationStep::Press { before: i as u16, frames: 0, outputs };
        recalibration_step(session, board, step);
    }
}

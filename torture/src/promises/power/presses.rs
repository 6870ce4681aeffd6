//! A model that can be recalibrated, and presses to do so.

use firmware::link::message::{RecalibrationStep, Report, Request};
use mock_board::{Board, COLS, OUTPUTS, ROWS, ask};
use model_core::blob::{Floats, Metadata, ModelParts, ModelShape, encode_to_vec};
use model_core::rbf::Shape;
use model_core::rbf::direct::{Network, Parameters};
use model_core::{AlignedBytes, Decoder};

use super::device::{Device, Outcome, Running, recalibration_step};

const READINGS: usize = ROWS * COLS;
const ALL: usize = ROWS * OUTPUTS;
/// Number of presses of a recalibration.
const PRESSES: usize = 12;
/// How far readings have moved since training, in Ω.
const SHIFTS: [f32; READINGS] = [4.0, -3.0, 5.0, -6.0, 2.0, 3.0];

/// A model with a network for each row, whose training errors are known.
pub fn model() -> AlignedBytes {
    let number = |i: usize| ((i * 37) % 101) as f32 / 50.0 - 1.0;
    let list = |from: usize, count: usize| (from..from + count).map(number).collect::<Vec<_>>();
    let [centres, weights, affine] = [list(60, 2 * COLS), list(20, 2 * OUTPUTS), list(40, 6)];
    let shape = Shape { inputs: COLS, centres: 2, outputs: OUTPUTS };
    let network = |bias: &'static [f32; OUTPUTS]| {
        let parameters = Parameters {
            input_minimum: &[50.0; COLS],
            input_per_span: &[0.05; COLS],
            centres: &centres,
            decay: &[0.5],
            output_weights: &weights,
            bias,
            affine: &affine,
        };
        Network::try_new(shape, parameters).expect("a network").into()
    };
    let errors = [0.02; ALL];
    let shape = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
    encode_to_vec(&ModelParts {
        projection: None,
        expansion: None,
        confidence: None,
        fill: None,
        networks: &[network(&[0.5, -0.5]), network(&[1.0, 2.0])],
        row_network: &[0, 1],
        metadata: Metadata { training_rmse: Floats::of(&errors), ..Metadata::unnamed(shape) },
    })
    .expect("a blob")
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
        let outcome = in_session(session, board);
        if supply.borrow().gone { Outcome::Cut } else { outcome }
    })
}

fn in_session(session: &mut Running<'_, '_>, board: &Board) -> Outcome {
    let trained = model();
    let decoder = Decoder::<ROWS>::load(&trained).expect("a model");
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
    recalibration_step(session, board, RecalibrationStep::Commit)
}

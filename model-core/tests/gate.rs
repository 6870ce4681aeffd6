//! A decoder that skips rows at rest.

use taxel_core::blob::{Metadata, ModelParts, ModelShape, encode};
use taxel_core::gate::Rest;
use taxel_core::rbf::Shape;
use taxel_core::rbf::direct::{Network, Parameters};
use taxel_core::{Aligned, Decoder, Frame, Gate, OwnedEstimate, RowStatus};

const ROWS: usize = 3;
const COLS: usize = 2;
const OUTPUTS: usize = 2;
const TOLERANCE: f32 = 0.02;

type TestDecoder<'a> = Decoder<'a, ROWS>;
type TestFrame = [[f32; COLS]; ROWS];

const BASELINE: TestFrame = [[50.0, 60.0], [51.0, 61.0], [52.0, 62.0]];

fn with_decoder(check: impl FnOnce(&TestDecoder<'_>)) {
    let parameters = Parameters {
        input_minimum: &[40.0, 50.0],
        input_per_span: &[0.05, 0.05],
        centres: &[0.5, 0.25],
        decay: &[2.0],
        output_weights: &[1.5, -0.75],
        bias: &[-0.5, 0.25],
        affine: &[0.125, 0.25, -0.5, 1.0],
    };
    let shape = Shape { inputs: COLS, centres: 1, outputs: OUTPUTS };
    let network = Network::try_new(shape, parameters).unwrap().into();
    let shape = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
    let metadata = Metadata::unnamed(shape);
    let networks = &[network];
    let parts = ModelParts::new(networks, &[0; ROWS], metadata);
    let mut buffer = Aligned([0; 512]);
    check(&TestDecoder::load(encode(&parts, &mut buffer.0).unwrap()).unwrap());
}

fn decoded(decoder: &TestDecoder<'_>, frame: &TestFrame) -> OwnedEstimate {
    decoder.decode(frame.as_flattened()).unwrap()
}

fn decode_gated(
    decoder: &TestDecoder<'_>,
    frame: &TestFrame,
    gate: Option<Gate<'_>>,
) -> OwnedEstimate {
    // These values must all be overwritten.
    let mut estimate = OwnedEstimate {
        outputs: vec![7.0; ROWS * OUTPUTS],
        status: vec![RowStatus::Overflow; ROWS],
    };
    let mut scratch = [0.0; COLS];
    let frame = Frame { gate, ..Frame::from(frame.as_flattened()) };
    decoder.decode_into(frame, &mut scratch, &mut estimate.borrowed()).unwrap();
    estimate
}

fn gated(decoder: &TestDecoder<'_>, frame: &TestFrame, baseline: &TestFrame) -> OwnedEstimate {
    let OwnedEstimate { outputs, status } = decoded(decoder, baseline);
    let baseline_ohm = baseline.as_flattened();
    let rest = Rest { baseline_ohm, outputs: &outputs, status: &status };
    decode_gated(decoder, frame, Gate::new(rest, TOLERANCE))
}

/// Bits of the outputs of one row.
fn bits(estimate: &OwnedEstimate, row: usize) -> [u32; OUTPUTS] {
    estimate.outputs.as_chunks().0[row].map(f32::to_bits)
}

#[test]
fn a_row_at_rest_answers_as_the_baseline_does_and_an_awake_one_as_without_a_gate() {
    with_decoder(|decoder| {
        let mut frame = BASELINE;
        frame[0] = [50.9, 59.0];
        frame[1] = [51.0, 59.0]; // 3.3 % less
        frame[2] = [52.9, 61.5];
        let estimate = gated(decoder, &frame, &BASELINE);
        assert_eq!(estimate.status, [RowStatus::AtRest, RowStatus::Decoded, RowStatus::AtRest]);
        let (rest, ungated) = (decoded(decoder, &BASELINE), decoded(decoder, &frame));
        for (row, expected) in [&rest, &ungated, &rest].into_iter().enumerate() {
            assert_eq!(bits(&estimate, row), bits(expected, row), "row {row}");
            assert_ne!(bits(&rest, row), bits(&ungated, row), "row {row}");
        }
    });
}

#[test]
fn a_row_whose_baseline_is_unknown_is_always_decoded() {
    with_decoder(|decoder| {
        for unknown in [f32::NAN, f32::INFINITY] {
            let mut baseline = BASELINE;
            baseline[2][0] = unknown;
            let estimate = gated(decoder, &BASELINE, &baseline);
            assert_eq!(estimate.status[1..], [RowStatus::AtRest, RowStatus::Decoded], "{unknown}");
            assert_eq!(bits(&estimate, 2), bits(&decoded(decoder, &BASELINE), 2), "{unknown}");
        }
    });
}

//! A decoder that skips rows at rest.

use model_core::blob::{Metadata, ModelParts, ModelShape, encode};
use model_core::rbf::Shape;
use model_core::rbf::direct::{Network, Parameters};
use model_core::{Aligned, Decoder, Estimate, Frame, Gate, RowStatus};

const ROWS: usize = 3;
const COLS: usize = 2;
const OUTPUTS: usize = 2;
const TOLERANCE: f32 = 0.02;

type TestDecoder<'a> = Decoder<'a, ROWS, COLS, OUTPUTS>;
type TestFrame = Frame<ROWS, COLS>;
type TestEstimate = Estimate<ROWS, OUTPUTS>;

const BASELINE: TestFrame =
    Frame { row_column_resistance_ohm: [[50.0, 60.0], [51.0, 61.0], [52.0, 62.0]] };

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
    let parts =
        ModelParts { projection: None, networks: &[network], row_network: &[0; ROWS], metadata };
    let mut buffer = Aligned([0; 512]);
    check(&TestDecoder::load(encode(&parts, &mut buffer.0).unwrap()).unwrap());
}

fn gated(decoder: &TestDecoder<'_>, frame: &TestFrame, baseline: &TestFrame) -> TestEstimate {
    let rest = decoder.decode(baseline);
    // These values must all be overwritten.
    let mut estimate = Estimate { outputs: [[7.0; 2]; 3], status: [RowStatus::Overflow; 3] };
    decoder.decode_gated_into(frame, Gate::new(baseline, &rest, TOLERANCE), &mut estimate);
    estimate
}

fn bits(outputs: [f32; OUTPUTS]) -> [u32; OUTPUTS] {
    outputs.map(f32::to_bits)
}

#[test]
fn a_row_at_rest_answers_as_the_baseline_does_and_an_awake_one_as_without_a_gate() {
    with_decoder(|decoder| {
        let mut frame = BASELINE;
        frame.row_column_resistance_ohm[0] = [50.9, 59.0];
        frame.row_column_resistance_ohm[1] = [51.0, 59.0]; // 3.3 % less
        frame.row_column_resistance_ohm[2] = [52.9, 61.5];
        let estimate = gated(decoder, &frame, &BASELINE);
        assert_eq!(estimate.status, [RowStatus::AtRest, RowStatus::Decoded, RowStatus::AtRest]);
        let (rest, ungated) = (decoder.decode(&BASELINE), decoder.decode(&frame));
        for (row, expected) in [&rest, &ungated, &rest].into_iter().enumerate() {
            assert_eq!(bits(estimate.outputs[row]), bits(expected.outputs[row]), "row {row}");
            assert_ne!(bits(rest.outputs[row]), bits(ungated.outputs[row]), "row {row}");
        }
    });
}

#[test]
fn a_row_with_a_missing_reading_stays_missing() {
    with_decoder(|decoder| {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut frame = BASELINE;
            frame.row_column_resistance_ohm[1][1] = bad;
            let estimate = gated(decoder, &frame, &BASELINE);
            let expected = [RowStatus::AtRest, RowStatus::MissingReading, RowStatus::AtRest];
            assert_eq!(estimate.status, expected, "{bad}");
            assert!(estimate.outputs[1].iter().all(|output| output.is_nan()));
        }
    });
}

#[test]
fn a_row_whose_baseline_is_unknown_is_always_decoded() {
    with_decoder(|decoder| {
        for unknown in [f32::NAN, f32::INFINITY] {
            let mut baseline = BASELINE;
            baseline.row_column_resistance_ohm[2][0] = unknown;
            let estimate = gated(decoder, &BASELINE, &baseline);
            assert_eq!(estimate.status[1..], [RowStatus::AtRest, RowStatus::Decoded], "{unknown}");
            let expected = decoder.decode(&BASELINE).outputs[2];
            assert_eq!(bits(estimate.outputs[2]), bits(expected), "{unknown}");
        }
    });
}

#[test]
fn without_a_gate_every_row_is_decoded() {
    with_decoder(|decoder| {
        let mut estimate = gated(decoder, &BASELINE, &BASELINE);
        assert_eq!(estimate.status, [RowStatus::AtRest; ROWS]);
        decoder.decode_gated_into(&BASELINE, None, &mut estimate);
        assert_eq!(estimate, decoder.decode(&BASELINE));
        assert_eq!(estimate.status, [RowStatus::Decoded; ROWS]);
    });
}

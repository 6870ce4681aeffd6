//! A decoder of the paper's sensor: it decodes as its networks infer, and rejects an unsound blob.

use taxel_core::blob::{DecodeError, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::float32::{self, Parameters};
use taxel_core::rbf::{Network, NetworkError, Shape};
use taxel_core::relative::reciprocal;
use taxel_core::{AlignedBytes, Decoder, Estimate, Frame, RowStatus};

const ROWS: usize = 8;
const COLS: usize = 18;
const OUTPUTS: usize = 18;
const CENTRES: usize = 5;

type PaperDecoder<'a> = Decoder<'a, ROWS>;

/// Hand-made numbers that differ from place to place, in [−1, 1].
fn spread_out(seed: usize, count: usize) -> Vec<f32> {
    (0..count).map(|i| (((i * 37 + seed * 11) % 101) as f32 - 50.0) / 50.0).collect()
}

/// A network of the paper's shape, whose numbers depend on `seed`. They are never freed.
fn network(seed: usize) -> Network<'static> {
    let list = |from: usize, count: usize, start: f32, by: f32| -> &'static [f32] {
        spread_out(seed + from, count).iter().map(|v| start + by * v).collect::<Vec<_>>().leak()
    };
    let parameters = Parameters {
        input_minimum: list(0, COLS, 55.0, 1.0),
        input_per_span: &[0.1; COLS],
        centres: list(1, CENTRES * COLS, 0.5, 0.5),
        decay: &[0.75; CENTRES],
        output_weights: list(2, CENTRES * OUTPUTS, 0.0, 1.0),
        bias: list(3, OUTPUTS, 0.0, 1.0),
        affine: list(4, COLS * OUTPUTS, 0.0, 1.0),
    };
    let shape = Shape { inputs: COLS, centres: CENTRES, outputs: OUTPUTS };
    float32::Network::try_new(shape, parameters).unwrap().into()
}

/// A blob of two networks that the rows use in turn.
fn blob(seed: usize, rows: usize) -> AlignedBytes {
    let shape = ModelShape { rows, inputs: COLS, outputs: OUTPUTS };
    let metadata = Metadata { name: "hand-made", ..Metadata::unnamed(shape) };
    let row_network: Vec<u8> = (0..rows).map(|row| (row % 2) as u8).collect();
    let networks = &[network(seed), network(seed + 50)];
    encode_to_vec(&ModelParts::new(networks, &row_network, metadata)).unwrap()
}

fn frame() -> Vec<f32> {
    spread_out(9, ROWS * COLS).iter().map(|v| 60.0 + 4.0 * v).collect()
}

fn bits(outputs: &[f32]) -> Vec<u32> {
    outputs.iter().map(|v| v.to_bits()).collect()
}

/// Outputs of the networks themselves.
fn inferred(seed: usize, frame: &[f32]) -> Vec<f32> {
    let networks = [network(seed), network(seed + 50)];
    let mut outputs = vec![0.0; ROWS * OUTPUTS];
    let rows = frame.chunks(COLS).zip(outputs.chunks_mut(OUTPUTS)).enumerate();
    for (row, (reading, output)) in rows {
        networks[row % 2].infer(reading, &mut [0.0; COLS], output).unwrap();
    }
    outputs
}

#[test]
fn it_decodes_bit_for_bit_as_its_networks_infer_and_has_room_for_fewer_rows() {
    let frame = frame();
    for rows in 1..=ROWS {
        let blob = blob(1, rows);
        let decoder = PaperDecoder::load(&blob).unwrap();
        assert_eq!(decoder.shape(), ModelShape { rows, inputs: COLS, outputs: OUTPUTS });
        assert_eq!(decoder.metadata().name, "hand-made");
        assert_eq!(decoder.model_crc().to_le_bytes(), *blob.last_chunk().unwrap());
        let estimate = decoder.decode(&frame[..rows * COLS]).unwrap();
        assert_eq!(estimate.status, vec![RowStatus::Decoded; rows]);
        let expected = inferred(1, &frame);
        assert_eq!(bits(&estimate.outputs), bits(&expected[..rows * OUTPUTS]));
    }
    let error = PaperDecoder::load(&blob(1, ROWS + 1)).unwrap_err();
    assert_eq!(error, DecodeError::TooManyRows { most: ROWS, found: ROWS + 1 });
}

#[test]
fn a_slice_of_another_length_is_refused_by_name_and_nothing_is_written() {
    let (blob, frame) = (blob(1, ROWS), frame());
    let decoder = PaperDecoder::load(&blob).unwrap();
    let refused = |readings: usize, scratch: usize, outputs: usize, rows: usize| {
        let (mut outputs, mut status) = (vec![7.0; outputs], vec![RowStatus::Overflow; rows]);
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        let readings = &frame.repeat(2)[..readings];
        let error = decoder.decode_into(readings.into(), &mut vec![0.0; scratch], &mut estimate);
        assert!(outputs.iter().all(|output| *output == 7.0));
        assert!(status.iter().all(|status| *status == RowStatus::Overflow));
        error.unwrap_err()
    };
    let (readings, outputs) = (ROWS * COLS, ROWS * OUTPUTS);
    let length = |what, expected, found| NetworkError::Length { what, expected, found };
    for found in [readings - 1, readings + 1] {
        assert_eq!(refused(found, COLS, outputs, ROWS), length("frame", readings, found));
    }
    let found = outputs - 1;
    let expected = length("outputs of the estimate", outputs, found);
    assert_eq!(refused(readings, COLS, found, ROWS), expected);
    let expected = length("status of the estimate", ROWS, ROWS + 1);
    assert_eq!(refused(readings, COLS, outputs, ROWS + 1), expected);
    assert_eq!(refused(readings, COLS - 1, outputs, ROWS), length("scratch", COLS, COLS - 1));
}

#[test]
fn each_row_is_divided_by_its_own_baseline() {
    let shape = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
    let blob = |relative_inputs: bool| {
        let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
        let networks = &[network(3)];
        encode_to_vec(&ModelParts::new(networks, &[0; ROWS], metadata)).unwrap()
    };
    let [plain, relative] = [false, true].map(blob);
    let [plain, relative] = [&plain, &relative].map(|blob| PaperDecoder::load(blob).unwrap());
    let ratios = frame();
    // Powers of two, so that nothing is rounded.
    let baseline: Vec<f32> = (0..ROWS * COLS).map(|i| f32::from(1_u16 << (i % 11))).collect();
    let reciprocals: Vec<f32> = baseline.iter().map(|ohm| reciprocal(*ohm)).collect();
    let readings: Vec<f32> = ratios.iter().zip(&baseline).map(|(r, ohm)| r * ohm).collect();
    let given = Frame { reciprocals: &reciprocals, ..readings[..].into() };
    let [expected, found] = [plain.decode(&ratios[..]), relative.decode(given)];
    assert_eq!(bits(&found.unwrap().outputs), bits(&expected.unwrap().outputs));
}

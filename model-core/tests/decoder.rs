//! A decoder's room for rows, and the lengths of what it is given. That it decodes as its networks infer:
//! `host-sim/learn/tests/all/random_models.rs`.

use crate::common::network;
use taxel_core::blob::{DecodeError, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::NetworkError;
use taxel_core::{AlignedBytes, Decoder, Estimate, RowStatus};

const ROWS: usize = 8;
const COLS: usize = 2;
const OUTPUTS: usize = 3;

type EightRows<'a> = Decoder<'a, ROWS>;

/// A blob of one network for so many rows.
fn blob(rows: usize) -> AlignedBytes {
    let shape = ModelShape { rows, inputs: COLS, outputs: OUTPUTS };
    let metadata = Metadata { name: "hand-made", ..Metadata::unnamed(shape) };
    let networks = &[network(&[1.5, 3.0, 4.5])];
    encode_to_vec(&ModelParts::new(networks, &vec![0; rows], metadata)).unwrap()
}

const FRAME: [f32; ROWS * COLS] = [54.0; ROWS * COLS];

#[test]
fn it_has_room_for_so_many_rows_and_fewer() {
    let shape = ModelShape { rows: 3, inputs: COLS, outputs: OUTPUTS };
    let few = blob(3);
    let decoder = EightRows::load(&few).unwrap();
    assert_eq!((decoder.shape(), decoder.metadata().name), (shape, "hand-made"));
    assert_eq!(decoder.model_crc().to_le_bytes(), *few.last_chunk().unwrap());
    assert_eq!(decoder.decode(&FRAME[..3 * COLS]).unwrap().status, [RowStatus::Decoded; 3]);
    let error = EightRows::load(&blob(ROWS + 1)).unwrap_err();
    assert_eq!(error, DecodeError::TooManyRows { most: ROWS, found: ROWS + 1 });
}

#[test]
fn a_slice_of_wrong_length_is_named_and_nothing_is_written() {
    let blob = blob(ROWS);
    let decoder = EightRows::load(&blob).unwrap();
    let refused = |readings: usize, scratch: usize, outputs: usize, rows: usize| {
        let (mut outputs, mut status) = (vec![7.0; outputs], vec![RowStatus::Overflow; rows]);
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        let readings = &FRAME.repeat(2)[..readings];
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

//! What several tests of the blob share.

use taxel_core::checksum::CRC_32;
use taxel_core::rbf::float32::{self, Parameters};
use taxel_core::rbf::{Network, Shape};

/// A projection block: the first feature is the mean of the four readings, the second the difference of the rows.
pub const PROJECTION: [f32; 10] = [0.0, 10.0, 0.25, 0.25, 0.25, 0.25, 0.25, -0.25, 0.25, -0.25];
/// A frame at the centre of [`network`] in the first feature, and a quarter of the span from it in the second.
pub const NEAR_CENTRE: [f32; 4] = [48.0, 50.0, 60.0, 58.0];

/// A network of two features and one centre, with an output for each of up to three `weights`.
pub fn network(weights: &[f32]) -> Network<'_> {
    let parameters = Parameters {
        input_minimum: &[50.0, 5.0],
        input_per_span: &[0.125, 0.1],
        centres: &[0.5, 0.25],
        decay: &[2.0],
        output_weights: weights,
        bias: &[-0.5, -1.0, 0.0][..weights.len()],
        affine: &[],
    };
    let shape = Shape { inputs: 2, centres: 1, outputs: weights.len() };
    float32::Network::try_new(shape, parameters).unwrap().into()
}

/// Examples of the blob's specification, each behind a line `[NAME]`: lines like `0 | 54 41 … | magic`.
const EXAMPLES: &str = include_str!("../../testdata/blob-examples.txt");

/// Bytes of the example of that name.
pub fn worked_bytes(name: &str) -> Vec<u8> {
    let behind = EXAMPLES.split(&format!("[{name}]")).nth(1).expect("the named example");
    bytes_of_table(behind.lines().take_while(|line| !line.starts_with('[')))
}

/// Bytes of lines that begin with an offset, ` | ` and bytes in hexadecimal. Other lines are skipped.
fn bytes_of_table<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for line in lines {
        let mut cells = line.trim_start_matches('|').split('|').map(str::trim);
        let (Some(offset), Some(hex)) = (cells.next(), cells.next()) else { continue };
        let Ok(offset) = offset.parse::<usize>() else { continue };
        assert_eq!(offset, bytes.len(), "offset of the line {line:?}");
        bytes.extend(hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()));
    }
    bytes
}

/// Writes the CRC that fits the bytes before it.
pub fn close_with_crc(bytes: &mut [u8]) {
    let (body, crc) = bytes.split_last_chunk_mut::<4>().unwrap();
    *crc = CRC_32.checksum(body).to_le_bytes();
}

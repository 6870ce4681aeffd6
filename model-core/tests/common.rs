//! What several tests of the blob share.

use taxel_core::checksum::CRC_32;
use taxel_core::rbf::direct::{self, Parameters};
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
    direct::Network::try_new(shape, parameters).unwrap().into()
}

/// The blob's specification.
const SPECIFICATION: &str = include_str!("../../docs/blob.md");

/// Hexadecimal bytes of the specification's table between two comments `<!-- MARK -->`: lines like `| 0 | 54 41 … | … |`.
pub fn worked_bytes(mark: &str) -> Vec<u8> {
    let mark = format!("<!-- {mark} -->");
    let table = SPECIFICATION.split(&mark).nth(1).expect("the marked table");
    let mut bytes = Vec::new();
    for line in table.lines().filter(|line| line.starts_with('|')) {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let (Some(offset), Some(hex)) = (cells.next(), cells.next()) else { continue };
        let Ok(offset) = offset.parse::<usize>() else { continue };
        assert_eq!(offset, bytes.len(), "offset of the line {line:?}");
        bytes.extend(hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()));
    }
    bytes
}

/// Writes the CRC that fits the bytes before it.
pub fn seal(bytes: &mut [u8]) {
    let (body, crc) = bytes.split_last_chunk_mut::<4>().unwrap();
    *crc = CRC_32.checksum(body).to_le_bytes();
}

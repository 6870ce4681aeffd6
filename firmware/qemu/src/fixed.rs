//! Networks of fixed size beside the blobs that they were exported from. Results must be the same on host and target,
//! to the last bit: `firmware/tests/bit_for_bit.rs` compiles this file for the host too.

use model_core::{Decoder, Estimate, RowStatus};

use crate::checks::{COLS, Numbers, OUTPUTS, QUICK_CRC, ROWS, one_of_many};

#[path = "../../../testdata/hand-made.rs"]
mod hand_made;
#[path = "../../../testdata/row4.rs"]
mod row4;

/// Number of frames that are decoded both ways.
pub const FRAMES: usize = 1000;

/// CRC-32 of all bits of the statics' outputs for [`FRAMES`] frames, and how many of these the blob decodes to other
/// bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Compared {
    /// CRC-32.
    pub crc: u32,
    /// Frames of which one bit differs or more.
    pub different: usize,
}

/// Compares the statics of `testdata/hand-made.rs`, with a width for each centre, with their `blob`. `None` if it does
/// not load.
pub fn hand_made(blob: &[u8]) -> Option<Compared> {
    compare::<ROWS, OUTPUTS>(blob, hand_made::decode)
}

/// Compares the static of `testdata/row4.rs`, which `minimal` decodes with, with its `blob`. `None` if it does not load.
pub fn row4(blob: &[u8]) -> Option<Compared> {
    compare::<1, 6>(blob, row4::decode)
}

fn compare<const R: usize, const O: usize>(
    blob: &[u8],
    decode: fn(&[[f32; COLS]; R]) -> [[f32; O]; R],
) -> Option<Compared> {
    let decoder = Decoder::<R>::load(blob).ok()?;
    let crc = QUICK_CRC;
    let (mut digest, mut different) = (crc.digest(), 0);
    let mut numbers = Numbers::new(9);
    for index in 0..FRAMES {
        let frame = one_of_many::<R>(index, &mut numbers);
        let (mut outputs, mut status) = ([[0.0; O]; R], [RowStatus::MissingReading; R]);
        let mut estimate = Estimate { outputs: outputs.as_flattened_mut(), status: &mut status };
        decoder.decode_into(frame.as_flattened().into(), &mut [0.0; COLS], &mut estimate).ok()?;
        let of_static = decode(&frame);
        let bits = |outputs: [[f32; O]; R]| outputs.map(|row| row.map(f32::to_bits));
        different += usize::from(bits(of_static) != bits(outputs));
        let values = of_static.as_flattened().iter();
        values.for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
    }
    Some(Compared { crc: digest.finalize(), different })
}

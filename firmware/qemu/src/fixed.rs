//! Networks of fixed size beside the blobs that they were exported from. Results must be the same on host and target,
//! to the last bit: `firmware/tests/bit_for_bit.rs` compiles this file for the host too.

use taxel_core::{Decoder, Estimate, RowStatus};

use crate::checks::{COLS, Numbers, OUTPUTS, QUICK_CRC, ROWS, Say, one_of_many};

#[path = "../../../testdata/hand-made.rs"]
mod hand_made;
#[path = "../../../testdata/row4.rs"]
mod row4;

/// Number of frames that are decoded both ways.
const FRAMES: usize = 1000;

/// Says how many frames the statics of `testdata/hand-made.rs`, with a width for each centre, and of `testdata/row4.rs`,
/// which `minimal` decodes with, decode as their blobs do. `None` if a blob does not load, or a bit differs.
pub fn compare_all(of_hand_made: &[u8], of_row4: &[u8], say: Say<'_>) -> Option<()> {
    compare::<ROWS, OUTPUTS>("hand-made", of_hand_made, hand_made::decode, say)?;
    compare::<1, 6>("row4", of_row4, row4::decode, say)
}

fn compare<const R: usize, const O: usize>(
    name: &str,
    blob: &[u8],
    decode: fn(&[[f32; COLS]; R]) -> [[f32; O]; R],
    say: Say<'_>,
) -> Option<()> {
    let decoder = Decoder::<R>::load(blob).ok()?;
    let crc = QUICK_CRC;
    let (mut digest, mut same) = (crc.digest(), 0);
    let mut numbers = Numbers::new(9);
    for index in 0..FRAMES {
        let frame = one_of_many::<R>(index, &mut numbers);
        let (mut outputs, mut status) = ([[0.0; O]; R], [RowStatus::MissingReading; R]);
        let mut estimate = Estimate { outputs: outputs.as_flattened_mut(), status: &mut status };
        decoder.decode_into(frame.as_flattened().into(), &mut [0.0; COLS], &mut estimate).ok()?;
        let of_static = decode(&frame);
        let bits = |outputs: [[f32; O]; R]| outputs.map(|row| row.map(f32::to_bits));
        same += usize::from(bits(of_static) == bits(outputs));
        let values = of_static.as_flattened().iter();
        values.for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
    }
    let crc = digest.finalize();
    say(format_args!("{name}: {same} of {FRAMES} frames bit-identical to the blob's: {crc:08x}"));
    (same == FRAMES).then_some(())
}

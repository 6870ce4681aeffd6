//! Models in arrays of fixed size beside the blobs that they were exported from. Results must be the same on host and target,
//! to the last bit: `firmware/tests/bit_for_bit.rs` compiles this file for the host too.

use taxel_core::{Decoded, Decoder, Estimate, RowStatus};

use crate::checks::{ARRAY_ROWS, COLS, Numbers, OUTPUTS, QUICK_CRC, ROWS, Say, one_of_many};

#[path = "../../../testdata/array-touch.rs"]
mod array_touch;
#[path = "../../../testdata/hand-made.rs"]
mod hand_made;
#[path = "../../../testdata/row4.rs"]
mod row4;

/// Number of frames that are decoded both ways.
const FRAMES: usize = 1000;

/// Most floats of working space.
const SCRATCH: usize = 128;

/// Says how many frames the statics decode as their blobs do: `testdata/hand-made.rs`, with a width for each centre;
/// `testdata/row4.rs`, which `minimal` decodes with; and `testdata/array-touch.rs`, with networks in both formats behind shape
/// and strength of a touch. `None` if a blob does not load, or a bit differs.
pub fn compare_all([hand_made, row4, touch]: [&[u8]; 3], say: Say<'_>) -> Option<()> {
    compare::<ROWS, OUTPUTS>("hand-made", hand_made, hand_made::decode, say)?;
    compare::<1, 6>("row4", row4, row4::decode, say)?;
    compare::<ARRAY_ROWS, OUTPUTS>("array-touch", touch, array_touch::decode, say)
}

fn compare<const R: usize, const O: usize>(
    name: &str,
    blob: &[u8],
    decode: fn(&[[f32; COLS]; R]) -> Decoded<R, O>,
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
        let frame_ohm = frame.as_flattened().into();
        let clamped = decoder.decode_into(frame_ohm, &mut [0.0; SCRATCH], &mut estimate).ok()?;
        let of_static = decode(&frame);
        let bits = |outputs: [[f32; O]; R]| outputs.map(|row| row.map(f32::to_bits));
        let alike = (of_static.status, of_static.clamped) == (status, clamped);
        same += usize::from(alike && bits(of_static.outputs) == bits(outputs));
        let values = of_static.outputs.as_flattened().iter();
        values.for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
    }
    let crc = digest.finalize();
    say(format_args!("{name}: {same} of {FRAMES} frames bit-identical to the blob's: {crc:08x}"));
    (same == FRAMES).then_some(())
}

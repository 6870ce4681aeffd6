//! What host and target must compute to the last bit alike. `firmware/tests/bit_for_bit.rs` compiles this
//! file for the host, and compares.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use model_core::exp::ExpKernel;
use model_core::rls::Rls;
use model_core::{Decoder, Frame};

/// Of the sensor, as of the paper's.
pub const ROWS: usize = 8;
/// Of the sensor, as of the paper's.
pub const COLS: usize = 18;
/// Of one row.
pub const OUTPUTS: usize = 18;

const FRAMES: usize = 6;
const CRC: Crc<u32, Table<0>> = Crc::<u32, Table<0>>::new(&CRC_32_ISO_HDLC);

/// Numbers without a pattern in [−1, 1), the same everywhere: the upper half of a linear congruential
/// generator (Knuth's MMIX).
pub struct Numbers(u64);

impl Numbers {
    /// Those of `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next one.
    pub fn draw(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as i32 - (1 << 23)) as f32 / (1 << 23) as f32
    }
}

fn add(digest: &mut Digest<'_, u32, Table<0>>, values: &[f32]) {
    values.iter().for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
}

/// CRC-32 of every bit of what the model in `blob` answers to some frames, one with a reading
/// missing. `None`: the blob does not load.
#[must_use]
pub fn decoding<E: ExpKernel>(blob: &[u8]) -> Option<u32> {
    let decoder = Decoder::<ROWS, COLS, OUTPUTS, E>::load(blob).ok()?;
    let crc = CRC;
    let mut digest = crc.digest();
    let mut numbers = Numbers::new(1);
    for frame in 0..FRAMES {
        let mut readings = Frame::<ROWS, COLS>::missing();
        let places = readings.row_column_resistance_ohm.as_flattened_mut();
        places.iter_mut().for_each(|ohm| *ohm = 60.0 + 5.0 * numbers.draw());
        if frame == 1 {
            readings.row_column_resistance_ohm[2][3] = f32::NAN;
        }
        add(&mut digest, decoder.decode(&readings).outputs.as_flattened());
    }
    Some(digest.finalize())
}

/// CRC-32 of every bit of the weights that recursive least squares has learnt after each of 200
/// samples.
#[must_use]
pub fn recalibration() -> Option<u32> {
    let mut rls = Rls::<f32, 9, 3>::try_new(1e4, 0.99).ok()?;
    let crc = CRC;
    let mut digest = crc.digest();
    let mut numbers = Numbers::new(2);
    for _ in 0..200 {
        let regressor: [f32; 9] =
            core::array::from_fn(|i| if i == 8 { 1.0 } else { numbers.draw() });
        let noise = 1e-3 * numbers.draw();
        let (first, last) = (regressor[0] - 0.5 * regressor[1], 0.25 * regressor[7]);
        rls.update(regressor, [first + noise, last - noise, 2.0 * first * last]);
        add(&mut digest, rls.output_weights().as_flattened());
    }
    Some(digest.finalize())
}

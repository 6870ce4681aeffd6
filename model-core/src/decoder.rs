//! From a frame to an estimate: the one entry the device calls.

use core::marker::PhantomData;

use crate::blob::{DecodeError, Metadata, Model, ModelShape};
use crate::exp::{ExpKernel, Polynomial};
use crate::frame::Frame;
use crate::rbf::Network;

/// What became of one row of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// All readings were there; the outputs are valid.
    Decoded,
    /// At least one reading was missing (not a finite number); the outputs are NaN.
    MissingReading,
    /// Readings or weights so large that an output overflowed; the outputs are NaN.
    Overflow,
}

/// The outputs of every row, in the units of the model's output columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate<const ROWS: usize, const OUTPUTS: usize> {
    /// `[row][output]`; NaN where the row could not be decoded.
    pub outputs: [[f32; OUTPUTS]; ROWS],
    /// What became of each row.
    pub status: [RowStatus; ROWS],
}

/// RAM in bytes that a [`Decoder`] of so many `rows` takes on a 32-bit target, whatever its K: slices
/// into the blob, a network a row. The link check of the firmware holds it to the compiler.
#[must_use]
pub const fn decoder_ram_bytes(rows: usize) -> usize {
    128 + 68 * rows
}

/// A model ready to decode frames of a sensor whose sizes are known when compiled.
///
/// Any number of centres K is served: it comes with the blob. RAM: a few slices a row; the
/// weights stay where the blob lies.
///
/// `E` is the [exp kernel](crate::exp).
#[derive(Debug, Clone, Copy)]
pub struct Decoder<
    'a,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    E: ExpKernel = Polynomial,
> {
    model: Model<'a>,
    row_networks: [Network<'a>; ROWS],
    kernel: PhantomData<E>,
}

impl<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize, E: ExpKernel>
    Decoder<'a, ROWS, COLS, OUTPUTS, E>
{
    /// Loads a blob. It must lie at a multiple of four ([`Aligned`](crate::Aligned)).
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or its shape is not this decoder's.
    pub fn load(blob: &'a [u8]) -> Result<Self, DecodeError> {
        const { assert!(ROWS > 0 && COLS > 0 && OUTPUTS > 0, "a sensor has rows, columns, outputs") }
        let model = Model::decode(blob)?;
        let expected = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
        let mismatch = DecodeError::ShapeMismatch { expected, found: model.shape() };
        if model.shape() != expected {
            return Err(mismatch);
        }
        let first = model.networks().next().ok_or(mismatch)?;
        let mut row_networks = [first; ROWS];
        for (row, slot) in row_networks.iter_mut().enumerate() {
            let index = model.network_of_row(row).ok_or(mismatch)?;
            *slot = model.networks().nth(index).ok_or(mismatch)?;
        }
        Ok(Self { model, row_networks, kernel: PhantomData })
    }

    /// What is known of the model beyond its weights.
    #[must_use]
    pub fn metadata(&self) -> &Metadata<'a> {
        self.model.metadata()
    }

    /// CRC-32 of the blob: tells which model is in force.
    #[must_use]
    pub fn model_crc(&self) -> u32 {
        self.model.crc()
    }

    /// Decodes one frame. A row with a missing reading is marked and does not touch the others.
    #[must_use]
    pub fn decode(&self, frame: &Frame<ROWS, COLS>) -> Estimate<ROWS, OUTPUTS> {
        let mut estimate = Estimate {
            outputs: [[f32::NAN; OUTPUTS]; ROWS],
            status: [RowStatus::MissingReading; ROWS],
        };
        let rows = self.row_networks.iter().zip(&frame.row_column_resistance_ohm);
        let places = estimate.outputs.iter_mut().zip(&mut estimate.status);
        for ((network, readings), (outputs, status)) in rows.zip(places) {
            if !readings.iter().all(|r| r.is_finite()) {
                continue;
            }
            // The shape was checked when the blob was loaded.
            if let Ok(inferred) = network.infer_array::<E, COLS, OUTPUTS>(readings) {
                if inferred.iter().all(|y| y.is_finite()) {
                    *outputs = inferred;
                    *status = RowStatus::Decoded;
                } else {
                    *status = RowStatus::Overflow;
                }
            }
        }
        estimate
    }
}

//! From a frame to an estimate: the one entry the device calls.

use core::marker::PhantomData;

use crate::blob::{DecodeError, Metadata, Model, ModelShape};
use crate::exp::{ExpKernel, Polynomial};
use crate::frame::Frame;

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
/// into the blob. The link check of the firmware holds it to the compiler.
#[must_use]
pub const fn decoder_ram_bytes(rows: usize) -> usize {
    128 + 8 * rows
}

/// A model ready to decode frames of a sensor whose sizes are known when compiled.
///
/// Any number of centres K is served: it comes with the blob. RAM: a slice a row; the weights stay
/// where the blob lies.
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
    /// Where each row's network is.
    row_sections: [&'a [u8]; ROWS],
    kernel: PhantomData<E>,
}

impl<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize, E: ExpKernel>
    Decoder<'a, ROWS, COLS, OUTPUTS, E>
{
    /// Checks a blob as [`load`](Self::load) does, and leaves it at that.
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or its shape is not this decoder's.
    pub fn check(blob: &'a [u8]) -> Result<Model<'a>, DecodeError> {
        const { assert!(ROWS > 0 && COLS > 0 && OUTPUTS > 0, "a sensor has rows, columns, outputs") }
        let model = Model::decode(blob)?;
        let expected = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
        if model.shape() == expected {
            Ok(model)
        } else {
            Err(DecodeError::ShapeMismatch { expected, found: model.shape() })
        }
    }

    /// Loads a blob. It must lie at a multiple of four ([`Aligned`](crate::Aligned)).
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or its shape is not this decoder's.
    pub fn load(blob: &'a [u8]) -> Result<Self, DecodeError> {
        let model = Self::check(blob)?;
        let mut row_sections = [&[][..]; ROWS];
        for (row, section) in row_sections.iter_mut().enumerate() {
            // A sound model has a network for every row.
            let networks = model.network_count() as u8;
            *section = model.section_of_row(row).ok_or(DecodeError::UnknownNetwork {
                row,
                network: networks,
                networks,
            })?;
        }
        Ok(Self { model, row_sections, kernel: PhantomData })
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
        self.decode_into(frame, &mut estimate);
        estimate
    }

    /// As [`decode`](Self::decode), into an estimate that is there already.
    pub fn decode_into(&self, frame: &Frame<ROWS, COLS>, estimate: &mut Estimate<ROWS, OUTPUTS>) {
        let rows = self.row_sections.iter().zip(&frame.row_column_resistance_ohm);
        let places = estimate.outputs.iter_mut().zip(&mut estimate.status);
        for (row, ((section, readings), (outputs, status))) in rows.zip(places).enumerate() {
            *outputs = [f32::NAN; OUTPUTS];
            *status = RowStatus::MissingReading;
            if !readings.iter().all(|r| r.is_finite()) {
                continue;
            }
            // Both are there: the blob was checked when it was loaded.
            let Some(network) = self.model.network_in(section, row) else { continue };
            if let Ok(inferred) = network.infer_array::<E, COLS, OUTPUTS>(readings) {
                if inferred.iter().all(|y| y.is_finite()) {
                    *outputs = inferred;
                    *status = RowStatus::Decoded;
                } else {
                    *status = RowStatus::Overflow;
                }
            }
        }
    }
}

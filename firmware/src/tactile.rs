//! A sensor with the model that is in force for it.

use model_core::blob::{DecodeError, Metadata};
use model_core::exp::{ExpKernel, Polynomial};
use model_core::{Decoder, Estimate, Frame, Gate};

/// The paper's sensor: 8 row-wires, 18 column-wires, and 18 outputs a row (three axes of six
/// electrodes).
pub type PaperSensor<'a, E = Polynomial> = Tactile<'a, 8, 18, 18, E>;

/// A tactile sensor of `ROWS` × `COLS` wires with the model in force for it, which gives `OUTPUTS`
/// quantities a row.
///
/// There is no state without a model: one that cannot be loaded makes no sensor, and one that
/// cannot be exchanged leaves the one before. `E` is the [exp kernel](model_core::exp). RAM: see
/// [`decoder_ram_bytes`](model_core::decoder_ram_bytes); the weights stay where the blob lies.
///
/// ```
/// use firmware::Tactile;
/// use model_core::blob::DecodeError;
/// use model_core::{Aligned, Frame};
/// # use model_core::blob::{Columns, Floats, Metadata, ModelParts, NoiseKind, encode};
/// # use model_core::rbf::{Shape, direct::{Network, Parameters}};
/// # let network = Network::try_new(
/// #     Shape { inputs: 2, centres: 1, outputs: 1 },
/// #     Parameters {
/// #         input_minimum: &[50.0, 50.0],
/// #         input_per_span: &[0.1, 0.1],
/// #         centres: &[0.5, 0.5],
/// #         decay: &[2.0],
/// #         output_weights: &[0.5],
/// #         bias: &[0.25],
/// #         affine: &[],
/// #     },
/// # )
/// # .unwrap();
/// # let metadata = Metadata {
/// #     name: "example",
/// #     scene_digest: 0,
/// #     noise_kind: NoiseKind::None,
/// #     noise_level: 0.0,
/// #     seed: 0,
/// #     training_frames: 0,
/// #     thickness_mm: 5.0,
/// #     input_names: Columns("r1c1_ohm\nr1c2_ohm"),
/// #     input_units: Columns("ohm\nohm"),
/// #     output_names: Columns("r1e1_dz_mm"),
/// #     output_units: Columns("mm"),
/// #     training_rmse: Floats(&[0; 4]),
/// #     full_scale: Floats(&[0; 4]),
/// # };
/// # let parts = ModelParts { projection: None, networks: &[network.into()], row_network: &[0], metadata };
/// # let mut buffer = Aligned([0; 512]);
/// # let blob: &[u8] = encode(&parts, &mut buffer.0).unwrap();
/// // `blob` holds a model of one row with two readings (Ω) and one output (mm).
/// let mut sensor: Tactile<1, 2, 1> = Tactile::load(blob)?;
/// let in_force = sensor.model_crc();
///
/// let frame = Frame { row_column_resistance_ohm: [[55.0, 55.0]] };
/// assert_eq!(sensor.decode(&frame).outputs, [[0.75]]); // mm
///
/// // Half a download is refused, and the sensor decodes as before.
/// assert!(matches!(sensor.replace(&blob[..100]), Err(DecodeError::Truncated { .. })));
/// assert_eq!(sensor.model_crc(), in_force);
/// assert_eq!(sensor.decode(&frame).outputs, [[0.75]]);
/// # Ok::<(), DecodeError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Tactile<
    'a,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    E: ExpKernel = Polynomial,
> {
    decoder: Decoder<'a, ROWS, COLS, OUTPUTS, E>,
}

impl<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize, E: ExpKernel>
    Tactile<'a, ROWS, COLS, OUTPUTS, E>
{
    /// Starts with the model in `blob`, which must lie at a multiple of four. For a blob in a
    /// larger flash slot see [`blob_in_slot`](crate::store::blob_in_slot).
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or its shape is not this sensor's.
    pub fn load(blob: &'a [u8]) -> Result<Self, DecodeError> {
        Ok(Self { decoder: Decoder::load(blob)? })
    }

    /// Checks `blob` as [`load`](Self::load) does, and leaves it at that: the CRC-32 of its model.
    ///
    /// # Errors
    /// As for [`load`](Self::load).
    pub fn check(blob: &'a [u8]) -> Result<u32, DecodeError> {
        Ok(Decoder::<ROWS, COLS, OUTPUTS, E>::check(blob)?.crc())
    }

    /// Puts the model in `blob` in force from the next frame on.
    ///
    /// # Errors
    /// As for [`load`](Self::load); the previous model then stays in force.
    pub fn replace(&mut self, blob: &'a [u8]) -> Result<(), DecodeError> {
        self.decoder = Decoder::load(blob)?;
        Ok(())
    }

    /// Decodes one frame of readings in Ω into outputs in the model's units.
    ///
    /// A row with a missing reading (NaN) is marked, its outputs are NaN, and the other rows are
    /// not touched by it.
    #[must_use]
    pub fn decode(&self, frame: &Frame<ROWS, COLS>) -> Estimate<ROWS, OUTPUTS> {
        self.decoder.decode(frame)
    }

    /// As [`decode`](Self::decode), into an estimate that is there already.
    pub fn decode_into(&self, frame: &Frame<ROWS, COLS>, estimate: &mut Estimate<ROWS, OUTPUTS>) {
        self.decoder.decode_into(frame, estimate);
    }

    /// As [`decode_into`](Self::decode_into), but rows that `gate` finds at rest are not inferred.
    pub fn decode_gated_into(
        &self,
        frame: &Frame<ROWS, COLS>,
        gate: Option<Gate<'_, ROWS, COLS, OUTPUTS>>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        self.decoder.decode_gated_into(frame, gate, estimate);
    }

    /// CRC-32 of the blob in force: tells host and board that they mean the same model.
    #[must_use]
    pub fn model_crc(&self) -> u32 {
        self.decoder.model_crc()
    }

    /// What is known of the model in force: its origin, its columns with their units, its errors
    /// in training.
    #[must_use]
    pub fn metadata(&self) -> &Metadata<'a> {
        self.decoder.metadata()
    }
}

#[cfg(test)]
mod tests;

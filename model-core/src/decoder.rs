//! Decoding a frame to an estimate: the one entry point for a device.

use crate::blob::{DecodeError, Metadata, Model, ModelShape, NetworkSection};
use crate::cortex_m4::Finite;
use crate::estimate::{Estimate, RowStatus};
use crate::exp::{ExpKernel, Polynomial};
use crate::frame::Frame;
use crate::gate::Gate;
use crate::projection::Projection;
use crate::rbf::expanded::Expanded;
use crate::rbf::fixed16::Fixed16;
use crate::rbf::{Format, NetworkError};

/// RAM in bytes that a [`Decoder`] of so many `rows` takes on a 32-bit target, for any K: slices into the
/// blob. The firmware's link check compares it with the compiler's own figure.
#[must_use]
pub const fn decoder_ram_bytes(rows: usize) -> usize {
    136 + 16 * rows
}

/// Decodes frames of a sensor whose sizes are known at compile time, with the model of a blob.
///
/// The number of centres K comes with the blob and may be any. The decoder keeps references to each row's
/// weights in RAM ([`decoder_ram_bytes`]); the weights stay in the blob.
///
/// A decoder borrows its blob and always has a model: a blob that is not sound makes no decoder, and changes no
/// existing one.
///
/// ```
/// use model_core::blob::DecodeError;
/// use model_core::{Aligned, Decoder, Frame};
/// # use model_core::blob::{Metadata, ModelParts, ModelShape, encode};
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
/// # let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
/// # let metadata = Metadata::unnamed(shape);
/// # let parts = ModelParts { projection: None, networks: &[network.into()], row_network: &[0], metadata };
/// # let mut buffer = Aligned([0; 512]);
/// # let blob: &[u8] = encode(&parts, &mut buffer.0).unwrap();
/// // `blob` holds a model of one row with two readings (Ω) and one output (mm).
/// let decoder: Decoder<1, 2, 1> = Decoder::load(blob)?;
///
/// let frame = Frame { row_column_resistance_ohm: [[55.0, 55.0]] };
/// assert_eq!(decoder.decode(&frame).outputs, [[0.75]]); // mm
///
/// // Half a download is rejected.
/// let half = Decoder::<1, 2, 1>::load(&blob[..blob.len() / 2]);
/// assert!(matches!(half, Err(DecodeError::Truncated { .. })));
/// # Ok::<(), DecodeError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Decoder<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize> {
    model: Model<'a>,
    /// The section of each row's network.
    row_sections: [NetworkSection<'a>; ROWS],
}

impl<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize>
    Decoder<'a, ROWS, COLS, OUTPUTS>
{
    /// Checks a blob as [`load`](Self::load) does, and returns its model without making a decoder.
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or its shape is not this decoder's.
    pub fn check(blob: &'a [u8]) -> Result<Model<'a>, DecodeError> {
        Self::of_this_shape(Model::decode(blob)?)
    }

    fn of_this_shape(model: Model<'a>) -> Result<Model<'a>, DecodeError> {
        const { assert!(ROWS > 0 && COLS > 0 && OUTPUTS > 0, "a sensor has rows, columns, outputs") }
        let expected = ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS };
        if model.shape() == expected {
            Ok(model)
        } else {
            Err(DecodeError::ShapeMismatch { expected, found: model.shape() })
        }
    }

    /// Loads a blob, which must lie at a multiple of four ([`Aligned`](crate::Aligned)).
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or its shape is not this decoder's.
    pub fn load(blob: &'a [u8]) -> Result<Self, DecodeError> {
        Self::of(Model::decode(blob)?)
    }

    /// Makes a decoder of a model that has been parsed already.
    ///
    /// # Errors
    /// [`DecodeError::ShapeMismatch`]: the model's shape is not this decoder's.
    pub fn of(model: Model<'a>) -> Result<Self, DecodeError> {
        let model = Self::of_this_shape(model)?;
        let mut row_sections = [NetworkSection::EMPTY; ROWS];
        for (row, section) in row_sections.iter_mut().enumerate() {
            // A sound model has a network for every row.
            let networks = model.network_count() as u8;
            *section = model.section_of_row(row).ok_or(DecodeError::UnknownNetwork {
                row,
                network: networks,
                networks,
            })?;
        }
        Ok(Self { model, row_sections })
    }

    /// Metadata of the model: names, units, and how it was trained.
    #[must_use]
    pub fn metadata(&self) -> &Metadata<'a> {
        self.model.metadata()
    }

    /// CRC-32 of the blob: a fingerprint that identifies the model.
    #[must_use]
    pub fn model_crc(&self) -> u32 {
        self.model.crc()
    }

    /// Decodes one frame (Ω) to an estimate in the units of the model's outputs.
    ///
    /// A row with a missing reading is marked in the estimate's status and does not affect the other rows. Behind
    /// a [`Projection`] one missing reading marks all rows.
    #[must_use]
    pub fn decode(&self, frame: &Frame<ROWS, COLS>) -> Estimate<ROWS, OUTPUTS> {
        let mut estimate = Estimate {
            outputs: [[f32::NAN; OUTPUTS]; ROWS],
            status: [RowStatus::MissingReading; ROWS],
        };
        self.decode_into(frame, &mut estimate);
        estimate
    }

    /// Decodes one frame as [`decode`](Self::decode) does, into an existing estimate.
    pub fn decode_into(&self, frame: &Frame<ROWS, COLS>, estimate: &mut Estimate<ROWS, OUTPUTS>) {
        self.decode_gated_into(frame, None, estimate);
    }

    /// Decodes one frame as [`decode_into`](Self::decode_into) does, but skips rows that `gate` finds at rest:
    /// they get the outputs at rest. All other rows are decoded as without a gate, to the bit.
    ///
    /// Behind a [`Projection`], rows are not gated one by one: all are at rest, or all are decoded. A reading that
    /// is missing anywhere marks them all.
    #[inline]
    pub fn decode_gated_into(
        &self,
        frame: &Frame<ROWS, COLS>,
        gate: Option<Gate<'_, ROWS, COLS, OUTPUTS>>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        self.decode_with::<Polynomial>(frame, gate, estimate);
    }

    /// Decodes one frame as [`decode_gated_into`](Self::decode_gated_into) does, with the
    /// [exponential](crate::exp) `E` for networks of the format `f32-direct`. It serves to measure what an
    /// exponential costs; other formats have one of their own.
    #[inline(never)] // one copy of inference in flash, whoever decodes
    pub fn decode_with<E: ExpKernel>(
        &self,
        frame: &Frame<ROWS, COLS>,
        gate: Option<Gate<'_, ROWS, COLS, OUTPUTS>>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        if let Some(projection) = self.model.projection() {
            return self.decode_array_into::<E>(projection, frame, gate, estimate);
        }
        let rows = self.row_sections.iter().zip(&frame.row_column_resistance_ohm);
        let places = estimate.outputs.iter_mut().zip(&mut estimate.status);
        let mut scaled = [0.0; COLS];
        for (row, ((section, readings), (outputs, status))) in rows.zip(places).enumerate() {
            if gate.is_some_and(|gate| gate.give_rest(row, readings, outputs)) {
                *status = RowStatus::AtRest;
                continue;
            }
            *status = decode_inputs(section, E::exp, readings, &mut scaled, outputs);
            if *status != RowStatus::Decoded {
                *outputs = [f32::NAN; OUTPUTS];
            }
        }
    }

    /// Decodes all rows by one network behind `projection`. Not inlined, because decoding by rows would need its
    /// stack too.
    #[inline(never)]
    fn decode_array_into<E: ExpKernel>(
        &self,
        projection: Projection<'_>,
        frame: &Frame<ROWS, COLS>,
        gate: Option<Gate<'_, ROWS, COLS, OUTPUTS>>,
        estimate: &mut Estimate<ROWS, OUTPUTS>,
    ) {
        let readings = &frame.row_column_resistance_ohm;
        let mut rows = readings.iter().zip(&mut estimate.outputs).enumerate();
        let at_rest = gate.is_some_and(|gate| {
            rows.all(|(row, (readings, outputs))| gate.give_rest(row, readings, outputs))
        });
        let mut status = match self.row_sections.first() {
            _ if at_rest => RowStatus::AtRest,
            Some(section) => {
                let (mut features, mut scaled) = ([0.0; COLS], [0.0; COLS]);
                projection.project(readings.as_flattened(), &mut features);
                let outputs = estimate.outputs.as_flattened_mut();
                decode_inputs(section, E::exp, &features, &mut scaled, outputs)
            }
            None => RowStatus::MissingReading,
        };
        if !matches!(status, RowStatus::Decoded | RowStatus::AtRest) {
            // Features can overflow although no reading is missing.
            if all_finite(readings.as_flattened()) {
                status = RowStatus::Overflow;
            }
            estimate.outputs.as_flattened_mut().fill(f32::NAN);
        }
        estimate.status = [status; ROWS];
    }
}

/// Infers the outputs of a row, or of all rows at once, and returns their status.
///
/// Neither generic nor inlined on a device: it is thus compiled with this crate, for speed, while the rest of an
/// image is compiled for size.
#[cfg_attr(cortex_m4f, inline(never))]
#[cfg_attr(
    not(cortex_m4f),
    inline(always),
    expect(
        clippy::inline_always,
        reason = "so that the compiler knows lengths and the exponential"
    )
)]
fn decode_inputs(
    section: &NetworkSection<'_>,
    exp: fn(f32) -> f32,
    inputs: &[f32],
    scaled: &mut [f32],
    outputs: &mut [f32],
) -> RowStatus {
    let shape = ModelShape { rows: 1, inputs: inputs.len(), outputs: outputs.len() };
    let finite = match section.format() {
        Format::F32Direct => return decode_direct(section, exp, inputs, scaled, outputs),
        Format::F32 => {
            section.packed::<Expanded>(shape).map(|it| it.infer(inputs, scaled, outputs))
        }
        Format::Fixed16 => {
            section.packed::<Fixed16>(shape).map(|it| it.infer(inputs, scaled, outputs))
        }
    };
    status_of(finite, inputs)
}

/// The status of a row in a format whose outputs cannot overflow; that is checked when a model is loaded.
#[inline(always)]
#[expect(clippy::inline_always, reason = "an enum that need not be made")]
fn status_of(finite: Result<Finite, NetworkError>, inputs: &[f32]) -> RowStatus {
    match finite {
        Ok(Finite::Known) => RowStatus::Decoded,
        Ok(Finite::Unknown) if all_finite(inputs) => RowStatus::Decoded,
        // No error can occur: the network and its sizes were checked when the model was loaded.
        Ok(Finite::Unknown) | Err(_) => RowStatus::MissingReading,
    }
}

/// Infers the outputs of a network in `f32-direct`, which has no assembly routine, and returns their status.
#[cfg_attr(cortex_m4f, inline(never))]
#[cfg_attr(
    not(cortex_m4f),
    inline(always),
    expect(clippy::inline_always, reason = "so that the compiler knows the exponential")
)]
fn decode_direct(
    section: &NetworkSection<'_>,
    exp: fn(f32) -> f32,
    inputs: &[f32],
    scaled: &mut [f32],
    outputs: &mut [f32],
) -> RowStatus {
    let shape = ModelShape { rows: 1, inputs: inputs.len(), outputs: outputs.len() };
    let Ok(network) = section.direct(shape) else { return RowStatus::MissingReading };
    if !all_finite(inputs) {
        return RowStatus::MissingReading;
    }
    network.scale(inputs, scaled);
    network.infer_scaled(scaled, outputs, exp);
    if all_finite(outputs) { RowStatus::Decoded } else { RowStatus::Overflow }
}

/// Whether all `values` are finite, by the carry out of the exponent, without a branch for each.
#[inline(never)]
fn all_finite(values: &[f32]) -> bool {
    const EXPONENT: u32 = 0x7F80_0000;
    const LAST_PLACE: u32 = 0x0080_0000;
    let carries = |bits: u32| (bits & EXPONENT) + LAST_PLACE;
    values.iter().fold(0, |carry, value| carry | carries(value.to_bits())) >> 31 == 0
}

#[cfg(test)]
mod tests {
    use super::all_finite;

    #[test]
    fn numbers_that_are_not_finite_are_found_anywhere() {
        let finite = [0.0, -0.0, 1.0, f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, -1e-45];
        assert!(all_finite(&finite));
        for place in 0..finite.len() {
            for other in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut values = finite;
                values[place] = other;
                assert!(!all_finite(&values), "{other} at {place}");
            }
        }
    }
}

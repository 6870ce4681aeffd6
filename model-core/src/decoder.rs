//! Decoding a frame to an estimate: the one entry point for a device.

use crate::blob::{DecodeError, Front, MOST_FRONTS, Metadata, Model, ModelShape};
use crate::estimate::Estimate;
#[cfg(feature = "std")]
use crate::estimate::RowStatus;
use crate::frame_decoder::{Frame, FrameDecoder, Networks, floats_of_front, floats_of_rows};
use crate::infer::RowNetwork;
use crate::rbf::NetworkError;

/// RAM in bytes that a [`Decoder`] for at most so many `rows` takes on a 32-bit target, for any K: slices into the
/// blob. The emulator's application compares it with the compiler's own figure.
pub const fn decoder_ram_bytes(rows: usize) -> usize {
    let of_rows = 24 * rows;
    let of_frames = 52 * MOST_FRONTS;
    136 + if of_rows > of_frames { of_rows } else { of_frames }
}

/// Decodes frames with the model of a blob.
///
/// The numbers of rows, inputs, outputs and centres come with the blob, and may be any. `ROWS` is the largest number
/// of rows that the decoder has room for: it keeps references to each row's weights in RAM
/// ([`decoder_ram_bytes`]). The weights stay in the blob.
///
/// A decoder borrows its blob and always has a model: a blob that is not sound makes no decoder, and changes no
/// existing one.
///
/// ```
/// use taxel_core::blob::DecodeError;
/// use taxel_core::{Aligned, Decoder, Estimate, Frame, RowStatus};
/// # use taxel_core::blob::{Metadata, ModelParts, ModelShape, encode};
/// # use taxel_core::rbf::{Shape, float32::{Network, Parameters}};
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
/// # let (metadata, networks) = (Metadata::unnamed(shape), [network.into()]);
/// # let parts = ModelParts::new(&networks, &[0], metadata);
/// # let mut buffer = Aligned([0; 512]);
/// # let blob: &[u8] = encode(&parts, &mut buffer.0).unwrap();
/// // `blob` holds a model of one row with two readings (Ω) and one output (mm), called `y`.
/// let decoder = Decoder::<8>::load(blob)?;
/// assert_eq!(decoder.shape().inputs, 2);
///
/// let (mut outputs, mut status) = ([0.0; 1], [RowStatus::MissingReading; 1]);
/// let mut scratch = [0.0; 2]; // as many numbers as `scratch_floats` says
/// let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
/// decoder.decode_into(Frame::from(&[55.0, 55.0][..]), &mut scratch, &mut estimate).unwrap();
/// let y = decoder.metadata().output_names.position("y").unwrap();
/// assert_eq!(outputs[y], 0.75); // mm
///
/// // Half a download is rejected.
/// let half = Decoder::<8>::load(&blob[..blob.len() / 2]);
/// assert!(matches!(half, Err(DecodeError::Truncated { .. })));
/// # Ok::<(), DecodeError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Decoder<'a, const ROWS: usize> {
    model: Model<'a>,
    networks: OwnNetworks<'a, ROWS>,
}

/// Networks of a blob.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "of eight rows, both are about as large")]
enum OwnNetworks<'a, const ROWS: usize> {
    /// Each row's network; rows beyond the model's have none.
    OfRows([RowNetwork<'a>; ROWS]),
    /// Networks that see whole frames, each with its front.
    OfFrames([(Front<'a>, RowNetwork<'a>); MOST_FRONTS]),
}

impl<'a, const ROWS: usize> Decoder<'a, ROWS> {
    /// Loads a blob, which must lie at a multiple of four ([`Aligned`](crate::Aligned)).
    ///
    /// # Errors
    /// [`DecodeError`]: the blob is unsound, or has more rows than `ROWS`.
    pub fn load(blob: &'a [u8]) -> Result<Self, DecodeError> {
        Self::new(Model::decode(blob)?)
    }

    /// Makes a decoder of a model that has been parsed already.
    ///
    /// # Errors
    /// [`DecodeError::TooManyRows`]: the model has more rows than `ROWS`.
    pub fn new(model: Model<'a>) -> Result<Self, DecodeError> {
        let ModelShape { rows, .. } = model.shape();
        if rows > ROWS {
            return Err(DecodeError::TooManyRows { most: ROWS, found: rows });
        }
        let mut networks = if model.whole_frames() {
            OwnNetworks::OfFrames([(Front::NONE, RowNetwork::NONE); MOST_FRONTS])
        } else {
            OwnNetworks::OfRows([RowNetwork::NONE; ROWS])
        };
        for (index, part) in model.parts().enumerate() {
            let network = RowNetwork::new(part.section, part.shape)
                .map_err(|cause| DecodeError::Network { index: index as u8, cause })?;
            match &mut networks {
                OwnNetworks::OfFrames(places) => {
                    if let Some(place) = places.get_mut(index) {
                        *place = (part.front, network);
                    }
                }
                OwnNetworks::OfRows(places) => {
                    for (row, place) in places.iter_mut().enumerate() {
                        if model.network_of_row(row) == Some(index) {
                            *place = network;
                        }
                    }
                }
            }
        }
        Ok(Self { model, networks })
    }

    /// The model that the decoder was made of.
    pub fn model(&self) -> &Model<'a> {
        &self.model
    }

    /// The model's number of rows, and of inputs and outputs a row.
    pub fn shape(&self) -> ModelShape {
        self.model.shape()
    }

    /// Metadata of the model: names, units, and how it was trained.
    pub fn metadata(&self) -> &Metadata<'a> {
        self.model.metadata()
    }

    /// CRC-32 of the blob: a fingerprint that identifies the model.
    pub fn model_crc(&self) -> u32 {
        self.model.crc()
    }

    /// Number of floats of working space that decoding and assessing need.
    pub fn scratch_floats(&self) -> usize {
        scratch_floats(&self.model)
    }

    /// Decodes one frame to an estimate in the units of the model's outputs.
    ///
    /// `scratch` is working space of [`scratch_floats`](Self::scratch_floats). A row with a missing reading is marked
    /// in the estimate's status and does not affect the other rows. Where networks see whole frames, one missing reading
    /// marks all rows.
    ///
    /// Returns whether an input of a decoded row was clamped, because it lies far beyond the training range: more than
    /// an eighth of it below, or an eighth or more above. Such outputs are guesses; on many frames they mean a model of
    /// another sensor. Behind a [projection](crate::projection) the inputs are its features.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a slice does not have the model's length, or `scratch` is too short; the estimate
    /// is then untouched.
    #[inline]
    pub fn decode_into(
        &self,
        frame: Frame<'_>,
        scratch: &mut [f32],
        estimate: &mut Estimate<'_>,
    ) -> Result<bool, NetworkError> {
        let networks = match &self.networks {
            OwnNetworks::OfRows(networks) => Networks::OfRows(networks),
            OwnNetworks::OfFrames(networks) => {
                let count = self.model.network_count();
                Networks::OfFrames(networks.get(..count).unwrap_or_default())
            }
        };
        let relative = self.metadata().relative_inputs;
        decode_blob(
            &FrameDecoder { shape: self.shape(), relative, networks },
            frame,
            scratch,
            estimate,
        )
    }

    /// Replaces missing readings of a frame (Ω) by those expected from the others, by the model's
    /// [reading model](crate::reading_model). Returns the number of readings that were filled; 0 if the model has none.
    ///
    /// A model with relative inputs takes the `reciprocals` of the baseline ([`Frame`]), which others ignore. `scratch` is
    /// working space of [`scratch_floats`](Self::scratch_floats).
    pub fn fill(
        &self,
        readings_ohm: &mut [f32],
        reciprocals: &[f32],
        scratch: &mut [f32],
    ) -> usize {
        let reciprocals = self.metadata().relative_inputs.then_some(reciprocals);
        self.model.reading_model().map_or(0, |it| it.fill(readings_ohm, reciprocals, scratch))
    }

    /// Estimates how far off the outputs of a frame may be, and how novel the frame is, by the model's
    /// [reading model](crate::reading_model). Returns its novelty in nats: above 0, it is unlike the frames of training.
    /// `None` if the model does not estimate it; nothing is written then.
    ///
    /// `deviation` takes a standard deviation for each of the `rows × outputs` outputs, in their units. If a reading
    /// of the frame is missing, all of them and the novelty are NaN.
    /// `scratch` is working space of [`scratch_floats`](Self::scratch_floats).
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a slice does not have the model's length, or `scratch` is too short; nothing is
    /// written then.
    pub fn assess_into(
        &self,
        frame: Frame<'_>,
        scratch: &mut [f32],
        deviation: &mut [f32],
    ) -> Result<Option<f32>, NetworkError> {
        let reciprocals = self.metadata().relative_inputs.then_some(frame.reciprocals);
        match self.model.reading_model() {
            Some(it) => it.assess(frame.readings_ohm, reciprocals, scratch, deviation),
            None => Ok(None),
        }
    }
}

/// Decodes one frame with the networks of a blob.
///
/// Neither generic nor inlined on a device: it is thus compiled with this crate, for speed, while the rest of an
/// image is compiled for size.
#[cfg_attr(cortex_m4f, inline(never))]
#[cfg_attr(not(cortex_m4f), inline(always))]
fn decode_blob(
    decoder: &FrameDecoder<'_, '_, RowNetwork<'_>>,
    frame: Frame<'_>,
    scratch: &mut [f32],
    estimate: &mut Estimate<'_>,
) -> Result<bool, NetworkError> {
    decoder.decode(frame, scratch, estimate)
}

/// Number of floats of working space that decoding with `model` needs, assessing its outputs, and filling its readings.
pub fn scratch_floats(model: &Model<'_>) -> usize {
    let of_readings = model.reading_model().map_or(0, |it| it.sizes().scratch_floats());
    decoding_floats(model).max(of_readings)
}

/// Number of floats of working space that decoding with `model` needs.
fn decoding_floats(model: &Model<'_>) -> usize {
    let ModelShape { rows, inputs, .. } = model.shape();
    let relative = model.metadata().relative_inputs;
    if !model.whole_frames() {
        return floats_of_rows(inputs, relative);
    }
    let readings = inputs.saturating_mul(rows);
    model.fronts().map(|front| floats_of_front(&front, readings, relative)).max().unwrap_or(0)
}

/// An estimate of its own, on the heap.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq)]
pub struct OwnedEstimate {
    /// `rows × outputs` numbers, row after row; NaN where a row could not be decoded.
    pub outputs: std::vec::Vec<f32>,
    /// Status of each row.
    pub status: std::vec::Vec<RowStatus>,
}

#[cfg(feature = "std")]
impl OwnedEstimate {
    /// The estimate as a decoder writes it.
    pub fn borrowed(&mut self) -> Estimate<'_> {
        Estimate { outputs: &mut self.outputs, status: &mut self.status }
    }
}

#[cfg(feature = "std")]
impl<const ROWS: usize> Decoder<'_, ROWS> {
    /// Decodes one frame as [`decode_into`](Self::decode_into) does, to an estimate on the heap.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if the frame does not have `rows × inputs` readings.
    pub fn decode<'f>(&self, frame: impl Into<Frame<'f>>) -> Result<OwnedEstimate, NetworkError> {
        let ModelShape { rows, outputs, .. } = self.shape();
        let mut estimate = OwnedEstimate {
            outputs: std::vec![f32::NAN; rows * outputs],
            status: std::vec![RowStatus::MissingReading; rows],
        };
        let mut scratch = std::vec![0.0; self.scratch_floats()];
        self.decode_into(frame.into(), &mut scratch, &mut estimate.borrowed())?;
        Ok(estimate)
    }
}

//! Decoding a frame to an estimate: the one entry point for a device.

use crate::blob::{DecodeError, Front, MOST_FRONTS, Metadata, Model, ModelShape};
#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::estimate::{Estimate, RowStatus};
use crate::infer::{Infer, Row, RowNetwork, all_finite};
use crate::rbf::NetworkError;
use crate::relative::relative;
use crate::touch::{Kind, Touch};

/// RAM in bytes that a [`Decoder`] for at most so many `rows` takes on a 32-bit target, for any K: slices into the
/// blob. The emulator's application compares it with the compiler's own figure.
pub const fn decoder_ram_bytes(rows: usize) -> usize {
    let of_rows = 24 * rows;
    let of_frames = 52 * MOST_FRONTS;
    136 + if of_rows > of_frames { of_rows } else { of_frames }
}

/// A frame to be decoded, and what is known of the sensor at rest.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'f> {
    /// `rows × inputs` readings in Ω, row after row; NaN is missing.
    pub readings_ohm: &'f [f32],
    /// [Reciprocals](crate::relative::reciprocal) of the baseline, one a reading, for a model with relative inputs.
    /// A reading without one is missing. Other models ignore them.
    pub reciprocals: &'f [f32],
}

impl<'f> From<&'f [f32]> for Frame<'f> {
    /// Readings in Ω, without a baseline.
    fn from(readings_ohm: &'f [f32]) -> Self {
        Self { readings_ohm, reciprocals: &[] }
    }
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
    /// Networks that see whole frames, and what stands before each.
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

    /// Replaces missing readings of a frame (Ω) by those expected of the others, by the model's
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

    /// Tells how far off the outputs of a frame may be, and how novel the frame is, by the model's
    /// [reading model](crate::reading_model). Returns its novelty in nats: above 0, it is unlike the frames of training.
    /// `None` if the model does not tell it; nothing is written then.
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

/// Networks of a model, with what each is given.
#[derive(Debug, Clone, Copy)]
pub enum Networks<'n, 'a, N> {
    /// A network for each row.
    OfRows(&'n [N]),
    /// Networks that see whole frames, and what stands before each. Each gives the outputs that follow those of the network
    /// before.
    OfFrames(&'n [(Front<'a>, N)]),
}

/// What decodes frames, wherever its networks lie.
#[derive(Debug, Clone, Copy)]
pub struct FrameDecoder<'n, 'a, N> {
    pub shape: ModelShape,
    /// Whether inputs are relative to the baseline.
    pub relative: bool,
    pub networks: Networks<'n, 'a, N>,
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

impl<N: Infer> FrameDecoder<'_, '_, N> {
    /// Decodes one frame as [`Decoder::decode_into`] does.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a slice does not have the model's length, or `scratch` is too short.
    #[inline(always)]
    pub fn decode(
        &self,
        frame: Frame<'_>,
        scratch: &mut [f32],
        estimate: &mut Estimate<'_>,
    ) -> Result<bool, NetworkError> {
        let ModelShape { rows, inputs, outputs } = self.shape;
        // A model has a name for each, so that no product overflows.
        check_length("frame", frame.readings_ohm, rows.wrapping_mul(inputs))?;
        check_length("outputs of the estimate", estimate.outputs, rows.wrapping_mul(outputs))?;
        check_length("status of the estimate", estimate.status, rows)?;
        let too_short = |expected, found| NetworkError::Length { what: "scratch", expected, found };
        match self.networks {
            Networks::OfFrames(networks) => {
                let readings = frame.readings_ohm.len();
                let floats =
                    |(front, _): &(Front<'_>, N)| floats_of_front(front, readings, self.relative);
                let expected = networks.iter().map(floats).max().unwrap_or(0);
                let found = scratch.len();
                // No more than that: what is left behind the parts below is readings relative to the baseline, to the last.
                let scratch =
                    scratch.get_mut(..expected).ok_or_else(|| too_short(expected, found))?;
                let frames = WholeFrames { networks, relative: self.relative, rows };
                Ok(frames.decode(frame, scratch, estimate))
            }
            Networks::OfRows(networks) => {
                let expected = floats_of_rows(inputs, self.relative);
                let found = scratch.len();
                let scratch =
                    scratch.get_mut(..expected).ok_or_else(|| too_short(expected, found))?;
                let (scaled, more) = scratch
                    .split_at_mut_checked(inputs)
                    .ok_or_else(|| too_short(expected, found))?;
                let rows = Rows { networks, inputs, outputs };
                Ok(if self.relative {
                    rows.decode::<true>(frame, [scaled, more], estimate)
                } else {
                    rows.decode::<false>(frame, [scaled, more], estimate)
                })
            }
        }
    }
}

impl<N> FrameDecoder<'_, '_, N> {
    /// Number of floats of working space that decoding needs.
    #[inline(always)]
    pub const fn scratch_floats(&self) -> usize {
        let ModelShape { rows, inputs, .. } = self.shape;
        let mut fronts = match self.networks {
            Networks::OfRows(_) => return floats_of_rows(inputs, self.relative),
            Networks::OfFrames(networks) => networks,
        };
        let mut most = 0;
        while let [(front, _), rest @ ..] = fronts {
            let floats = floats_of_front(front, inputs.saturating_mul(rows), self.relative);
            if floats > most {
                most = floats;
            }
            fronts = rest;
        }
        most
    }
}

/// Networks that decode a frame row by row.
struct Rows<'d, N> {
    networks: &'d [N],
    /// Number of readings a row.
    inputs: usize,
    /// Number of outputs a row.
    outputs: usize,
}

impl<N: Infer> Rows<'_, N> {
    /// Decodes the rows of a frame. The scratch is room for scaled inputs, and for readings relative to the baseline if
    /// the networks take them (`RELATIVE`). Returns whether an input was clamped.
    #[inline(always)]
    fn decode<const RELATIVE: bool>(
        &self,
        frame: Frame<'_>,
        [scaled, ratios]: [&mut [f32]; 2],
        estimate: &mut Estimate<'_>,
    ) -> bool {
        let mut any_clamped = false;
        // A model has at least one input and one output a row; `max` tells the compiler.
        let readings = frame.readings_ohm.chunks_exact(self.inputs.max(1));
        let outputs = estimate.outputs.chunks_exact_mut(self.outputs.max(1));
        let places = outputs.zip(estimate.status.iter_mut());
        let rows = self.networks.iter().zip(readings).zip(places);
        for (row, ((network, readings), (outputs, status))) in rows.enumerate() {
            let given = if RELATIVE {
                let start = row.saturating_mul(self.inputs);
                divide(readings, frame.reciprocals.get(start..).unwrap_or_default(), ratios);
                &*ratios
            } else {
                readings
            };
            let scaled = &mut *scaled;
            any_clamped |= network.infer_row(Row { inputs: given, scaled, outputs, status });
        }
        any_clamped
    }
}

/// Writes the `readings` relative to the baseline to `ratios`, from the baseline's `reciprocals`; NaN where there
/// is none.
#[cfg_attr(cortex_m4f, inline(never))]
fn divide(readings: &[f32], reciprocals: &[f32], ratios: &mut [f32]) {
    ratios.fill(f32::NAN);
    for ((ratio, reading), reciprocal) in ratios.iter_mut().zip(readings).zip(reciprocals) {
        *ratio = relative(*reading, *reciprocal);
    }
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

/// Number of floats for decoding rows: scaled inputs, and readings relative to the baseline.
const fn floats_of_rows(inputs: usize, relative: bool) -> usize {
    inputs.saturating_add(if relative { inputs } else { 0 })
}

/// Number of floats for decoding whole frames of so many `readings` behind a `front`: scaled inputs, features, and shape
/// and strength or readings relative to the baseline.
const fn floats_of_front(front: &Front<'_>, readings: usize, relative: bool) -> usize {
    let seen = match &front.touch {
        Some(touch) => touch.inputs(),
        None if relative => readings,
        None => 0,
    };
    let features = match &front.projection {
        Some(projection) => projection.features(),
        None => 0,
    };
    front.inputs(readings).saturating_add(features).saturating_add(seen)
}

fn check_length<T>(what: &'static str, slice: &[T], expected: usize) -> Result<(), NetworkError> {
    let found = slice.len();
    if found == expected { Ok(()) } else { Err(NetworkError::Length { what, expected, found }) }
}

/// An estimate of its own, on the heap.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq)]
pub struct OwnedEstimate {
    /// `rows × outputs` numbers, row after row; NaN where a row could not be decoded.
    pub outputs: std::vec::Vec<f32>,
    /// How the decoding of each row ended.
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

/// Networks that see whole frames, each of which gives some of the outputs.
struct WholeFrames<'d, 'a, N> {
    networks: &'d [(Front<'a>, N)],
    /// Whether inputs are relative to the baseline.
    relative: bool,
    /// Number of rows, which share a status.
    rows: usize,
}

impl<N: Infer> WholeFrames<'_, '_, N> {
    /// Decodes a frame. Returns whether an input of a network was clamped, and the frame was decoded. Not inlined, because
    /// decoding by rows would need its stack too.
    #[inline(never)]
    fn decode(&self, frame: Frame<'_>, scratch: &mut [f32], estimate: &mut Estimate<'_>) -> bool {
        let mut rest = &mut *estimate.outputs;
        let (mut any_clamped, mut worst) = (false, RowStatus::Decoded);
        for (front, network) in self.networks {
            let Some((outputs, more)) = rest.split_at_mut_checked(front.outputs) else { break };
            rest = more;
            let (clamped, status) = self.decode_part(front, network, frame, scratch, outputs);
            any_clamped |= clamped && status == RowStatus::Decoded;
            if severity(status) > severity(worst) {
                worst = status;
            }
        }
        let statuses = estimate.status.get_mut(..self.rows).unwrap_or_default();
        statuses.fill(worst);
        any_clamped && severity(worst) < severity(RowStatus::Overflow)
    }

    /// Decodes the `outputs` of one network, and returns whether an input was clamped, and their status.
    #[inline(always)]
    fn decode_part(
        &self,
        front: &Front<'_>,
        network: &N,
        frame: Frame<'_>,
        scratch: &mut [f32],
        outputs: &mut [f32],
    ) -> (bool, RowStatus) {
        let readings = frame.readings_ohm;
        let missing = (false, RowStatus::MissingReading);
        let split = |scratch, at| <[f32]>::split_at_mut_checked(scratch, at);
        let Some((scaled, more)) = split(scratch, front.inputs(readings.len())) else {
            return missing;
        };
        let features = front.projection.map_or(0, |it| it.features());
        let Some((features, seen)) = split(more, features) else { return missing };
        let reciprocals = self.relative.then_some(frame.reciprocals);
        let mut strength = 0.0;
        let inputs = match (&front.touch, reciprocals) {
            (Some(touch), _) => {
                let Some(seen) = seen.get_mut(..touch.inputs()) else { return missing };
                strength = touch.apply(readings, reciprocals, seen);
                &*seen
            }
            (None, Some(reciprocals)) => {
                let Some(seen) = seen.get_mut(..readings.len()) else { return missing };
                divide(readings, reciprocals, seen);
                &*seen
            }
            (None, None) => readings,
        };
        let inputs = match front.projection {
            Some(projection) => {
                projection.project(inputs, features);
                &*features
            }
            None => inputs,
        };
        let mut status = RowStatus::Decoded;
        let row = Row { inputs, scaled, outputs: &mut *outputs, status: &mut status };
        let clamped = network.infer_row(row);
        // Features can overflow although no reading is missing.
        if status == RowStatus::MissingReading && self.is_complete(frame) {
            status = RowStatus::Overflow;
        }
        if let (Some(touch), RowStatus::Decoded) = (&front.touch, status) {
            status = with_strength(touch, strength, network.can_overflow(), outputs);
        }
        (clamped, status)
    }

    /// Whether no reading of a frame is missing, nor its baseline.
    #[cold]
    fn is_complete(&self, frame: Frame<'_>) -> bool {
        let has_baseline = frame.reciprocals.len() == frame.readings_ohm.len();
        all_finite(frame.readings_ohm)
            && (!self.relative || has_baseline && all_finite(frame.reciprocals))
    }
}

/// Makes `outputs` of a network what they are at this `strength`: amounts are multiplied by it, and places are NaN without a
/// touch. Returns their status.
#[inline(always)]
fn with_strength(
    touch: &Touch<'_>,
    strength: f32,
    can_overflow: bool,
    outputs: &mut [f32],
) -> RowStatus {
    let Some(factor) = touch.factor(strength) else {
        outputs.fill(f32::NAN);
        return RowStatus::NoTouch;
    };
    if touch.kind() == Kind::Place {
        return RowStatus::Decoded;
    }
    #[cfg(cortex_m4f)]
    cortex_m4::multiply(outputs, factor);
    #[cfg(not(cortex_m4f))]
    outputs.iter_mut().for_each(|output| *output *= factor);
    if can_overflow && !all_finite(outputs) {
        outputs.fill(f32::NAN);
        return RowStatus::Overflow;
    }
    RowStatus::Decoded
}

/// Order of the statuses of networks that see the same frame: that of the frame is the highest.
fn severity(status: RowStatus) -> u8 {
    match status {
        RowStatus::Decoded => 0,
        RowStatus::NoTouch => 1,
        RowStatus::Overflow => 2,
        RowStatus::MissingReading => 3,
    }
}

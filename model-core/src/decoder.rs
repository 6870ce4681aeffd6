//! Decoding a frame to an estimate: the one entry point for a device.

use crate::blob::{DecodeError, Front, MOST_FRONTS, Metadata, Model, ModelShape, NetworkSection};
#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::estimate::{Estimate, RowStatus};
use crate::rbf::{Format, NetworkError, fixed16};
use crate::relative::relative;
use crate::touch::{Kind, Touch};

/// RAM in bytes that a [`Decoder`] for at most so many `rows` takes on a 32-bit target, for any K: slices into the
/// blob. The emulator's application compares it with the compiler's own figure.
pub const fn decoder_ram_bytes(rows: usize) -> usize {
    let of_rows = 24 * rows;
    let of_frames = 52 * MOST_FRONTS;
    144 + if of_rows > of_frames { of_rows } else { of_frames }
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
    networks: Networks<'a, ROWS>,
}

/// Networks of a model.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "of eight rows, both are about as large")]
enum Networks<'a, const ROWS: usize> {
    /// Each row's network; rows beyond the model's have none.
    OfRows([RowNetwork<'a>; ROWS]),
    /// Networks that see whole frames, and what stands before each.
    OfFrames([(Front<'a>, RowNetwork<'a>); MOST_FRONTS]),
}

/// The network of a row, made ready when the model is loaded.
#[derive(Debug, Clone, Copy)]
enum RowNetwork<'a> {
    /// A network in `f32`, which is large: it is cut from its section for each row.
    F32(NetworkSection<'a>),
    /// A network in `fixed16`.
    Fixed16(fixed16::Network<'a>),
}

impl<'a> RowNetwork<'a> {
    /// No network: whatever it is given is missing.
    const NONE: Self = Self::F32(NetworkSection::EMPTY);

    fn new(section: NetworkSection<'a>, shape: ModelShape) -> Result<Self, NetworkError> {
        match section.format() {
            Format::F32 => Ok(Self::F32(section)),
            Format::Fixed16 => section.fixed16(shape).map(Self::Fixed16),
        }
    }
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
            Networks::OfFrames([(Front::NONE, RowNetwork::NONE); MOST_FRONTS])
        } else {
            Networks::OfRows([RowNetwork::NONE; ROWS])
        };
        for (index, part) in model.parts().enumerate() {
            let network = RowNetwork::new(part.section, part.shape)
                .map_err(|cause| DecodeError::Network { index: index as u8, cause })?;
            match &mut networks {
                Networks::OfFrames(places) => {
                    if let Some(place) = places.get_mut(index) {
                        *place = (part.front, network);
                    }
                }
                Networks::OfRows(places) => {
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
        let (of_rows, of_frames) = match &self.networks {
            Networks::OfRows(networks) => (&networks[..], &[][..]),
            Networks::OfFrames(networks) => (&[][..], &networks[..]),
        };
        decode(&self.model, of_rows, of_frames, frame, scratch, estimate)
    }

    /// Replaces missing readings of a frame (Ω) by those expected of the others, if the model can
    /// ([`fill`](crate::fill)). Returns the number of readings that were filled. `scratch` is working space of
    /// [`scratch_floats`](Self::scratch_floats).
    pub fn fill(&self, readings_ohm: &mut [f32], scratch: &mut [f32]) -> usize {
        self.model.fill().map_or(0, |fill| fill.fill(readings_ohm, scratch))
    }

    /// Tells how far off the outputs of a frame may be, and how novel the frame is, by the model's
    /// [confidence](crate::confidence). Returns its novelty in nats: above 0, it is unlike the frames of training. `None`
    /// if the model has no confidence; nothing is written then.
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
        assess(&self.model, frame, scratch, deviation)
    }
}

/// Assesses one frame as [`Decoder::assess_into`] does.
///
/// Not inlined on a device, for the same reason as [`decode`].
#[cfg_attr(cortex_m4f, inline(never))]
fn assess(
    model: &Model<'_>,
    frame: Frame<'_>,
    scratch: &mut [f32],
    deviation: &mut [f32],
) -> Result<Option<f32>, NetworkError> {
    let Some(confidence) = model.confidence() else { return Ok(None) };
    check_length("frame", frame.readings_ohm, confidence.sizes().readings)?;
    let readings = frame.readings_ohm.iter().copied();
    let novelty = if model.metadata().relative_inputs {
        check_length("reciprocals", frame.reciprocals, confidence.sizes().readings)?;
        let ratios = readings.zip(frame.reciprocals).map(|(r, of)| relative(r, *of));
        confidence.assess(ratios, scratch, deviation)
    } else {
        confidence.assess(readings, scratch, deviation)
    };
    novelty.map(Some)
}

/// Decodes one frame as [`Decoder::decode_into`] does, with the networks of the rows.
///
/// Neither generic nor inlined on a device: it is thus compiled with this crate, for speed, while the rest of an
/// image is compiled for size.
#[cfg_attr(cortex_m4f, inline(never))]
#[cfg_attr(not(cortex_m4f), inline(always))]
fn decode(
    model: &Model<'_>,
    networks: &[RowNetwork<'_>],
    of_frames: &[(Front<'_>, RowNetwork<'_>)],
    frame: Frame<'_>,
    scratch: &mut [f32],
    estimate: &mut Estimate<'_>,
) -> Result<bool, NetworkError> {
    let ModelShape { rows, inputs, outputs } = model.shape();
    // A model has a name for each, so that no product overflows.
    check_length("frame", frame.readings_ohm, rows.wrapping_mul(inputs))?;
    check_length("outputs of the estimate", estimate.outputs, rows.wrapping_mul(outputs))?;
    check_length("status of the estimate", estimate.status, rows)?;
    let relative = model.metadata().relative_inputs;
    let of_frames = of_frames.get(..model.network_count()).unwrap_or_default();
    // No more than that: what is left behind the parts below is readings relative to the baseline, to the last one.
    let expected = if model.whole_frames() {
        let fronts = of_frames.iter().map(|(front, _)| *front);
        floats_of_fronts(fronts, frame.readings_ohm.len(), relative)
    } else {
        floats_of_rows(inputs, relative)
    };
    let too_short = NetworkError::Length { what: "scratch", expected, found: scratch.len() };
    let scratch = scratch.get_mut(..expected).ok_or(too_short)?;
    if model.whole_frames() {
        let frames = WholeFrames { networks: of_frames, relative, rows };
        return Ok(frames.decode(frame, scratch, estimate));
    }
    let (scaled, more) = scratch.split_at_mut_checked(inputs).ok_or(too_short)?;
    let rows = Rows { networks, inputs, outputs };
    Ok(if relative {
        rows.decode::<true>(frame, [scaled, more], estimate)
    } else {
        rows.decode::<false>(frame, [scaled, more], estimate)
    })
}

/// Networks that decode a frame row by row.
struct Rows<'d, 'a> {
    networks: &'d [RowNetwork<'a>],
    /// Number of readings a row.
    inputs: usize,
    /// Number of outputs a row.
    outputs: usize,
}

impl Rows<'_, '_> {
    /// Decodes the rows of a frame. The scratch is room for scaled inputs, and for readings relative to the baseline if
    /// the networks take them (`RELATIVE`). Returns whether an input was clamped.
    #[cfg_attr(cortex_m4f, inline(never))]
    #[cfg_attr(not(cortex_m4f), inline(always))]
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
            any_clamped |= decode_inputs(network, given, scaled, outputs, status);
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
    let assessing = model.confidence().map_or(0, |it| it.sizes().scratch_floats());
    let filling = model.fill().map_or(0, |it| it.scratch_floats());
    decoding_floats(model).max(assessing).max(filling)
}

/// Number of floats of working space that decoding with `model` needs.
fn decoding_floats(model: &Model<'_>) -> usize {
    let ModelShape { rows, inputs, .. } = model.shape();
    let relative = model.metadata().relative_inputs;
    if model.whole_frames() {
        floats_of_fronts(model.fronts(), inputs.saturating_mul(rows), relative)
    } else {
        floats_of_rows(inputs, relative)
    }
}

/// Number of floats for decoding rows: scaled inputs, and readings relative to the baseline.
fn floats_of_rows(inputs: usize, relative: bool) -> usize {
    inputs.saturating_add(if relative { inputs } else { 0 })
}

/// Number of floats for decoding whole frames of so many `readings` behind these fronts.
fn floats_of_fronts<'a>(
    fronts: impl Iterator<Item = Front<'a>>,
    readings: usize,
    relative: bool,
) -> usize {
    let of_front = |front: Front<'_>| {
        let seen = match front.touch {
            Some(touch) => touch.inputs(),
            None if relative => readings,
            None => 0,
        };
        let features = front.projection.map_or(0, |it| it.features());
        // Scaled inputs, features, and shape and strength or readings relative to the baseline.
        front.inputs(readings).saturating_add(features).saturating_add(seen)
    };
    fronts.map(of_front).max().unwrap_or(0)
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
struct WholeFrames<'d, 'a> {
    networks: &'d [(Front<'a>, RowNetwork<'a>)],
    /// Whether inputs are relative to the baseline.
    relative: bool,
    /// Number of rows, which share a status.
    rows: usize,
}

impl WholeFrames<'_, '_> {
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
        network: &RowNetwork<'_>,
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
        let clamped = decode_inputs(network, inputs, scaled, outputs, &mut status);
        // Features can overflow although no reading is missing.
        if status == RowStatus::MissingReading && self.is_complete(frame) {
            status = RowStatus::Overflow;
        }
        if let (Some(touch), RowStatus::Decoded) = (&front.touch, status) {
            status = with_strength(touch, strength, network, outputs);
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
    network: &RowNetwork<'_>,
    outputs: &mut [f32],
) -> RowStatus {
    match touch.kind() {
        Kind::Place if strength < touch.strengths().least => {
            outputs.fill(f32::NAN);
            RowStatus::NoTouch
        }
        Kind::Place => RowStatus::Decoded,
        Kind::Amount => {
            let most = touch.strengths().most;
            let strength = if strength > most { most } else { strength };
            #[cfg(cortex_m4f)]
            cortex_m4::multiply(outputs, strength);
            #[cfg(not(cortex_m4f))]
            outputs.iter_mut().for_each(|output| *output *= strength);
            // Those in `fixed16` stay finite: that is checked when a model is loaded.
            if matches!(network, RowNetwork::F32(_)) && !all_finite(outputs) {
                outputs.fill(f32::NAN);
                return RowStatus::Overflow;
            }
            RowStatus::Decoded
        }
    }
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

/// Infers the outputs of a row, or of all rows at once, and writes their `status`; outputs are NaN if they could not be
/// decoded. Returns whether they were, and an input was clamped.
#[inline(always)]
fn decode_inputs(
    network: &RowNetwork<'_>,
    inputs: &[f32],
    scaled: &mut [f32],
    outputs: &mut [f32],
    status: &mut RowStatus,
) -> bool {
    let clamped = match network {
        RowNetwork::F32(section) => return decode_f32(section, inputs, scaled, outputs, status),
        RowNetwork::Fixed16(network) => network.infer(inputs, scaled, outputs),
    };
    *status = RowStatus::Decoded;
    clamped && !is_missing(inputs, outputs, status)
}

/// Infers the outputs of a network in `f32`, which has no assembly routine, as [`decode_inputs`] does.
#[cfg_attr(cortex_m4f, inline(never))]
#[cfg_attr(not(cortex_m4f), inline(always))]
fn decode_f32(
    section: &NetworkSection<'_>,
    inputs: &[f32],
    scaled: &mut [f32],
    outputs: &mut [f32],
    status: &mut RowStatus,
) -> bool {
    let shape = ModelShape { rows: 1, inputs: inputs.len(), outputs: outputs.len() };
    let Ok(network) = section.float32(shape) else {
        outputs.fill(f32::NAN);
        *status = RowStatus::MissingReading;
        return false;
    };
    let clamped = network.scale(inputs, scaled);
    if clamped && is_missing(inputs, outputs, status) {
        return false;
    }
    network.infer_scaled_shared(scaled, outputs);
    // In `fixed16` outputs cannot overflow; that is checked when a model is loaded.
    let finite = all_finite(outputs);
    *status = if finite { RowStatus::Decoded } else { RowStatus::Overflow };
    if !finite {
        outputs.fill(f32::NAN);
    }
    finite && clamped
}

/// Whether one of `inputs` is missing; the outputs are NaN then, and their `status` says so.
#[cold]
#[inline(never)]
fn is_missing(inputs: &[f32], outputs: &mut [f32], status: &mut RowStatus) -> bool {
    let missing = !all_finite(inputs);
    if missing {
        outputs.fill(f32::NAN);
        *status = RowStatus::MissingReading;
    }
    missing
}

/// Whether all `values` are finite, by the carry out of the exponent, without a branch for each.
#[inline(never)]
fn all_finite(values: &[f32]) -> bool {
    const EXPONENT: u32 = 0x7F80_0000;
    const LAST_PLACE: u32 = 0x0080_0000;
    let add = |carry, value: &f32| carry | ((value.to_bits() & EXPONENT) + LAST_PLACE);
    // In groups, because the compiler does not unroll the loop for a device.
    let (groups, rest) = values.as_chunks::<6>();
    let carry = groups.iter().flatten().fold(0, add);
    rest.iter().fold(carry, add) >> 31 == 0
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

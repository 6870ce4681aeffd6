//! Encoding a model as a blob, in memory that the caller owns.

use serde::Serialize;

#[cfg(feature = "std")]
use super::aligned::AlignedBytes;
use super::decode::Model;
use super::error::EncodeError;
use super::format::{
    CRC_BYTES, FLOAT_ALIGNMENT, FORMAT_VERSION, LinearSection, MAGIC, MetadataSection, Prefix,
    RbfHeader, ReadingModelHeader, ShapeField, TAG_LINEAR, TAG_METADATA, TAG_READING_MODEL,
    TAG_RELATIVE_INPUTS, TAG_TRACKER, TrackerHeader,
};
use super::front::Front;
use super::metadata::{Floats, Metadata};
use crate::checksum::CRC_32;
use crate::rbf::Network;
use crate::reading_model::ReadingModel;
use crate::track::Tracker;

/// Contents of a blob: what [`encode`] writes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelParts<'a> {
    /// Front of each network that sees whole frames; none for networks of rows.
    pub fronts: &'a [Front<'a>],
    /// RMSE of the best linear decoder for each output, in its unit, on training data that it was not fitted to; empty if
    /// it is not known.
    pub linear_rmse: Floats<'a>,
    /// Statistics of the readings.
    pub reading_model: Option<ReadingModel<'a>>,
    /// Tracker of a contact over frames.
    pub tracker: Option<Tracker<'a>>,
    /// The networks; all have the same number of inputs and of outputs.
    pub networks: &'a [Network<'a>],
    /// Index into `networks` for each row.
    pub row_network: &'a [u8],
    /// Names, units, and how the model was trained.
    pub metadata: Metadata<'a>,
}

impl<'a> ModelParts<'a> {
    /// Networks that decode rows from their readings, and nothing else. Each row has an index into `networks`.
    pub fn new(networks: &'a [Network<'a>], row_network: &'a [u8], metadata: Metadata<'a>) -> Self {
        let (fronts, linear_rmse, reading_model, tracker) = (&[], Floats(&[]), None, None);
        Self { fronts, linear_rmse, reading_model, tracker, networks, row_network, metadata }
    }
}

/// Bytes that a buffer needs at most to hold the blob of `parts`.
pub fn encoded_length_bound(parts: &ModelParts<'_>) -> usize {
    // Fixed fields, and the longest varint of every field that is one.
    const FIXED_FIELDS: usize = 128;
    const SECTION_FIELDS: usize = 32;
    let m = &parts.metadata;
    let text = m.name.len()
        + m.input_names.0.len()
        + m.input_units.0.len()
        + m.output_names.0.len()
        + m.output_units.0.len();
    let errors = m.training_rmse.0.len() + parts.linear_rmse.0.len();
    let numbers = errors + m.full_scale.0.len() + parts.row_network.len();
    let weights: usize = parts.networks.iter().map(|n| SECTION_FIELDS + block_bytes(n)).sum();
    let fronts = parts.fronts.iter().flat_map(Front::block).map(<[u32]>::len);
    let floats = parts.reading_model.map(|it| it.block().len());
    let of_tracker = parts.tracker.map(|it| it.block().len());
    let blocks = floats.into_iter().chain(of_tracker).chain(fronts);
    let blocks: usize = blocks.map(|words| SECTION_FIELDS + words * 4).sum();
    FIXED_FIELDS + text + numbers + blocks + weights
}

fn block_bytes(network: &Network<'_>) -> usize {
    network.block().iter().map(|words| words.len() * 4).sum()
}

/// Encodes `parts` at the start of `buffer` and returns the blob.
///
/// `buffer` must lie at a multiple of four ([`Aligned`](super::Aligned)). The blob is parsed again before it is
/// returned, so that every returned blob can be loaded.
///
/// # Errors
/// Every variant of [`EncodeError`].
pub fn encode<'b>(parts: &ModelParts<'_>, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    let rows = parts.row_network.len();
    let [inputs, outputs] = of_row(parts, rows)?;

    let mut writer = Writer { buffer, at: 0 };
    writer.put(&Prefix { magic: MAGIC, version: FORMAT_VERSION, length: [0; 4] })?;
    writer.put(&ShapeField {
        rows: fit("number of rows", rows, u8::MAX)?,
        inputs: fit("number of inputs", inputs, u16::MAX)?,
        outputs: fit("number of outputs", outputs, u16::MAX)?,
        networks: fit("number of networks", parts.networks.len(), u8::MAX)?,
        row_network: parts.row_network,
    })?;
    let m = &parts.metadata;
    writer.put(&MetadataSection {
        tag: TAG_METADATA,
        name: m.name,
        scene_digest: m.scene_digest,
        noise_kind: m.noise_kind,
        noise_level: m.noise_level,
        seed: m.seed,
        training_frames: m.training_frames,
        thickness_mm: m.thickness_mm,
        input_names: m.input_names.0,
        input_units: m.input_units.0,
        output_names: m.output_names.0,
        output_units: m.output_units.0,
        training_rmse: m.training_rmse.0,
        full_scale: m.full_scale.0,
    })?;
    if m.relative_inputs {
        writer.put(&TAG_RELATIVE_INPUTS)?;
    }
    if !parts.linear_rmse.0.is_empty() {
        writer.put(&LinearSection { tag: TAG_LINEAR, rmse: parts.linear_rmse.0 })?;
    }
    if let Some(model) = parts.reading_model {
        let factors = fit("number of factors", model.sizes().factors, u16::MAX)?;
        let components = fit("number of components", model.sizes().components, u16::MAX)?;
        writer.put(&ReadingModelHeader { tag: TAG_READING_MODEL, factors, components })?;
        writer.put_block(&[bytemuck::cast_slice(model.block())])?;
    }
    if let Some(tracker) = parts.tracker {
        let electrodes = fit("number of electrodes", tracker.sizes().electrodes, u8::MAX)?;
        let span = fit("number of columns of a group", tracker.sizes().span, u8::MAX)?;
        writer.put(&TrackerHeader { tag: TAG_TRACKER, electrodes, span })?;
        writer.put_block(&[bytemuck::cast_slice(tracker.block())])?;
    }
    for (index, network) in parts.networks.iter().enumerate() {
        if let Some(front) = parts.fronts.get(index) {
            let features = front.projection.map_or(0, |it| it.features());
            let features = fit("number of features", features, u16::MAX)?;
            let outputs = fit("number of outputs", front.outputs, u16::MAX)?;
            writer.put(&front.header(features, outputs))?;
            writer.put_block(&front.block())?;
        }
        writer.put_network(fit("network index", index, u8::MAX)?, network)?;
    }
    let length = writer.finish()?;

    let blob = buffer.get(..length).ok_or(EncodeError::BufferTooSmall)?;
    Model::decode(blob)?;
    Ok(blob)
}

/// Numbers of inputs and of outputs of each of so many `rows`.
fn of_row(parts: &ModelParts<'_>, rows: usize) -> Result<[usize; 2], EncodeError> {
    let shapes = || parts.networks.iter().map(Network::shape).enumerate();
    let Some((_, first)) = shapes().next() else { return Ok([0; 2]) };
    if parts.fronts.is_empty() {
        let sizes = [first.inputs, first.outputs];
        let mut others = shapes().filter(|(_, it)| [it.inputs, it.outputs] != sizes);
        return others
            .next()
            .map_or(Ok(sizes), |(index, _)| Err(EncodeError::UnequalNetworks { index }));
    }
    let readings = |front: &Front<'_>, inputs: usize| match (front.touch, front.projection) {
        (Some(touch), _) => touch.readings(),
        (None, Some(projection)) => projection.readings(),
        (None, None) => inputs,
    };
    let most = parts.fronts.first().map_or(0, |front| readings(front, first.inputs));
    let mut outputs = 0;
    for (index, shape) in shapes() {
        let front = parts.fronts.get(index).ok_or(EncodeError::UnfitFront { index })?;
        let fits = shape.inputs == front.inputs(most) && readings(front, shape.inputs) == most;
        if !fits || shape.outputs != front.outputs {
            return Err(EncodeError::UnfitFront { index });
        }
        outputs += shape.outputs;
    }
    let rows = rows.max(1);
    if outputs.is_multiple_of(rows) {
        Ok([most / rows, outputs / rows])
    } else {
        Err(EncodeError::UnevenRows { outputs, rows })
    }
}

/// Encodes `parts` as a blob on the heap.
///
/// # Errors
/// Every variant of [`EncodeError`] except [`EncodeError::BufferTooSmall`].
#[cfg(feature = "std")]
pub fn encode_to_vec(parts: &ModelParts<'_>) -> Result<AlignedBytes, EncodeError> {
    let mut bytes = AlignedBytes::zeroed(encoded_length_bound(parts));
    let length = encode(parts, &mut bytes)?.len();
    bytes.truncate(length);
    Ok(bytes)
}

fn fit<T: TryFrom<usize> + Into<usize> + Copy>(
    what: &'static str,
    value: usize,
    most: T,
) -> Result<T, EncodeError> {
    T::try_from(value).map_err(|_| EncodeError::TooLarge { what, value, most: most.into() })
}

struct Writer<'b> {
    buffer: &'b mut [u8],
    at: usize,
}

impl Writer<'_> {
    fn put<T: Serialize>(&mut self, field: &T) -> Result<(), EncodeError> {
        let free = self.buffer.get_mut(self.at..).ok_or(EncodeError::BufferTooSmall)?;
        let used = postcard::to_slice(field, free).map_err(|_| EncodeError::BufferTooSmall)?;
        self.at += used.len();
        Ok(())
    }

    fn put_raw(&mut self, bytes: &[u8]) -> Result<(), EncodeError> {
        let end = self.at + bytes.len();
        let free = self.buffer.get_mut(self.at..end).ok_or(EncodeError::BufferTooSmall)?;
        free.copy_from_slice(bytes);
        self.at = end;
        Ok(())
    }

    fn put_network(&mut self, index: u8, network: &Network<'_>) -> Result<(), EncodeError> {
        let header = RbfHeader {
            tag: network.format().tag(),
            index,
            centres: fit("number of centres", network.shape().centres, u16::MAX)?,
            affine: network.has_affine_tail(),
        };
        self.put(&header)?;
        self.put_block(&network.block())
    }

    /// Writes padding, length and the words of a block, so that the words start at a multiple of four.
    fn put_block(&mut self, block: &[&[u32]]) -> Result<(), EncodeError> {
        let bytes = block.iter().map(|words| words.len() * 4).sum();
        let length = u32::try_from(bytes).map_err(|_| EncodeError::TooLarge {
            what: "bytes of one section",
            value: bytes,
            most: u32::MAX as usize,
        })?;
        // In this order: one byte for the padding's length, the padding, the block's length.
        let start = self.at + 1 + varint_bytes(length);
        let padding = start.next_multiple_of(FLOAT_ALIGNMENT) - start;
        self.put(&[0_u8; FLOAT_ALIGNMENT].get(..padding).unwrap_or_default())?;
        self.put(&length)?;
        for words in block {
            self.put_raw(bytemuck::cast_slice(words))?;
        }
        Ok(())
    }

    /// Completes the blob: enters its length, appends its CRC, and returns its length in bytes.
    fn finish(self) -> Result<usize, EncodeError> {
        let end = self.at + CRC_BYTES;
        let length = u32::try_from(end).map_err(|_| EncodeError::TooLarge {
            what: "bytes of the blob",
            value: end,
            most: u32::MAX as usize,
        })?;
        let blob = self.buffer.get_mut(..end).ok_or(EncodeError::BufferTooSmall)?;
        let (covered, crc) =
            blob.split_last_chunk_mut::<CRC_BYTES>().ok_or(EncodeError::BufferTooSmall)?;
        let field = covered.get_mut(5..9).ok_or(EncodeError::BufferTooSmall)?;
        field.copy_from_slice(&length.to_le_bytes());
        *crc = CRC_32.checksum(covered).to_le_bytes();
        Ok(end)
    }
}

/// Bytes that `value` takes as a postcard varint: seven bits a byte.
fn varint_bytes(value: u32) -> usize {
    (32 - value.leading_zeros()).max(1).div_ceil(7) as usize
}

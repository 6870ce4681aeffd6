//! Parsing a blob to a model: everything is checked once, then borrowed.

use super::error::DecodeError;
use super::format::{
    CRC_BYTES, FLOAT_ALIGNMENT, FORMAT_VERSION, MAGIC, MetadataSection, PREFIX_BYTES, Prefix,
    RbfHeader, ShapeField, TAG_FRONT, TAG_METADATA,
};
use super::front::{Front, MOST_FRONTS};
use super::metadata::{Columns, Floats, Metadata, ModelShape};
use super::sections::{
    check_count, cut_reading_model, cut_tracker, take, take_block, take_linear,
    take_relative_inputs,
};
use crate::checksum::CRC_32;
use crate::rbf::{Cut, Format, Network, NetworkError, Shape, fixed16, float32};
use crate::reading_model::ReadingModel;
use crate::scale::UNITS;
use crate::track::Tracker;

/// A model, borrowed from a blob whose every byte and value has been checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model<'a> {
    shape: ModelShape,
    crc: u32,
    row_network: &'a [u8],
    metadata: Metadata<'a>,
    /// Whether networks see whole frames, each behind a front.
    whole_frames: bool,
    networks: u8,
    /// The sections of the linear decoder's errors, of the reading model and of the tracker, if there are any, and those
    /// of the networks: nothing else is kept of the first three, to save RAM.
    last_sections: &'a [u8],
}

impl<'a> Model<'a> {
    /// Parses `blob` to a model: checks it from end to end and borrows from it.
    ///
    /// # Errors
    /// Every variant of [`DecodeError`] except `TooManyRows`. Checked in this order: address, magic,
    /// version, length, CRC, shape, then the sections.
    pub fn decode(blob: &'a [u8]) -> Result<Self, DecodeError> {
        if !(blob.as_ptr() as usize).is_multiple_of(FLOAT_ALIGNMENT) {
            return Err(DecodeError::Misaligned);
        }
        let (body, crc) = checked_body(blob)?;
        let (shape_field, rest) = take::<ShapeField>(body, "shape")?;
        let ShapeField { rows, inputs, outputs, networks, row_network } = shape_field;
        let shape =
            ModelShape { rows: rows.into(), inputs: inputs.into(), outputs: outputs.into() };
        check_count("row-to-network entries", shape.rows, row_network.len())?;
        for (row, &network) in row_network.iter().enumerate() {
            if network >= networks {
                return Err(DecodeError::UnknownNetwork { row, network, networks });
            }
        }
        if shape.rows == 0 || shape.inputs == 0 || shape.outputs == 0 {
            return Err(DecodeError::Malformed { section: "shape" });
        }

        let (section, rest) = take::<MetadataSection>(rest, "metadata")?;
        let (relative_inputs, rest) = take_relative_inputs(rest);
        let metadata = checked_metadata(&section, relative_inputs, shape)?;
        let last_sections = rest;
        let (linear_rmse, rest) = take_linear(last_sections, shape)?;
        if !linear_rmse.iter().all(in_range) {
            return Err(DecodeError::InvalidMetadata { field: "linear error" });
        }
        let (reading_model, rest) = cut_reading_model(rest, shape)?;
        if let Some(model) = reading_model {
            ReadingModel::new(model.sizes(), model.block())
                .map_err(|cause| DecodeError::ReadingModel { cause })?;
        }
        let (_, network_sections) = cut_tracker(rest, shape)?;

        let model = Self {
            shape,
            crc,
            row_network,
            metadata,
            whole_frames: network_sections.first() == Some(&TAG_FRONT),
            networks,
            last_sections,
        };
        let (mut rest, mut outputs) = (network_sections, 0_usize);
        for index in 0..networks {
            let (part, after) = model.take_part(rest, index)?;
            part.front.check()?;
            // Every value is looked at once, here; later reads only cut slices.
            let network = part.network().map_err(|cause| DecodeError::Network { index, cause })?;
            network.check_values().map_err(|cause| DecodeError::Network { index, cause })?;
            part.check_scaled(&network, index)?;
            outputs = outputs.saturating_add(part.front.outputs);
            rest = after;
        }
        if model.whole_frames {
            check_count("outputs of networks", shape.rows * shape.outputs, outputs)?;
            if usize::from(networks) > MOST_FRONTS {
                return Err(DecodeError::Malformed { section: "list of networks" });
            }
        }
        if !rest.is_empty() {
            return Err(DecodeError::LeftOver { bytes: rest.len() });
        }
        Ok(model)
    }

    /// Length in bytes that the blob at the start of `slot` declares; the slot may be larger.
    ///
    /// `None` if `slot` does not start with a blob of this version. Nothing else is checked.
    pub fn declared_length(slot: &[u8]) -> Option<usize> {
        let prefix = checked_prefix(slot).ok()?;
        Some(u32::from_le_bytes(prefix.length) as usize)
    }

    /// Length in bytes and shape that the blob starting with `head` declares; [`HEAD_BYTES`](Self::HEAD_BYTES) are
    /// enough.
    ///
    /// `None` if `head` is no start of a blob of this version, or too short. Nothing else is checked.
    pub fn declared(head: &[u8]) -> Option<(usize, ModelShape)> {
        let length = Self::declared_length(head)?;
        let fields = take::<(u8, u16, u16)>(head.get(PREFIX_BYTES..)?, "shape");
        let ((rows, inputs, outputs), _) = fields.ok()?;
        let shape =
            ModelShape { rows: rows.into(), inputs: inputs.into(), outputs: outputs.into() };
        Some((length, shape))
    }

    /// Number of bytes at a blob's start that declare its length and its shape. Every blob has more.
    pub const HEAD_BYTES: usize = PREFIX_BYTES + 1 + 3 + 3;

    /// The model's number of rows, and of inputs and outputs a row.
    pub fn shape(&self) -> ModelShape {
        self.shape
    }

    /// The blob's CRC-32: a short fingerprint of the whole model.
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// Metadata of the model: names, units, and how it was trained.
    pub fn metadata(&self) -> &Metadata<'a> {
        &self.metadata
    }

    /// Number of networks in the blob; rows may share them.
    pub fn network_count(&self) -> usize {
        self.networks.into()
    }

    /// Whether networks see whole frames, and give outputs of all rows one after the other. Else each row's readings are
    /// the inputs of its network.
    pub fn whole_frames(&self) -> bool {
        self.whole_frames
    }

    /// Fronts of the networks that see whole frames, in their order; none for networks of rows.
    pub fn fronts(&self) -> impl Iterator<Item = Front<'a>> {
        let of_frames = self.whole_frames.then(|| self.parts());
        of_frames.into_iter().flatten().map(|part| part.front)
    }

    /// Statistics of the readings, which fill missing ones and may estimate novelty and deviations; `None` if the model
    /// has none.
    pub fn reading_model(&self) -> Option<ReadingModel<'a>> {
        self.cut_reading_model().0
    }

    /// Whether the model estimates novelty and deviations.
    pub fn assesses(&self) -> bool {
        self.reading_model().is_some_and(|it| it.assesses())
    }

    /// RMSE of the best linear decoder for each output, in its unit, on training data that it was not fitted to; empty if
    /// the model does not have it.
    pub fn linear_rmse(&self) -> Floats<'a> {
        take_linear(self.last_sections, self.shape).map_or(Floats(&[]), |(rmse, _)| rmse)
    }

    /// Tracker of a contact over frames; `None` if the model has none.
    pub fn tracker(&self) -> Option<Tracker<'a>> {
        cut_tracker(self.cut_reading_model().1, self.shape).ok()?.0
    }

    /// The sections of the networks.
    fn network_sections(&self) -> &'a [u8] {
        let rest = self.cut_reading_model().1;
        cut_tracker(rest, self.shape).map_or(rest, |(_, rest)| rest)
    }

    /// The reading model, and the sections behind it.
    fn cut_reading_model(&self) -> (Option<ReadingModel<'a>>, &'a [u8]) {
        let rest =
            take_linear(self.last_sections, self.shape).map_or(self.last_sections, |it| it.1);
        cut_reading_model(rest, self.shape).unwrap_or_default()
    }

    /// Networks in the order of the blob, with what stands before each.
    pub(crate) fn parts(&self) -> impl Iterator<Item = Part<'a>> {
        let (model, mut rest) = (*self, self.network_sections());
        (0..self.networks).map_while(move |index| {
            let (part, after) = model.take_part(rest, index).ok()?;
            rest = after;
            Some(part)
        })
    }

    /// The networks, in the order of the blob.
    pub fn networks(&self) -> impl Iterator<Item = Network<'a>> {
        self.parts().map_while(|part| part.network().ok())
    }

    /// Cuts a network and what stands before it from the front of `bytes`; checks lengths, but no values.
    fn take_part(&self, bytes: &'a [u8], index: u8) -> Result<(Part<'a>, &'a [u8]), DecodeError> {
        let (front, rest) = if self.whole_frames {
            check_tag(TAG_FRONT, bytes.first().copied().unwrap_or_default())?;
            Front::take(bytes, self.shape)?
        } else {
            (Front::NONE, bytes)
        };
        let shape = if self.whole_frames {
            let readings = self.shape.rows * self.shape.inputs;
            ModelShape { rows: 1, inputs: front.inputs(readings), outputs: front.outputs }
        } else {
            self.shape
        };
        let (section, rest) = NetworkSection::take(rest, shape, index)?;
        Ok((Part { front, section, shape }, rest))
    }

    /// Index of the network that serves `row` (from 0), or `None` for a row outside the sensor.
    pub fn network_of_row(&self, row: usize) -> Option<usize> {
        self.row_network.get(row).copied().map(usize::from)
    }
}

/// A network, what stands before it, and its inputs and outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<'a> {
    pub front: Front<'a>,
    pub section: NetworkSection<'a>,
    pub shape: ModelShape,
}

impl<'a> Part<'a> {
    /// The network; its values are not checked again.
    fn network(&self) -> Result<Network<'a>, NetworkError> {
        self.section.network(self.shape)
    }

    /// Checks that outputs in `fixed16`, which are not looked at on a device, stay finite times the largest strength.
    fn check_scaled(&self, network: &Network<'_>, index: u8) -> Result<(), DecodeError> {
        let (Some(touch), Network::Fixed16(network)) = (self.front.touch, network) else {
            return Ok(());
        };
        let most = |scale: &f32| scale * UNITS * touch.strengths().most;
        if network.parameters().output_scale.iter().all(|scale| most(scale).is_finite()) {
            return Ok(());
        }
        let cause = NetworkError::NotFinite { what: "the largest output" };
        Err(DecodeError::Network { index, cause })
    }
}

fn checked_prefix(blob: &[u8]) -> Result<Prefix, DecodeError> {
    if blob.len() < PREFIX_BYTES {
        // Too short to declare a length: truncated if it starts as a blob does, else no blob.
        let is_start = MAGIC.iter().zip(blob).all(|(a, b)| a == b);
        return Err(if is_start {
            DecodeError::Truncated { expected: PREFIX_BYTES + CRC_BYTES, found: blob.len() }
        } else {
            DecodeError::BadMagic
        });
    }
    let (prefix, _) = take::<Prefix>(blob, "prefix")?;
    if prefix.magic != MAGIC {
        return Err(DecodeError::BadMagic);
    }
    if prefix.version != FORMAT_VERSION {
        return Err(DecodeError::UnsupportedVersion {
            found: prefix.version,
            supported: FORMAT_VERSION,
        });
    }
    Ok(prefix)
}

/// Checks prefix, length and CRC; returns the bytes between prefix and CRC, and the CRC.
fn checked_body(blob: &[u8]) -> Result<(&[u8], u32), DecodeError> {
    let prefix = checked_prefix(blob)?;
    let (expected, found) = (u32::from_le_bytes(prefix.length) as usize, blob.len());
    if found < expected {
        return Err(DecodeError::Truncated { expected, found });
    }
    if found > expected {
        return Err(DecodeError::TrailingBytes { extra: found - expected });
    }
    let Some((covered, stored)) = blob.split_last_chunk::<CRC_BYTES>() else {
        return Err(DecodeError::Malformed { section: "prefix" });
    };
    let (stored, computed) = (u32::from_le_bytes(*stored), CRC_32.checksum(covered));
    if stored != computed {
        return Err(DecodeError::Corrupt { expected: computed, found: stored });
    }
    match covered.split_at_checked(PREFIX_BYTES) {
        Some((_, body)) => Ok((body, stored)),
        None => Err(DecodeError::Malformed { section: "prefix" }),
    }
}

fn check_tag(expected: u8, found: u8) -> Result<(), DecodeError> {
    if expected == found { Ok(()) } else { Err(DecodeError::SectionOrder { expected, found }) }
}

/// Whether an error, or what else cannot be negative, is one.
fn in_range(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}

fn checked_metadata<'a>(
    section: &MetadataSection<'a>,
    relative_inputs: bool,
    shape: ModelShape,
) -> Result<Metadata<'a>, DecodeError> {
    check_tag(TAG_METADATA, section.tag)?;
    let metadata = Metadata {
        name: section.name,
        scene_digest: section.scene_digest,
        noise_kind: section.noise_kind,
        noise_level: section.noise_level,
        seed: section.seed,
        training_frames: section.training_frames,
        thickness_mm: section.thickness_mm,
        relative_inputs,
        input_names: Columns(section.input_names),
        input_units: Columns(section.input_units),
        output_names: Columns(section.output_names),
        output_units: Columns(section.output_units),
        training_rmse: Floats(section.training_rmse),
        full_scale: Floats(section.full_scale),
    };
    let (inputs, outputs) = (shape.rows * shape.inputs, shape.rows * shape.outputs);
    check_count("input names", inputs, metadata.input_names.iter().count())?;
    check_count("input units", inputs, metadata.input_units.iter().count())?;
    check_count("output names", outputs, metadata.output_names.iter().count())?;
    check_count("output units", outputs, metadata.output_units.iter().count())?;
    check_count("bytes of training errors", outputs * 4, section.training_rmse.len())?;
    check_count("bytes of full scales", outputs * 4, section.full_scale.len())?;
    for (field, ok) in [
        ("noise level", in_range(metadata.noise_level)),
        ("thickness", in_range(metadata.thickness_mm)),
        ("training error", metadata.training_rmse.iter().all(in_range)),
        ("full scale", metadata.full_scale.iter().all(in_range)),
    ] {
        if !ok {
            return Err(DecodeError::InvalidMetadata { field });
        }
    }
    Ok(metadata)
}

/// One network's section, cut from a blob: the fields of its header, and its block of words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NetworkSection<'a> {
    format: Format,
    affine: bool,
    centres: u16,
    block: &'a [u32],
}

impl<'a> NetworkSection<'a> {
    /// A section without a network: [`network`](Self::network) returns an error.
    pub const EMPTY: Self = Self { format: Format::F32, affine: false, centres: 0, block: &[] };

    /// Cuts a network's section from the front of `bytes`; checks lengths, but no values.
    fn take(
        bytes: &'a [u8],
        shape: ModelShape,
        index: u8,
    ) -> Result<(Self, &'a [u8]), DecodeError> {
        const SECTION: &str = "network section";
        let (header, rest) = take::<RbfHeader>(bytes, SECTION)?;
        let format = header.format()?;
        if header.index != index {
            return Err(DecodeError::NetworkOrder { expected: index, found: header.index });
        }
        let (block, rest) = take_block(rest, SECTION)?;
        let RbfHeader { affine, centres, .. } = header;
        let words = {
            let shape = network_shape(shape, centres);
            match format {
                Format::F32 => float32::Network::block_words(shape, affine),
                Format::Fixed16 => fixed16::Network::block_words(shape, affine),
            }
        };
        check_count("bytes of weights", words.saturating_mul(4), block.len())?;
        let block = bytemuck::try_cast_slice::<u8, u32>(block)
            .map_err(|_| DecodeError::Malformed { section: "padding" })?;
        let section = Self { format, affine, centres, block };
        section.network(shape).map_err(|cause| DecodeError::Network { index, cause })?;
        Ok((section, rest))
    }

    /// The section's network; its values are not checked again.
    pub fn network(&self, shape: ModelShape) -> Result<Network<'a>, NetworkError> {
        match self.format {
            Format::F32 => self.float32(shape).map(Network::F32),
            Format::Fixed16 => self.fixed16(shape).map(Network::Fixed16),
        }
    }

    /// The network's format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The section's network if its format is `f32`; else an error.
    #[inline]
    pub fn float32(&self, shape: ModelShape) -> Result<float32::Network<'a>, NetworkError> {
        let shape = network_shape(shape, self.centres);
        float32::Network::from_block(shape, self.affine, Cut(self.block))
    }

    /// The section's network if its format is `fixed16`; else an error.
    #[inline]
    pub fn fixed16(&self, shape: ModelShape) -> Result<fixed16::Network<'a>, NetworkError> {
        let shape = network_shape(shape, self.centres);
        fixed16::Network::with_length_checked(shape, self.affine, self.block)
    }
}

fn network_shape(shape: ModelShape, centres: u16) -> Shape {
    Shape { inputs: shape.inputs, centres: centres.into(), outputs: shape.outputs }
}

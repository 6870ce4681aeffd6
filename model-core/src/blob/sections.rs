//! Cutting sections from the front of a blob's bytes: each is checked, then borrowed.

use super::error::DecodeError;
use super::format::{
    FLOAT_ALIGNMENT, LinearSection, ReadingModelHeader, TAG_LINEAR, TAG_READING_MODEL,
    TAG_RELATIVE_INPUTS, TAG_TRACKER, TrackerHeader,
};
use super::metadata::{Floats, ModelShape};
use crate::reading_model::{ReadingModel, Sizes};
use crate::track::{self, Tracker};

/// Takes the postcard fields `T` of a `section` from the front of `bytes`.
pub(super) fn take<'a, T: serde::Deserialize<'a>>(
    bytes: &'a [u8],
    section: &'static str,
) -> Result<(T, &'a [u8]), DecodeError> {
    postcard::take_from_bytes(bytes).map_err(|_| DecodeError::Malformed { section })
}

/// Checks the length of a list against the shape.
pub(super) fn check_count(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), DecodeError> {
    if expected == found {
        Ok(())
    } else {
        Err(DecodeError::CountMismatch { what, expected, found })
    }
}

/// Cuts padding, length and the block of words from the front of `bytes`.
pub(super) fn take_block<'a>(
    bytes: &'a [u8],
    section: &'static str,
) -> Result<(&'a [u8], &'a [u8]), DecodeError> {
    let (padding, rest) = take::<&[u8]>(bytes, section)?;
    if padding.len() >= FLOAT_ALIGNMENT || padding.iter().any(|&byte| byte != 0) {
        return Err(DecodeError::Malformed { section: "padding" });
    }
    take::<&[u8]>(rest, section)
}

/// Floats of a block.
fn floats(block: &[u8]) -> Result<&[f32], DecodeError> {
    bytemuck::try_cast_slice(block).map_err(|_| DecodeError::Malformed { section: "padding" })
}

/// Cuts the section of relative inputs from the front of `bytes`; returns whether there is one.
pub(super) fn take_relative_inputs(bytes: &[u8]) -> (bool, &[u8]) {
    match bytes.split_first() {
        Some((&TAG_RELATIVE_INPUTS, rest)) => (true, rest),
        _ => (false, bytes),
    }
}

/// Cuts the errors of the linear decoder from the front of `bytes`: four bytes an output, or nothing without the section.
pub(super) fn take_linear(
    bytes: &[u8],
    shape: ModelShape,
) -> Result<(Floats<'_>, &[u8]), DecodeError> {
    if bytes.first() != Some(&TAG_LINEAR) {
        return Ok((Floats(&[]), bytes));
    }
    let (section, rest) = take::<LinearSection>(bytes, "linear section")?;
    let bytes = shape.rows.saturating_mul(shape.outputs).saturating_mul(4);
    check_count("bytes of linear errors", bytes, section.rmse.len())?;
    Ok((Floats(section.rmse), rest))
}

/// Cuts the reading model from the front of `bytes` if there is one; checks its length, but no values.
pub(super) fn cut_reading_model(
    bytes: &[u8],
    shape: ModelShape,
) -> Result<(Option<ReadingModel<'_>>, &[u8]), DecodeError> {
    const SECTION: &str = "reading model section";
    if bytes.first() != Some(&TAG_READING_MODEL) {
        return Ok((None, bytes));
    }
    let (header, rest) = take::<ReadingModelHeader>(bytes, SECTION)?;
    let sizes = Sizes {
        readings: shape.rows.saturating_mul(shape.inputs),
        factors: header.factors.into(),
        components: header.components.into(),
        outputs: shape.rows.saturating_mul(shape.outputs),
    };
    let (block, rest) = take_block(rest, SECTION)?;
    check_count("bytes of the reading model", sizes.block_floats().saturating_mul(4), block.len())?;
    Ok((Some(ReadingModel::of_checked(sizes, floats(block)?)), rest))
}

/// Cuts the tracker from the front of `bytes` if there is one, and checks it.
pub(super) fn cut_tracker(
    bytes: &[u8],
    shape: ModelShape,
) -> Result<(Option<Tracker<'_>>, &[u8]), DecodeError> {
    const SECTION: &str = "tracker section";
    if bytes.first() != Some(&TAG_TRACKER) {
        return Ok((None, bytes));
    }
    let (header, rest) = take::<TrackerHeader>(bytes, SECTION)?;
    let ModelShape { rows, inputs, outputs } = shape;
    let (electrodes, span) = (header.electrodes.into(), header.span.into());
    let sizes = track::Sizes { rows, electrodes, columns: inputs, span };
    if !sizes.has_outputs(outputs) {
        return Err(DecodeError::Malformed { section: SECTION });
    }
    let (block, rest) = take_block(rest, SECTION)?;
    let tracker =
        Tracker::new(sizes, floats(block)?).map_err(|cause| DecodeError::Tracker { cause })?;
    Ok((Some(tracker), rest))
}

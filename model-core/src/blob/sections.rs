//! Cutting sections from the front of a blob's bytes: each is checked, then borrowed.

use super::error::DecodeError;
use super::format::{
    ConfidenceHeader, FLOAT_ALIGNMENT, FillHeader, LinearSection, TAG_CONFIDENCE, TAG_FILL,
    TAG_LINEAR, TAG_RELATIVE_INPUTS,
};
use super::metadata::{Floats, ModelShape};
use crate::confidence::{Confidence, Sizes};
use crate::fill::{self, Fill};

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

/// Cuts padding, length and a block of so many `floats` from the front of `bytes`. `what` names its bytes.
fn take_floats<'a>(
    bytes: &'a [u8],
    section: &'static str,
    what: &'static str,
    floats: usize,
) -> Result<(&'a [f32], &'a [u8]), DecodeError> {
    let (block, rest) = take_block(bytes, section)?;
    check_count(what, floats.saturating_mul(4), block.len())?;
    let block = bytemuck::try_cast_slice::<u8, f32>(block)
        .map_err(|_| DecodeError::Malformed { section: "padding" })?;
    Ok((block, rest))
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

/// Cuts the confidence from the front of `bytes` if there is one, and checks it.
pub(super) fn take_confidence(
    bytes: &[u8],
    shape: ModelShape,
) -> Result<(Option<Confidence<'_>>, &[u8]), DecodeError> {
    const SECTION: &str = "confidence section";
    if bytes.first() != Some(&TAG_CONFIDENCE) {
        return Ok((None, bytes));
    }
    let (header, rest) = take::<ConfidenceHeader>(bytes, SECTION)?;
    let sizes = Sizes {
        readings: shape.rows * shape.inputs,
        directions: header.directions.into(),
        components: header.components.into(),
        outputs: shape.rows * shape.outputs,
    };
    let floats = sizes.block_floats();
    let (block, rest) = take_floats(rest, SECTION, "bytes of confidence", floats)?;
    let confidence =
        Confidence::new(sizes, block).map_err(|cause| DecodeError::Confidence { cause })?;
    Ok((Some(confidence), rest))
}

/// Cuts the fill from the front of `bytes` if there is one; checks its length, but no values.
pub(super) fn cut_fill(
    bytes: &[u8],
    shape: ModelShape,
) -> Result<(Option<Fill<'_>>, &[u8]), DecodeError> {
    const SECTION: &str = "fill section";
    if bytes.first() != Some(&TAG_FILL) {
        return Ok((None, bytes));
    }
    let (header, rest) = take::<FillHeader>(bytes, SECTION)?;
    let (readings, factors) = (shape.rows.saturating_mul(shape.inputs), header.factors.into());
    let floats = fill::block_floats(readings, factors);
    let (block, rest) = take_floats(rest, SECTION, "bytes of fill", floats)?;
    Ok((Some(Fill::of_checked(readings, factors, block)), rest))
}

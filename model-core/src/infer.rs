//! Inference as a decoder asks for it: the outputs of a network with their status, wherever its numbers lie.

use crate::blob::{ModelShape, NetworkSection};
use crate::estimate::RowStatus;
use crate::rbf::{Format, Network, NetworkError, fixed16, float32};

/// Inputs and outputs of one inference: of a row, or of all rows at once.
pub struct Row<'r> {
    /// One number an input, not scaled yet.
    pub inputs: &'r [f32],
    /// Working space of as many numbers.
    pub scaled: &'r mut [f32],
    pub outputs: &'r mut [f32],
    pub status: &'r mut RowStatus,
}

/// A network that a decoder can call.
pub trait Infer: Copy {
    /// Infers outputs and writes their status; outputs are NaN if they could not be decoded. Returns whether they were, and
    /// an input was clamped.
    fn infer_row(&self, row: Row<'_>) -> bool;

    /// Whether outputs can overflow. Those in `fixed16` cannot, even times the largest strength of a touch; that is checked
    /// when a model is loaded.
    fn can_overflow(&self) -> bool;
}

impl Infer for float32::Network<'_> {
    #[inline(always)]
    fn infer_row(&self, row: Row<'_>) -> bool {
        let Row { inputs, scaled, outputs, status } = row;
        let clamped = self.scale(inputs, scaled);
        let missing = clamped && !all_finite(inputs);
        if !missing {
            self.infer_scaled_shared(scaled, outputs);
        }
        let finite = !missing && all_finite(outputs);
        *status = match (missing, finite) {
            (true, _) => RowStatus::MissingReading,
            (_, false) => RowStatus::Overflow,
            (_, true) => RowStatus::Decoded,
        };
        if !finite {
            outputs.fill(f32::NAN);
        }
        finite && clamped
    }

    #[inline(always)]
    fn can_overflow(&self) -> bool {
        true
    }
}

impl Infer for fixed16::Network<'_> {
    #[inline(always)]
    fn infer_row(&self, row: Row<'_>) -> bool {
        let Row { inputs, scaled, outputs, status } = row;
        let clamped = self.infer(inputs, scaled, outputs);
        *status = RowStatus::Decoded;
        clamped && !is_missing(inputs, outputs, status)
    }

    #[inline(always)]
    fn can_overflow(&self) -> bool {
        false
    }
}

impl Infer for Network<'_> {
    fn infer_row(&self, row: Row<'_>) -> bool {
        match self {
            Self::F32(inner) => inner.infer_row(row),
            Self::Fixed16(inner) => inner.infer_row(row),
        }
    }

    fn can_overflow(&self) -> bool {
        self.format() == Format::F32
    }
}

/// The network of a row of a blob, made ready when the model is loaded.
#[derive(Debug, Clone, Copy)]
pub enum RowNetwork<'a> {
    /// A network in `f32`, which is large: it is cut from its section for each row.
    F32(NetworkSection<'a>),
    /// A network in `fixed16`.
    Fixed16(fixed16::Network<'a>),
}

impl<'a> RowNetwork<'a> {
    /// No network: whatever it is given is missing.
    pub const NONE: Self = Self::F32(NetworkSection::EMPTY);

    pub fn new(section: NetworkSection<'a>, shape: ModelShape) -> Result<Self, NetworkError> {
        match section.format() {
            Format::F32 => Ok(Self::F32(section)),
            Format::Fixed16 => section.fixed16(shape).map(Self::Fixed16),
        }
    }
}

impl Infer for RowNetwork<'_> {
    #[inline(always)]
    fn infer_row(&self, row: Row<'_>) -> bool {
        match self {
            Self::F32(section) => infer_section(section, row),
            Self::Fixed16(network) => network.infer_row(row),
        }
    }

    #[inline(always)]
    fn can_overflow(&self) -> bool {
        matches!(self, Self::F32(_))
    }
}

/// Infers the outputs of a network in `f32`, which has no assembly routine, as [`Infer::infer_row`] does.
#[cfg_attr(cortex_m4f, inline(never))]
#[cfg_attr(not(cortex_m4f), inline(always))]
fn infer_section(section: &NetworkSection<'_>, row: Row<'_>) -> bool {
    let shape = ModelShape { rows: 1, inputs: row.inputs.len(), outputs: row.outputs.len() };
    if let Ok(network) = section.float32(shape) {
        return network.infer_row(row);
    }
    row.outputs.fill(f32::NAN);
    *row.status = RowStatus::MissingReading;
    false
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
pub fn all_finite(values: &[f32]) -> bool {
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

//! What stands before a network that sees whole frames: it makes the network's inputs of all readings.

use super::error::DecodeError;
use super::format::{FrontHeader, TAG_FRONT};
use super::metadata::ModelShape;
use super::sections::{check_count, take, take_block};
use crate::projection::{self, Projection};
use crate::touch::{self, Kind, Touch};

/// Most networks of a model that see whole frames: each gives other outputs.
pub const MOST_FRONTS: usize = 4;

/// Front of a network that sees whole frames: what is computed of a frame first, and the number of the network's outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Front<'a> {
    /// Number of the model's outputs that the network gives: those that follow the outputs of the previous network.
    pub outputs: usize,
    /// Shape and strength that readings become first; `None` for readings as they are.
    pub touch: Option<Touch<'a>>,
    /// Projection of these to the network's inputs; `None` if the network is given all of them.
    pub projection: Option<Projection<'a>>,
}

impl<'a> Front<'a> {
    /// No network.
    pub(crate) const NONE: Self = Self { outputs: 0, touch: None, projection: None };

    /// Number of inputs that a network behind it has, for so many `readings` of a frame.
    pub const fn inputs(&self, readings: usize) -> usize {
        match (&self.projection, &self.touch) {
            (Some(projection), _) => projection.features(),
            (None, Some(touch)) => touch.inputs(),
            (None, None) => readings,
        }
    }

    /// Shape and strength that readings become, if the network's outputs are places, which are missing without a touch.
    pub fn of_places(&self) -> Option<Touch<'a>> {
        self.touch.filter(|touch| touch.kind() == Kind::Place)
    }

    /// Words of its numbers, in slices that follow each other.
    pub(super) fn block(&self) -> [&'a [u32]; 2] {
        let words = |block: Option<&'a [f32]>| bytemuck::cast_slice(block.unwrap_or_default());
        [words(self.touch.map(|it| it.block())), words(self.projection.map(|it| it.block()))]
    }

    /// Header of its section; the block follows.
    pub(super) fn header(&self, features: u16, outputs: u16) -> FrontHeader {
        let kind = match self.touch.map(|it| it.kind()) {
            None => 0,
            Some(Kind::Place) => 1,
            Some(Kind::Amount) => 2,
        };
        FrontHeader { tag: TAG_FRONT, outputs, kind, features }
    }

    /// Cuts the section from the front of `bytes`; checks lengths, but no values.
    pub(super) fn take(
        bytes: &'a [u8],
        shape: ModelShape,
    ) -> Result<(Self, &'a [u8]), DecodeError> {
        const SECTION: &str = "front section";
        let (FrontHeader { outputs, kind, features, .. }, rest) =
            take::<FrontHeader>(bytes, SECTION)?;
        let (block, rest) = take_block(rest, SECTION)?;
        let kind = match kind {
            0 => None,
            1 => Some(Kind::Place),
            2 => Some(Kind::Amount),
            _ => return Err(DecodeError::Malformed { section: SECTION }),
        };
        let readings = shape.rows.saturating_mul(shape.inputs);
        let of_touch = kind.map_or(0, |_| touch::block_floats(readings));
        let inputs = readings.saturating_add(usize::from(kind.is_some()));
        let features = usize::from(features);
        let of_projection =
            if features > 0 { projection::block_floats(inputs, features) } else { 0 };
        let floats = of_touch.saturating_add(of_projection);
        check_count("bytes of a front", floats.saturating_mul(4), block.len())?;
        let block = bytemuck::try_cast_slice::<u8, f32>(block)
            .map_err(|_| DecodeError::Malformed { section: "padding" })?;
        let (of_touch, of_projection) = block.split_at_checked(of_touch).unwrap_or_default();
        let front = Self {
            outputs: outputs.into(),
            touch: kind.map(|kind| Touch::of_checked(kind, of_touch)),
            projection: (features > 0).then(|| Projection::of_checked(features, of_projection)),
        };
        Ok((front, rest))
    }

    /// Checks its values, which [`take`](Self::take) does not.
    pub(super) fn check(&self) -> Result<(), DecodeError> {
        if let Some(touch) = self.touch {
            Touch::new(touch.kind(), touch.block())
                .map_err(|cause| DecodeError::Touch { cause })?;
        }
        if let Some(it) = self.projection {
            Projection::new(it.readings(), it.features(), it.block())
                .map_err(|cause| DecodeError::Projection { cause })?;
        }
        Ok(())
    }
}

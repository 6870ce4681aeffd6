//! What a blob tells of its model beyond the weights.

use serde::{Deserialize, Serialize};

/// The sizes that a blob declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelShape {
    /// Row-wires: each has a block of `inputs` readings and a block of `outputs`.
    pub rows: usize,
    /// Readings a row.
    pub inputs: usize,
    /// Outputs a row.
    pub outputs: usize,
}

/// Names or units of columns, one a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns<'a>(pub &'a str);

impl<'a> Columns<'a> {
    /// The entries in their order.
    pub fn iter(self) -> impl Iterator<Item = &'a str> {
        // As a set of one: the search for a single `char` indexes a slice in a way that the optimiser
        // cannot prove, and would be the only reachable panic of the device path.
        self.0.split(['\n'])
    }
}

/// Little-endian `f32` at any address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Floats<'a>(#[serde(borrow)] pub &'a [u8]);

impl<'a> Floats<'a> {
    /// The bytes of `numbers`, where they lie.
    #[must_use]
    pub fn of(numbers: &'a [f32]) -> Self {
        Self(bytemuck::cast_slice(numbers))
    }

    /// The numbers in their order.
    pub fn iter(self) -> impl Iterator<Item = f32> + 'a {
        self.0.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes))
    }
}

/// How the noise of a training set was defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoiseKind {
    /// None was added (measured data, or an ideal sensor).
    None,
    /// R·(1 + p·n).
    Relative,
    /// R + p·(channel maximum − minimum)·n.
    Span,
}

/// What is known of a model beyond its weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metadata<'a> {
    /// Name of the scene or data set.
    pub name: &'a str,
    /// CRC-64/XZ of the scene or data file that trained it.
    pub scene_digest: u64,
    /// How the training noise was defined.
    pub noise_kind: NoiseKind,
    /// Training noise level p, as a fraction (0.005 is 0.5 %).
    pub noise_level: f32,
    /// Seed of every random draw in synthesis and training.
    pub seed: u64,
    /// Frames trained on.
    pub training_frames: u32,
    /// Sensor thickness H in mm, for the positional error; 0 where it has no meaning.
    pub thickness_mm: f32,
    /// Reading columns, row after row: `rows × inputs` names.
    pub input_names: Columns<'a>,
    /// Their units (empty for a plain number).
    pub input_units: Columns<'a>,
    /// Output columns, row after row: `rows × outputs` names.
    pub output_names: Columns<'a>,
    /// Their units.
    pub output_units: Columns<'a>,
    /// RMSE on the training data of each output, in its unit.
    pub training_rmse: Floats<'a>,
    /// Full scale of each output, in its unit, for %FS.
    pub full_scale: Floats<'a>,
}

//! Metadata of a blob: all that it says of its model beyond the weights.

use serde::{Deserialize, Serialize};

/// Number of rows of a model, and of inputs and outputs a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelShape {
    /// Number of row-wires; each has `inputs` readings and `outputs` outputs.
    pub rows: usize,
    /// Number of readings a row.
    pub inputs: usize,
    /// Number of outputs a row.
    pub outputs: usize,
}

/// Names or units of columns, one a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns<'a>(pub &'a str);

impl<'a> Columns<'a> {
    /// The columns' names or units, in their order.
    pub fn iter(self) -> impl Iterator<Item = &'a str> {
        // An array of one `char`: the search for a single `char` indexes a slice in a way that the optimiser
        // cannot prove safe. It would be the only reachable panic of the device path.
        self.0.split(['\n'])
    }

    /// Index of the column called `name`, from 0; `None` if there is none.
    ///
    /// ```
    /// use taxel_core::blob::Columns;
    /// let names = Columns("r1e1_dx_mm\nr1e1_dy_mm\nr1e1_dz_mm");
    /// assert_eq!(names.position("r1e1_dz_mm"), Some(2));
    /// assert_eq!(names.position("r1e1"), None);
    /// ```
    pub fn position(self, name: &str) -> Option<usize> {
        self.iter().position(|column| column == name)
    }
}

/// A list of little-endian `f32` numbers, borrowed from any address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Floats<'a>(#[serde(borrow)] pub &'a [u8]);

impl<'a> Floats<'a> {
    /// The bytes of `numbers`, where they lie.
    pub fn new(numbers: &'a [f32]) -> Self {
        Self(bytemuck::cast_slice(numbers))
    }

    /// The numbers, in their order.
    pub fn iter(self) -> impl Iterator<Item = f32> + 'a {
        self.0.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes))
    }
}

/// Definition of the noise of a training set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoiseKind {
    /// No noise was added (measured data, or an ideal sensor).
    None,
    /// Relative noise: R·(1 + p·n), with n standard normal.
    Relative,
    /// Noise relative to a channel's span: R + p·(channel maximum − minimum)·n, with n standard normal.
    Span,
    /// Absolute noise: R + p·n with p in Ω, and n standard normal.
    Absolute,
}

/// Metadata of a model: names, units, and how it was trained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metadata<'a> {
    /// Name of the scene or data set.
    pub name: &'a str,
    /// CRC-64/XZ of the scene or data file that trained it.
    pub scene_digest: u64,
    /// Definition of the training noise.
    pub noise_kind: NoiseKind,
    /// Training noise level p: a fraction (0.005 is 0.5 %), or in Ω for absolute noise.
    pub noise_level: f32,
    /// Seed of every random draw in synthesis and training.
    pub seed: u64,
    /// Number of frames that the model was trained on.
    pub training_frames: u32,
    /// Sensor thickness H in mm, for the positional error; 0 where it has no meaning.
    pub thickness_mm: f32,
    /// Whether the model's inputs are readings relative to the baseline, R/R₀ ([`relative`](crate::relative)), and
    /// not readings as they are.
    pub relative_inputs: bool,
    /// Names of the reading columns, row after row: `rows × inputs`.
    pub input_names: Columns<'a>,
    /// Units of the inputs (empty for a plain number, as relative ones are): `rows × inputs`.
    pub input_units: Columns<'a>,
    /// Names of the output columns, row after row: `rows × outputs`.
    pub output_names: Columns<'a>,
    /// Units of the output columns (empty for a plain number): `rows × outputs`.
    pub output_units: Columns<'a>,
    /// RMSE of each output on the training data, in the output's unit.
    pub training_rmse: Floats<'a>,
    /// Full scale of each output for %FS, in the output's unit.
    pub full_scale: Floats<'a>,
}

/// Largest number of inputs, and of outputs, in all rows that [`Metadata::unnamed`] serves.
const MOST_UNNAMED: usize = 1024;

/// Lines of one `letter` each, for [`MOST_UNNAMED`] columns.
const fn lines_of(letter: u8) -> [u8; 2 * MOST_UNNAMED] {
    let mut text = [b'\n'; 2 * MOST_UNNAMED];
    let mut column = 0;
    while column < MOST_UNNAMED {
        text[2 * column] = letter;
        column += 1;
    }
    text
}

static INPUT_NAMES: [u8; 2 * MOST_UNNAMED] = lines_of(b'x');
static OUTPUT_NAMES: [u8; 2 * MOST_UNNAMED] = lines_of(b'y');
static NO_UNITS: [u8; MOST_UNNAMED] = [b'\n'; MOST_UNNAMED];
static ZEROS: [u8; 4 * MOST_UNNAMED] = [0; 4 * MOST_UNNAMED];

impl Metadata<'static> {
    /// Metadata of a hand-made model of this `shape`. Every input is called `x` and every output `y`, without
    /// units; the fields about training are empty. Use it whole, or for the fields that do not matter.
    ///
    /// # Panics
    /// If all rows together have more than 1024 inputs or 1024 outputs.
    ///
    /// ```
    /// use taxel_core::blob::{Metadata, ModelShape};
    /// let shape = ModelShape { rows: 2, inputs: 2, outputs: 1 };
    /// let metadata = Metadata { name: "made", ..Metadata::unnamed(shape) };
    /// assert_eq!(metadata.input_names.0, "x\nx\nx\nx");
    /// assert_eq!(metadata.output_units.iter().count(), 2);
    /// ```
    pub fn unnamed(shape: ModelShape) -> Self {
        let columns = |bytes: &'static [u8], length: usize| {
            Columns(core::str::from_utf8(&bytes[..length.saturating_sub(1)]).unwrap_or_default())
        };
        let (inputs, outputs) = (shape.rows * shape.inputs, shape.rows * shape.outputs);
        Self {
            name: "",
            scene_digest: 0,
            noise_kind: NoiseKind::None,
            noise_level: 0.0,
            seed: 0,
            training_frames: 0,
            thickness_mm: 0.0,
            relative_inputs: false,
            input_names: columns(&INPUT_NAMES, 2 * inputs),
            input_units: columns(&NO_UNITS, inputs),
            output_names: columns(&OUTPUT_NAMES, 2 * outputs),
            output_units: columns(&NO_UNITS, outputs),
            training_rmse: Floats(&ZEROS[..4 * outputs]),
            full_scale: Floats(&ZEROS[..4 * outputs]),
        }
    }
}

//! The models whose cost is accepted: trained on the scene `press`, with all of its sensor or parts of it.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use taxel_core::rbf::Format;
use taxel_data::{AtRest, Silent, Stream};
use taxel_evaluate::tracking;
use taxel_learn::train::{Features, Kinds, train};
use taxel_learn::{ModelBlob, Options, Origin, pack};
use taxel_simulate::outputs::{ContactOutput, ElectrodeOutputs, Outputs, Quantity};
use taxel_simulate::sensor::{Axis, Sensor, default_lower_electrodes_mm};
use taxel_simulate::{Synthesis, World};

use crate::process::Outcome;

/// Noise level of the scene: large enough for widths and weights that every number format can hold.
const NOISE: f64 = 0.05;
/// Number of frames of the scene: somewhat more than centres.
const FRAMES: usize = 500;
/// Spread of one network for the whole array that every number format can hold.
const SPREAD_OF_ARRAY: f64 = 0.4;

/// What of the scene's sensor models decode, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// A network for each of the paper's rows: 18 readings to 18 deformations.
    Rows,
    /// One network for all of them.
    Array,
    /// One network for all readings and the contact's place and force.
    Contact,
    /// One network for all deformations, of shape and strength of a touch without thresholds.
    TouchArray,
    /// A network for the contact's place and one for its force, of shape and strength of a touch beyond thresholds.
    TouchContact,
    /// A network for each of four rows of seven readings, to 6 compressions.
    Mat,
    /// A network for each of eight rows of 32 readings, to 6 compressions.
    Wide,
    /// One row of 12 readings, to 6 compressions.
    Row,
}

impl Shape {
    /// Every shape, with the numbers of centres that are accepted.
    const ALL: [(Self, &'static [usize]); 8] = [
        (Self::Rows, &[16, 64]),
        (Self::Array, &[16, 64, 128]),
        (Self::Contact, &[64]),
        (Self::TouchArray, &[64]),
        (Self::TouchContact, &[64]),
        (Self::Mat, &[64]),
        (Self::Wide, &[64]),
        (Self::Row, &[64]),
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Rows => "8 x (18 -> 18)",
            Self::Array => "144 -> 144",
            Self::Contact => "144 -> 3",
            Self::TouchArray => "touch 144 -> 144",
            Self::TouchContact => "touch 144 -> 3",
            Self::Mat => "4 x (7 -> 6)",
            Self::Wide => "8 x (32 -> 6)",
            Self::Row => "1 x (12 -> 6)",
        }
    }

    fn is_array(self) -> bool {
        self.is_touch() || matches!(self, Self::Array | Self::Contact)
    }

    fn is_touch(self) -> bool {
        matches!(self, Self::TouchArray | Self::TouchContact)
    }

    fn world(self) -> World {
        let mut world = World::press();
        let z = ElectrodeOutputs { quantity: Quantity::Deformation, axes: vec![Axis::Z] };
        let (rows, columns) = match self {
            Self::Rows | Self::Array | Self::TouchArray => return world,
            Self::Contact | Self::TouchContact => {
                let contact = vec![ContactOutput::Centre, ContactOutput::Force];
                return World { outputs: Outputs::Contact(contact), ..world };
            }
            Self::Mat => (4, 7),
            Self::Wide => (8, 32),
            Self::Row => (1, 12),
        };
        world.read_rows.truncate(rows);
        world.outputs = z.into();
        let paper = Sensor::paper();
        let per_column = paper.electrodes_per_column_wire;
        world.sensor = Sensor {
            column_wires: columns,
            lower_electrodes_mm: default_lower_electrodes_mm(columns, per_column, 1, paper.size_mm),
            ..paper
        };
        world
    }
}

/// Files of a model, and of a frame for it.
pub struct Files {
    pub model: PathBuf,
    pub frame: PathBuf,
}

/// A model, and a frame of its training, none of whose readings is clamped.
pub struct Model {
    shape: Shape,
    format: Format,
    centres: usize,
    pub blob: ModelBlob,
    /// Readings in Ω.
    frame: Vec<f32>,
}

impl Model {
    /// Name of the model in tables.
    pub fn name(&self) -> String {
        format!("{} {} K = {}", self.format.name(), self.shape.name(), self.centres)
    }

    /// Whether it decodes frames of the scene `press`.
    pub fn is_of_press(&self) -> bool {
        matches!(self.shape, Shape::Rows | Shape::Array | Shape::Contact)
    }

    /// Writes model and frame into `directory`.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, directory: &Path) -> Outcome<Files> {
        let Self { shape, format, centres, .. } = self;
        let tracked = if self.blob.parse().tracker().is_some() { "-tracked" } else { "" };
        let stem = format!("{}-{shape:?}-{centres}{tracked}", format.name()).to_lowercase();
        let frame: Vec<u8> = self.frame.iter().flat_map(|reading| reading.to_le_bytes()).collect();
        let written = |kind, bytes: &[u8]| {
            let path = directory.join(&stem).with_extension(kind);
            fs::write(&path, bytes).map_err(|cause| format!("{}: {cause}", path.display()))?;
            Ok::<_, String>(path)
        };
        Ok(Files { model: written("bin", self.blob.bytes())?, frame: written("frame", &frame)? })
    }
}

/// Trains the models of all shapes and number formats.
///
/// # Errors
/// Training fails, or makes another format than was asked for.
pub fn train_all() -> Outcome<Vec<Model>> {
    let of_shape = |(shape, centres): (Shape, &'static [usize])| {
        Format::ALL
            .into_iter()
            .flat_map(move |format| centres.iter().map(move |k| (format, shape, *k)))
    };
    let wanted: Vec<_> = Shape::ALL.into_iter().flat_map(of_shape).collect();
    let made = wanted.into_par_iter().map(|(format, shape, centres)| made(format, shape, centres));
    made.collect()
}

/// Trains the models whose trackers are measured.
///
/// # Errors
/// As those of [`train_all`].
pub fn train_tracked() -> Outcome<Vec<Model>> {
    let tracked = |shape: Shape| {
        let model = made(Format::Fixed16, shape, 16)?;
        let blob = tracking::add(&model.blob, &shape.world());
        Ok(Model { blob: blob.map_err(|cause| cause.to_string())?, ..model })
    };
    [Shape::Rows, Shape::Mat, Shape::Wide].into_iter().map(tracked).collect()
}

fn made(format: Format, shape: Shape, centres: usize) -> Outcome<Model> {
    let world = shape.world();
    let synthesis = Synthesis::new(&world);
    let mut dataset = synthesis.clone().noise_level(NOISE).frames(Stream::Training, FRAMES);
    // Thresholds are multiples of the noise at rest. With little of it, the first frame is a touch.
    if shape == Shape::TouchContact {
        let rest = synthesis.noise_level(0.01 * NOISE).untouched();
        dataset.at_rest = Some(AtRest::of(&rest.frames(Stream::Calibration, FRAMES).inputs));
    }
    let usual = Options::of_rows();
    let each_row = !shape.is_array();
    let spread = if each_row { usual.spread } else { SPREAD_OF_ARRAY };
    let features = Features::Normalised { threshold: 3.0 };
    let kinds = shape.is_touch().then_some(Kinds::all(features));
    let options = Options { format, centres, each_row, spread, kinds, ..usual };
    let origin = Origin::of_data("press", 0, world.seed, &dataset);
    let failed = |cause: taxel_learn::Error| format!("{} in {format:?}: {cause}", shape.name());
    let trained = train(&dataset, &options, &Silent).map_err(failed)?;
    let blob = pack(&trained, &dataset, &origin).map_err(failed)?;
    let frame =
        dataset.inputs.lines().next().ok_or("no frame")?.iter().map(|it| *it as f32).collect();
    let model = Model { shape, format, centres, blob, frame };
    let as_asked = |network: taxel_core::rbf::Network<'_>| {
        (network.format(), network.shape().centres) == (format, centres)
    };
    if model.blob.parse().networks().all(as_asked) {
        Ok(model)
    } else {
        Err(format!("training made another model than {}", model.name()))
    }
}

//! Models that are exported and tried: four shapes, each in every number format, and one of them without a reading model.

use rayon::prelude::*;
use taxel_core::rbf::Format;
use taxel_data::dataset::{AtRest, Dataset};
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::reading_model::{self, Extent, HeldOut, Statistics};
use taxel_learn::train::{Features, Kinds, THRESHOLD, train};
use taxel_learn::{ModelBlob, Options, Origin, pack, relative};
use taxel_simulate::{Synthesis, World};

use crate::process::Outcome;

/// Noise level, frames of training, and spread: such that every number format holds all models.
const NOISE: f64 = 0.05;
const FRAMES: usize = 1500;
const SPREAD_OF_ARRAY: f64 = 0.4;

/// Noise level below which a touch of a few cells stands out.
const NOISE_OF_TOUCH: f64 = 0.003;

/// Features that the place of a touch is inferred from.
const FEATURES_OF_PLACE: usize = 5;

/// Shape of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The paper's sensor: a network a row, 18 readings to 18 outputs, which fills missing readings.
    Rows,
    /// The same model without a reading model.
    Bare,
    /// All of it by one network behind a projection, with a full reading model.
    Array,
    /// A mat of 4 × 7 cells: a network a row without affine tail, inputs relative to the baseline, a full reading
    /// model.
    Mat,
    /// Place, depth and force of a contact on 4 × 4 cells, by two networks behind shape and strength of the touch: the first
    /// has a projection. In f32 inputs are relative to the baseline, and it fills missing readings. In fixed16 inputs are
    /// readings, every other of which moves the other way, and it has a full reading model.
    Touch,
}

impl Shape {
    pub fn name(self) -> &'static str {
        match self {
            Self::Rows => "rows",
            Self::Bare => "bare",
            Self::Array => "array",
            Self::Mat => "mat",
            Self::Touch => "touch",
        }
    }

    fn world(self) -> World {
        let columns: &[usize] = match self {
            Self::Rows | Self::Bare | Self::Array => return World::press(),
            Self::Mat => &[0, 3, 6, 8, 11, 14, 17],
            Self::Touch => &[3, 6, 11, 14],
        };
        let mut world = if self == Self::Touch { World::contact() } else { World::press() };
        world.read_rows = (0..4).collect();
        world.sensor = world.sensor.with_columns(columns);
        world
    }
}

/// A model, and frames to try it with.
pub struct Model {
    pub shape: Shape,
    pub format: Format,
    pub blob: ModelBlob,
    /// Frames that it was not trained on, in Ω: `frames × readings`.
    pub frames: Vec<f64>,
    /// Mean of the frames of training, in Ω.
    pub baseline: Vec<f64>,
}

impl Model {
    /// Name of the model, for folders and tables.
    pub fn name(&self) -> String {
        format!("{}-{}", self.shape.name(), self.format.name())
    }
}

/// Trains all models, with so many `frames` to try each with.
pub fn all(frames: usize) -> Outcome<Vec<Model>> {
    let shapes = [Shape::Rows, Shape::Array, Shape::Mat, Shape::Touch];
    let mut wanted = shapes.map(|shape| Format::ALL.map(|format| (shape, format))).concat();
    wanted.push((Shape::Bare, Format::Fixed16));
    wanted.par_iter().map(|(shape, format)| made(*shape, *format, frames)).collect()
}

fn made(shape: Shape, format: Format, frames: usize) -> Outcome<Model> {
    let failed =
        |cause: taxel_learn::Error| format!("{} in {}: {cause}", shape.name(), format.name());
    let world = shape.world();
    let noise = if shape == Shape::Touch { NOISE_OF_TOUCH } else { NOISE };
    let all = Synthesis::new(&world).noise_level(noise);
    let mirrors = shape == Shape::Touch && format == Format::Fixed16;
    let rest = all.clone().untouched().frames(Stream::Calibration, FRAMES).inputs;
    let at_rest = AtRest::of(&rest);
    let synthesis = |stream, frames| {
        let mut dataset = all.frames(stream, frames);
        if mirrors {
            let levels = at_rest.level.iter().cycle().enumerate();
            let readings = dataset.inputs.values.iter_mut().zip(levels);
            readings
                .filter(|(_, (i, _))| i % 2 == 1)
                .for_each(|(it, (_, level))| *it = 2.0 * level - *it);
        }
        let baseline = if shape == Shape::Touch { means(&rest) } else { means(&dataset.inputs) };
        (dataset, baseline)
    };
    let (dataset, baseline) = synthesis(Stream::Training, FRAMES);
    let (held_out, _) = synthesis(Stream::Calibration, FRAMES);
    let of_model = |dataset: Dataset| match (shape, format) {
        (Shape::Mat, _) => relative::dataset(dataset, &baseline),
        (Shape::Touch, Format::F32) => {
            let at_rest = Some(AtRest::of(&relative::inputs(&rest, &baseline)));
            Dataset { at_rest, ..relative::dataset(dataset, &baseline) }
        }
        (Shape::Touch, _) => Dataset { at_rest: Some(at_rest.clone()), ..dataset },
        _ => dataset,
    };
    let (dataset, held_out) = (of_model(dataset), of_model(held_out));
    let usual = Options::of_rows();
    let kinds = Kinds::all(Features::Normalised { threshold: THRESHOLD });
    let options = Options {
        format,
        affine_tail: shape != Shape::Mat,
        each_row: !matches!(shape, Shape::Array | Shape::Touch),
        spread: if shape == Shape::Array { SPREAD_OF_ARRAY } else { usual.spread },
        kinds: (shape == Shape::Touch).then_some(kinds),
        ..usual
    };
    let origin = Origin::of_data("press", 0, world.seed, &dataset);
    let mut trained = train(&dataset, &options, &Silent).map_err(failed)?;
    if shape == Shape::Touch {
        let projected = Options { features: Some(FEATURES_OF_PLACE), ..options };
        let mut projected = train(&dataset, &projected, &Silent).map_err(failed)?;
        trained.fronts[0] = projected.fronts.remove(0);
        trained.networks[0] = projected.networks.remove(0);
    }
    let blob = pack(&trained, &dataset, &origin).map_err(failed)?;
    let extent = match (shape, format) {
        (Shape::Bare, _) => None,
        (Shape::Rows, _) | (Shape::Touch, Format::F32) => Some(Extent::Fill),
        _ => Some(Extent::Full),
    };
    let blob = match extent {
        Some(extent) => {
            let statistics = Statistics::fit(&dataset.inputs, extent, 1).map_err(failed)?;
            let mut others = HeldOut::default();
            if extent == Extent::Full {
                others.add(&blob, &statistics, &held_out);
            }
            reading_model::add(&blob, &statistics, &others).map_err(failed)?
        }
        None => blob,
    };
    let is_as_asked = blob.parse().networks().all(|network| network.format() == format);
    if !is_as_asked {
        return Err(format!(
            "{}: training made another format than {}",
            shape.name(),
            format.name()
        ));
    }
    let frames = synthesis(Stream::Test, frames).0.inputs.values.into_vec();
    Ok(Model { shape, format, blob, frames, baseline: baseline.values.into_vec() })
}

/// Mean of each column, as a table of one line.
fn means(table: &Table) -> Table {
    let columns = table.names.len();
    let mean = |column: usize| {
        let values = table.values.iter().skip(column).step_by(columns);
        values.sum::<f64>() / table.len() as f64
    };
    Table { names: table.names.clone(), values: (0..columns).map(mean).collect() }
}

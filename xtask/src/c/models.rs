//! Models that are exported and tried: three shapes, each in every number format.

use rayon::prelude::*;
use taxel_core::rbf::Format;
use taxel_data::dataset::Dataset;
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::confidence::{self, Density, HeldOut, Settings};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, fill, pack, relative};
use taxel_simulate::{Synthesis, World};

use crate::process::Outcome;

/// Noise level, frames of training, and spread: such that every number format holds all models.
const NOISE: f64 = 0.05;
const FRAMES: usize = 1500;
const SPREAD_OF_ARRAY: f64 = 0.4;

/// Shape of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The paper's sensor: a network a row, 18 readings to 18 outputs, with a fill.
    Rows,
    /// All of it by one network behind a projection, with a confidence and a fill.
    Array,
    /// A mat of 4 × 7 cells: a network a row without affine tail, inputs relative to the baseline, a confidence.
    Mat,
}

impl Shape {
    pub const ALL: [Self; 3] = [Self::Rows, Self::Array, Self::Mat];

    pub fn name(self) -> &'static str {
        match self {
            Self::Rows => "rows",
            Self::Array => "array",
            Self::Mat => "mat",
        }
    }

    fn world(self) -> World {
        let mut world = World::press();
        if self == Self::Mat {
            world.read_rows = (0..4).collect();
            world.sensor = world.sensor.with_columns(&[0, 3, 6, 8, 11, 14, 17]);
        }
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
    let wanted = Shape::ALL.into_iter().flat_map(|shape| Format::ALL.map(|format| (shape, format)));
    let wanted: Vec<_> = wanted.collect();
    wanted.par_iter().map(|(shape, format)| made(*shape, *format, frames)).collect()
}

fn made(shape: Shape, format: Format, frames: usize) -> Outcome<Model> {
    let failed =
        |cause: taxel_learn::Error| format!("{} in {}: {cause}", shape.name(), format.name());
    let world = shape.world();
    let synthesis = |stream, frames| {
        let dataset = Synthesis::new(&world).noise_level(NOISE).frames(stream, frames);
        let baseline = means(&dataset.inputs);
        (dataset, baseline)
    };
    let (dataset, baseline) = synthesis(Stream::Training, FRAMES);
    let (held_out, _) = synthesis(Stream::Calibration, FRAMES);
    let of_model = |dataset: Dataset| match shape {
        Shape::Mat => relative::dataset(dataset, &baseline),
        _ => dataset,
    };
    let (dataset, held_out) = (of_model(dataset), of_model(held_out));
    let usual = Options::of_rows();
    let array = shape == Shape::Array;
    let options = Options {
        format,
        affine_tail: shape != Shape::Mat,
        each_row: !array,
        spread: if array { SPREAD_OF_ARRAY } else { usual.spread },
        ..usual
    };
    let origin = Origin::of_data("press", 0, world.seed, &dataset);
    let trained = train(&dataset, &options, &Silent).map_err(failed)?;
    let mut blob = pack(&trained, &dataset, &origin).map_err(failed)?;
    if shape != Shape::Rows {
        let density = Density::fit(&dataset, &Settings::default());
        let mut others = HeldOut::default();
        others.add(&blob, &density, &held_out);
        blob = confidence::add(&blob, &density, &others).map_err(failed)?;
    }
    if shape != Shape::Mat {
        blob = fill::add(&blob, &dataset.inputs).map_err(failed)?;
    }
    let is_as_asked = blob.parse().networks().all(|network| network.format() == format);
    if !is_as_asked {
        return Err(format!(
            "{}: training made another format than {}",
            shape.name(),
            format.name()
        ));
    }
    let frames = synthesis(Stream::Test, frames).0.inputs.values;
    Ok(Model { shape, format, blob, frames, baseline: baseline.values })
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

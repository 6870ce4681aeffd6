//! Trains the models that are measured: the one place that calls the library for training.

use host_sim::model::{self, Origin};
use host_sim::number_format::NumberFormat;
use host_sim::progress::Progress;
use host_sim::random::Stream;
use host_sim::scene::Scene;
use host_sim::{synth, train as trainer};
use model_core::rbf::Format;
use rayon::prelude::*;

use crate::process::Outcome;

/// The scene that is trained on.
const SCENE: &str = "press";

/// Its noise: enough that widths and weights stay where every format holds them.
const NOISE: f64 = 0.05;

/// Its frames: a few more than there are centres.
const FRAMES: usize = 500;

/// Width of one network for the whole array at which every format holds it.
const SPREAD_OF_ARRAY: f64 = 0.4;

/// A model to be trained.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    pub format: Format,
    /// K.
    pub centres: usize,
    /// One network for the whole array, instead of one a row.
    pub whole_array: bool,
}

/// The blobs of the models `wanted`, in their order: what `host-sim train press -n 500 --noise 0.05` writes with
/// the options for each.
///
/// # Errors
/// A model cannot be trained.
pub fn train(wanted: &[Wanted]) -> Outcome<Vec<Vec<u8>>> {
    let failed = |cause: host_sim::Error| format!("training: {cause}");
    let mut scene = Scene::load(SCENE).map_err(failed)?;
    scene.set_noise_level(NOISE).map_err(failed)?;
    let dataset = synth::synthesise(&scene, Stream::Training, FRAMES);
    let origin = Origin::of_scene(&scene);
    let blob = |wanted: &Wanted| {
        let mut options = model::options_of(&scene);
        options.format = of_options(wanted.format);
        options.centres = wanted.centres;
        if wanted.whole_array {
            options.whole_array = true;
            options.spread = SPREAD_OF_ARRAY;
        }
        let trained = trainer::train(&dataset, &options, &Progress::silent())?;
        model::encode(&trained, &dataset, &origin)
    };
    wanted.par_iter().map(blob).collect::<Result<_, _>>().map_err(failed)
}

fn of_options(format: Format) -> NumberFormat {
    match format {
        Format::F32Direct => NumberFormat::F32Direct,
        Format::F32 => NumberFormat::F32,
        Format::Fixed16 => NumberFormat::Fixed16,
    }
}

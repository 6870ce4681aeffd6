//! Trains the models that are measured: the one place that calls the library for training.

use model_core::rbf::Format;
use rayon::prelude::*;
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_learn::{Error, ModelBlob, Options, Origin, pack, train as trainer};
use taxel_simulate::{Synthesis, World};

use crate::process::Outcome;

/// The name of the scene that is trained on.
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

/// The blobs of the models `wanted`, in their order: their networks are those that
/// `host-sim train press -n 500 --noise 0.05` trains with the options for each.
///
/// # Errors
/// A model cannot be trained.
pub fn train(wanted: &[Wanted]) -> Outcome<Vec<ModelBlob>> {
    let world = World::press();
    let dataset = Synthesis::of(&world).noise_level(NOISE).frames(Stream::Training, FRAMES);
    let origin = Origin::of_data(SCENE, 0, world.seed, &dataset);
    let blob = |wanted: &Wanted| -> Result<ModelBlob, Error> {
        let &Wanted { format, centres, whole_array } = wanted;
        let mut options = Options { format, centres, whole_array, ..Options::default() };
        if whole_array {
            options.spread = SPREAD_OF_ARRAY;
        }
        let trained = trainer::train(&dataset, &options, &Silent)?;
        pack(&trained, &dataset, &origin)
    };
    let blobs = wanted.par_iter().map(blob).collect::<Result<_, _>>();
    blobs.map_err(|cause| format!("training: {cause}"))
}

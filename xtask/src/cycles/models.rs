//! The models whose cost is accepted: trained on the scene `press`, as by `host-sim train press -n 500 --noise 0.05`, in
//! every number format.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use taxel_core::blob::{Floats, ModelParts, encode_to_vec};
use taxel_core::rbf::Format;
use taxel_data::{Dataset, Silent, Stream};
use taxel_learn::{ModelBlob, Options, Origin, pack, train as trainer};
use taxel_simulate::{Synthesis, World};

use crate::process::Outcome;

/// Numbers of centres K.
const CENTRES: [usize; 5] = [16, 32, 64, 128, 256];

/// Largest blob in bytes that a slot holds, in the image as on every device.
const SLOT_BYTES: usize = 131_072;

/// Noise level of the scene: large enough for widths and weights that every number format can hold.
const NOISE: f64 = 0.05;

/// Number of frames of the scene: somewhat more than centres.
const FRAMES: usize = 500;

/// Spread of one network for the whole array that every number format can hold.
const SPREAD_OF_ARRAY: f64 = 0.4;

/// A model to be measured.
pub struct Model {
    pub path: PathBuf,
    /// Number of centres K.
    pub centres: usize,
    /// Whether it has an affine tail.
    pub affine: bool,
}

/// Trains models of every format and size, with a network a row and with one for the whole array, with affine tail and
/// without, as far as they are `wanted`, and writes them into `directory`.
///
/// All rows get the first row's network, so that the largest model fits the image's slot. A model that does not
/// fit is left out.
///
/// # Errors
/// Training fails, or makes another model than requested.
pub fn train(directory: &Path, wanted: impl Fn(&Options) -> bool) -> Outcome<Vec<Model>> {
    fs::create_dir_all(directory).map_err(|cause| cause.to_string())?;
    let world = World::press();
    let dataset = Synthesis::new(&world).noise_level(NOISE).frames(Stream::Training, FRAMES);
    let origin = Origin::of_data("press", 0, world.seed, &dataset);
    let mut tried = Vec::new();
    for format in Format::ALL {
        for centres in CENTRES {
            for (whole_array, affine_tail) in
                [(false, false), (false, true), (true, false), (true, true)]
            {
                let usual = Options::of_rows();
                let spread = if whole_array { SPREAD_OF_ARRAY } else { usual.spread };
                let options = Options {
                    format,
                    centres,
                    each_row: !whole_array,
                    affine_tail,
                    spread,
                    ..usual
                };
                tried.push(options);
            }
        }
    }
    let model = |options: &Options| {
        let array = if !options.each_row { "-array" } else { "" };
        let tail = if options.affine_tail { "-affine" } else { "" };
        let name = format!("{}-{}{array}{tail}", options.format.name(), options.centres);
        let blob = blob(&dataset, options, &origin).map_err(|cause| format!("{name}: {cause}"))?;
        if blob.len() > SLOT_BYTES {
            eprintln!("left out: {name} is larger than a slot");
            return Ok(None);
        }
        let path = directory.join(format!("{name}.bin"));
        fs::write(&path, blob).map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(Some(Model { path, centres: options.centres, affine: options.affine_tail }))
    };
    tried.retain(wanted);
    let models: Vec<Option<Model>> = tried.par_iter().map(model).collect::<Outcome<_>>()?;
    Ok(models.into_iter().flatten().collect())
}

/// The blob of a model in which every row has the first row's network.
fn blob(dataset: &Dataset, options: &Options, origin: &Origin) -> Outcome<Vec<u8>> {
    let trained = trainer::train(dataset, options, &Silent).map_err(|cause| cause.to_string())?;
    let blob: ModelBlob = pack(&trained, dataset, origin).map_err(|cause| cause.to_string())?;
    let model = blob.parse();
    let first = model.networks().next().ok_or("a model without networks")?;
    let parts = ModelParts {
        projection: model.projection(),
        confidence: None,
        linear_rmse: Floats(&[]),
        fill: None,
        networks: &[first],
        row_network: &vec![0; model.shape().rows],
        metadata: *model.metadata(),
    };
    let bytes = encode_to_vec(&parts).map_err(|cause| cause.to_string())?.to_vec();
    let is_as_asked = (first.format(), first.shape().centres) == (options.format, options.centres);
    // What does not fit is left out, whatever it is.
    if is_as_asked || bytes.len() > SLOT_BYTES {
        return Ok(bytes);
    }
    let made = first.format().name();
    Err(format!("training made {made} of {} centres", first.shape().centres))
}

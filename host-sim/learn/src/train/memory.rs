//! Memory that training takes at its peak, estimated before it is taken: it grows with the square of the number of
//! weights, so that a small file may ask for more than a machine has.

use taxel_data::error::in_words;
use taxel_data::{BadValue, Dataset, require};

use super::{MOST_MEMORY_BYTES, Options, projection, touch};

/// Copies of what networks are given that are held at once: two, before and after refinement, and a scaled one.
const COPIES: f64 = 3.0;
/// Triangles of the weights that are held at once while these are fitted: a decomposition, the sum of several, and the
/// factor that comes of it. Where a number format falls back to another one, there are two decompositions.
const TRIANGLES: f64 = 4.0;
/// Matrices as large as all readings and outputs squared that a projection takes.
const MATRICES: f64 = 4.0;
/// Bytes of a number.
const F64: f64 = 8.0;

/// Bytes that training on `dataset` with `options` takes at its peak, about. Refinement holds its samples in so many
/// `pieces`, each with the square of all weights.
pub fn peak_bytes(dataset: &Dataset, options: &Options, pieces: Option<usize>) -> u64 {
    let [frames, readings, all_outputs, rows] =
        [dataset.frames(), dataset.inputs.names.len(), dataset.outputs.names.len(), dataset.rows]
            .map(|count| count as f64);
    let usual = projection::usual_features(dataset.rows, dataset.inputs.names.len());
    let features = options.features.unwrap_or(usual) as f64;
    let projects = options.projects(dataset);
    let (networks, inputs) = if projects { (1.0, features) } else { (rows, readings / rows) };
    let outputs = all_outputs / networks;
    let weights = options.centres as f64 + 1.0 + if options.affine_tail { inputs } else { 0.0 };
    let at_once = networks.min(rayon::current_num_threads() as f64);
    let square = weights * (weights + outputs);
    let tasks = dataset.outputs.missing_together().len() as f64;
    let fit = TRIANGLES * tasks * square * F64;
    let of_refinement = pieces.map_or(0.0, |pieces| (pieces as f64 + 2.0 + tasks) * square * F64);
    let projected = if projects { (readings + all_outputs).powi(2) } else { 0.0 };
    // The linear decoder that every model is judged beside.
    let linear = (readings / rows + 1.0).powi(2) * TRIANGLES * F64;
    // The frames themselves, shared by all; another copy where outputs are missing, of one task after the other; and the
    // examples that shapes are fitted to.
    let copies = if tasks > 1.0 { 2.0 } else { 1.0 };
    let examples = frames.min(touch::MOST_EXAMPLES as f64);
    let of_rows = if networks > 1.0 { outputs } else { 0.0 };
    let given = at_once * frames * (COPIES * inputs + of_rows);
    let samples = ((copies * frames + 2.0 * examples) * (readings + all_outputs) + given) * F64;
    let most = [at_once * fit, at_once * of_refinement, MATRICES * projected * F64, linear];
    (samples + most.into_iter().fold(0.0, f64::max)) as u64
}

/// Checks that training takes no more than [`MOST_MEMORY_BYTES`].
///
/// # Errors
/// [`BadValue`] that tells how much it would take.
pub(super) fn check(
    dataset: &Dataset,
    options: &Options,
    pieces: Option<usize>,
) -> Result<(), BadValue> {
    let (needed, most) = (peak_bytes(dataset, options, pieces), MOST_MEMORY_BYTES);
    require(needed <= most, "memory", format!("about {}", in_words(needed)), || {
        format!(
            "training may take at most {}; memory grows with the square of the number of centres and of inputs: give \
             fewer",
            in_words(most)
        )
    })
}

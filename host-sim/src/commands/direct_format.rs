//! Note where a model was to be in f32, and got the slower formula for distances.

use taxel_core::blob::Model;
use taxel_core::rbf::Format;
use taxel_data::{Dataset, Silent};
use taxel_learn::Options;
use taxel_learn::train::projection;

use super::stderr;

/// Notes on stderr that a network of `model` was to be in f32 and is in f32-direct, with the reason and what is faster, as
/// tried on some of the `frames`.
pub fn note(model: &Model<'_>, options: &Options, frames: Option<&Dataset>) {
    let is_direct = model.networks().any(|network| network.format() == Format::F32Direct);
    if options.format == Format::F32 && is_direct {
        stderr::remark(format_args!("note: {}", why(options, frames)));
    }
}

/// Reason for direct distances in a model that was to be in f32, and what is faster. Whether fixed16 holds such a network is
/// tried on some of the `frames`.
fn why(options: &Options, frames: Option<&Dataset>) -> String {
    /// Frames that tell whether centres and widths fit a format.
    const TRIED: usize = 1000;
    let fix = frames.map_or("--format fixed16 may hold it".into(), |frames| {
        let step = frames.frames().div_ceil(TRIED);
        let few: Vec<usize> = (0..frames.frames()).step_by(step).collect();
        let fixed = Options { format: Format::Fixed16, ..*options };
        if few.len() <= options.centres {
            return "--format fixed16 may hold it".to_owned();
        }
        if taxel_learn::train::train(&frames.subset(&few), &fixed, &Silent).is_ok() {
            return "use --format fixed16".to_owned();
        }
        let fewer = projection::features_at_most(frames, 16);
        if options.whole_array || fewer == 0 {
            return "--format fixed16 does not hold it either at this --spread".to_owned();
        }
        format!(
            "--format fixed16 does not hold it either at this --spread; --whole-array --features {fewer} gives the network \
             fewer inputs"
        )
    });
    format!(
        "the fast formula for distances could lose accuracy in f32 with this model (little noise, many centres or a large \
         spread), so the exact one is used, which takes a device more than twice as long; {fix}"
    )
}

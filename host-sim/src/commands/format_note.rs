//! Note on the number format of a model that was trained.

use taxel_core::blob::Model;
use taxel_core::rbf::Format;
use taxel_learn::Options;

use super::Common;

/// Notes on stderr that a `model` is in f32, because no other format was asked for and fixed16 does not hold it. A frame of it
/// takes so many `cycles`.
pub fn note_format(model: &Model<'_>, options: &Options, cycles: u64, common: &Common) {
    let is_other = model.networks().any(|network| network.format() != options.format);
    if options.or_f32 && is_other {
        common.remark(format_args!(
            "note: the model does not fit {} (--format {0} gives the reason), so it is in {}: a frame takes {cycles} cycles",
            options.format.name(),
            Format::F32.name()
        ));
    }
}

//! Models as source code, for a program that never changes its model.

mod text;

pub mod c;
pub mod rust;

use crate::cost::Design;
use crate::packing::ModelBlob;

/// Number of bytes that the numbers of the model in `blob` take, in any language.
#[must_use]
pub fn constant_bytes(blob: &ModelBlob) -> usize {
    let model = blob.parse();
    let floats = model.reading_model().map_or(0, |it| it.block().len());
    Design::new(blob).parameter_bytes() + 4 * floats
}

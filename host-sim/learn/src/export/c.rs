//! Models as a library in C99: one source file with its header, and what CMake, Arduino, PlatformIO and Zephyr ask for.
//!
//! The code stands in `c/source` as templates, what lies around it in `c/library`. Here parts are chosen and numbers are
//! printed. The C code repeats the arithmetic of taxel-core operation by operation.

mod name;
pub mod template;
pub mod numbers;
mod facts;
mod selftest;
mod source;

pub use name::{BadName, Name};

use std::fs;
use std::path::Path;

use taxel_core::health::Limits;
use taxel_data::output::write_folder;
use taxel_data::{BadValue, columns};

use crate::error::Result;
use crate::packing::ModelBlob;
use facts::Facts;
use template::Values;

/// A file of the library: its path in the folder, and its text.
pub type SourceFile = (String, String);

/// Texts around the source, by their paths.
const LIBRARY: [(&str, &str); 9] = [
    ("README.md", include_str!("c/library/README.md")),
    ("LICENSE", include_str!("c/library/LICENSE")),
    ("CMakeLists.txt", include_str!("c/library/CMakeLists.txt")),
    ("library.properties", include_str!("c/library/library.properties")),
    ("library.json", include_str!("c/library/library.json")),
    ("zephyr/module.yml", include_str!("c/library/zephyr/module.yml")),
    ("zephyr/CMakeLists.txt", include_str!("c/library/zephyr/CMakeLists.txt")),
    ("examples/Decode/Decode.ino", include_str!("c/library/examples/Decode/Decode.ino")),
    ("examples/posix/main.c", include_str!("c/library/examples/posix/main.c")),
];

/// What the header of every library says.
const WRITTEN_BY_EXPORT: &str = "`taxel export` wrote this file";

fn header_path(name: &Name) -> String {
    format!("src/{}.h", name.lower())
}

/// The files of a library that decodes as the model in `blob` does, to the bit; all that it declares begins with `name`.
/// Readings in Ω outside of `limits` are missing.
///
/// # Errors
/// [`Error`](crate::Error) if the model does not decode the frames of its self-test.
pub fn library(blob: &ModelBlob, name: &Name, limits: Option<Limits>) -> Result<Vec<SourceFile>> {
    let model = blob.parse();
    let limits =
        limits.filter(|_| model.metadata().input_names.iter().any(columns::is_judged_in_ohm));
    let (flags, mut values) = (source::flags(&model, limits), Values::default());
    Facts::new(blob).tell(&mut values, name, limits);
    let filled = |text| template::fill(text, name, &flags, &values);
    let mut files: Vec<SourceFile> =
        LIBRARY.iter().map(|(path, text)| ((*path).to_owned(), filled(text))).collect();
    files.push((header_path(name), source::header(name, &flags, &values)));
    files.push((
        format!("src/{}.c", name.lower()),
        source::code(&model, name, limits, &flags, &mut values)?,
    ));
    Ok(files)
}

/// Writes the [`library`] of `blob` to `folder`, whole or not at all. Other files in it stay.
///
/// # Errors
/// [`Error`](crate::Error) if there are files in `folder` that no export under this `name` wrote, if it cannot be written, or as
/// [`library`].
pub fn write(blob: &ModelBlob, name: &Name, limits: Option<Limits>, folder: &Path) -> Result<()> {
    let is_empty = fs::read_dir(folder).is_ok_and(|mut files| files.next().is_none());
    let header = folder.join(header_path(name));
    let is_own = || fs::read_to_string(header).is_ok_and(|text| text.contains(WRITTEN_BY_EXPORT));
    if folder.is_dir() && !is_empty && !is_own() {
        let rule = format!(
            "it has files that are not of library {} from an earlier export, and some might be replaced; give a new folder",
            name.lower()
        );
        return Err(BadValue::new("folder", folder.display(), rule).into());
    }
    write_folder(folder, &library(blob, name, limits)?)
}

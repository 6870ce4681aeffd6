//! Models as a library in C99: one source file with its header, and what CMake, Arduino, PlatformIO and Zephyr ask for.
//!
//! The code stands in `c/source` as templates, what lies around it in `c/library`. Here parts are chosen and numbers are
//! printed. The C code repeats the arithmetic of taxel-core operation by operation.

mod name;
mod template;
mod numbers;
mod facts;
mod selftest;
mod source;

pub use name::{BadName, Name};

use crate::error::Result;
use crate::packing::ModelBlob;
use facts::Facts;
use template::Values;

/// A file of the library: its path in the folder, and its text.
pub type SourceFile = (String, String);

/// Texts around the source, by their paths.
const LIBRARY: [(&str, &str); 8] = [
    ("README.md", include_str!("c/library/README.md")),
    ("CMakeLists.txt", include_str!("c/library/CMakeLists.txt")),
    ("library.properties", include_str!("c/library/library.properties")),
    ("library.json", include_str!("c/library/library.json")),
    ("zephyr/module.yml", include_str!("c/library/zephyr/module.yml")),
    ("zephyr/CMakeLists.txt", include_str!("c/library/zephyr/CMakeLists.txt")),
    ("examples/Decode/Decode.ino", include_str!("c/library/examples/Decode/Decode.ino")),
    ("examples/posix/main.c", include_str!("c/library/examples/posix/main.c")),
];

/// The files of a library that decodes as the model in `blob` does, to the bit; all that it declares begins with `name`.
///
/// # Errors
/// [`Error`](crate::Error) if the prices from which its cost is predicted are not sound.
pub fn library(blob: &ModelBlob, name: &Name) -> Result<Vec<SourceFile>> {
    let model = blob.parse();
    let facts = Facts::new(blob)?;
    let (flags, mut values) = (source::flags(&model), Values::default());
    facts.tell(&mut values);
    let filled = |text| template::fill(text, name, &flags, &values);
    let mut files: Vec<SourceFile> =
        LIBRARY.iter().map(|(path, text)| ((*path).to_owned(), filled(text))).collect();
    files.push((format!("src/{}.h", name.lower()), source::header(name, &flags, &values)));
    files.push((
        format!("src/{}.c", name.lower()),
        source::code(&model, name, &flags, &mut values)?,
    ));
    Ok(files)
}

/// Number of bytes that the constants of the library of `blob` take.
#[must_use]
pub fn constant_bytes(blob: &ModelBlob) -> usize {
    facts::constant_bytes(blob)
}

#[cfg(test)]
mod tests;

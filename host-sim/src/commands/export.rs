//! Command `export`: a model as source code.

use std::path::PathBuf;

use crate::report::Sections;
use crate::{Error, Result};
use clap::{ArgGroup, Args};
use taxel_data::output::write_bytes;
use taxel_learn::ModelBlob;
use taxel_learn::export::c::{self, Name};
use taxel_learn::export::{constant_bytes, rust};

use super::health::LimitsArgument;
use super::{Common, print};

/// Write a model as source code in C or Rust, for a program that never changes its model.
///
/// The C export is a library in a folder: one C99 source file with its header, and files for CMake, Arduino, PlatformIO and
/// Zephyr. It needs no heap and no other library, supports every model, and equals the blob bit for bit (docs/c.md).
///
/// The Rust export is a file of arrays of fixed size, and functions that call `taxel_core` with them. Nothing is parsed
/// at run time, and nothing can fail. It supports every model, too, and equals the blob bit for bit (docs/c.md).
#[derive(Args)]
#[command(group(ArgGroup::new("language").required(true)))]
#[command(after_help = "Examples:
  taxel train press -o press.bin
  taxel export press.bin --c lib/press --name press
  taxel export press.bin --rust src/press.rs")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// Folder to write the C library to: a new one, or that of an earlier export under this name.
    #[arg(long, value_name = "DIR", group = "language")]
    c: Option<PathBuf>,
    /// Name of the library in lower-case letters; all its declarations begin with it.
    #[arg(long, value_parser = Name::new, default_value = "taxel_model", conflicts_with = "rust")]
    name: Name,
    #[command(flatten)]
    limits: LimitsArgument,
    /// Rust source file to write.
    #[arg(long, value_name = "FILE", group = "language")]
    rust: Option<PathBuf>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let read = || ModelBlob::read(&arguments.model);
    let (written, blob);
    if let Some(file) = &arguments.rust {
        print::check_output(file, &[&arguments.model])
            .map_err(|cause| Error::Usage(format!("{cause} (--rust)")))?;
        (written, blob) = (file, read()?);
        write_bytes(file, rust::source(&blob.parse()).as_bytes())?;
    } else {
        let folder = arguments.c.as_ref().ok_or_else(|| Error::Usage("--c or --rust".into()))?;
        (written, blob) = (folder, read()?);
        c::write(&blob, &arguments.name, arguments.limits.believed(), folder)?;
    }
    let model = blob.parse();
    if model.tracker().is_some() {
        common.remark("note: the source decodes each frame by itself, without the model's tracker");
    }
    let mut result = Sections::new("Model as source code");
    result.fact("subject", "trained on", "", model.metadata().name);
    result.fact("model_crc", "CRC-32", "", format!("{:08x}", model.crc()));
    result.fact("rows", "rows", "", model.shape().rows);
    result.fact("networks", "networks", "", model.network_count());
    result.fact("weight_bytes", "numbers", "bytes", constant_bytes(&blob));
    result.fact("file", "written to", "", written.display().to_string());
    Ok(print::sections(common, &result))
}

//! Command `export`: a model as source code.

use std::path::PathBuf;

use crate::{Error, Result};
use clap::{ArgGroup, Args};
use serde::Serialize;
use taxel_data::output::write_bytes;
use taxel_learn::ModelBlob;
use taxel_learn::export::c::{self, Name};
use taxel_learn::export::{constant_bytes, rust};

use super::{Common, print};

/// Write a model as source code in C or Rust, for a program that never changes its model.
///
/// In C, it is a library in a folder: one source file in C99 with its header, and what CMake, Arduino, PlatformIO and Zephyr
/// need. It needs no heap and no other library, holds any model, and gives the bits that the blob gives (docs/c.md).
///
/// In Rust, it is a file of arrays of fixed size, and functions that call `taxel_core` with them. Nothing in it is parsed, and
/// nothing can fail. It holds any model, too, and gives the bits that the blob gives (docs/formats.md).
#[derive(Args)]
#[command(group(ArgGroup::new("language").required(true)))]
#[command(after_help = "Examples:
  host-sim train press -o press.bin
  host-sim export press.bin --c lib/press --name press
  host-sim export press.bin --rust src/press.rs")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// Folder to write as a library in C: a new one, or that of an earlier export under this name.
    #[arg(long, value_name = "DIR", group = "language")]
    c: Option<PathBuf>,
    /// Name of the library, with which all that it declares begins, in small letters.
    #[arg(long, value_parser = Name::new, default_value = "taxel_model", conflicts_with = "rust")]
    name: Name,
    /// Rust source file to write.
    #[arg(long, value_name = "FILE", group = "language")]
    rust: Option<PathBuf>,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    model_crc: String,
    rows: usize,
    /// Networks; rows may share them.
    networks: usize,
    /// Bytes that the model's numbers take in flash.
    weight_bytes: usize,
    /// File or folder that was written.
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
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
        c::write(&blob, &arguments.name, folder)?;
    }
    let model = blob.parse();
    let summary = Summary {
        subject: model.metadata().name.into(),
        model_crc: format!("{:08x}", model.crc()),
        rows: model.shape().rows,
        networks: model.network_count(),
        weight_bytes: constant_bytes(&blob),
        file: written.clone(),
    };
    print::result(common, &summary, || {
        print::Page::of(format_args!(
            "{}: {} row{}, {} network{}, {} bytes of weights, CRC-32 {}",
            summary.file.display(),
            summary.rows,
            if summary.rows == 1 { "" } else { "s" },
            summary.networks,
            if summary.networks == 1 { "" } else { "s" },
            summary.weight_bytes,
            summary.model_crc
        ))
    })
}

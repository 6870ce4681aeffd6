//! Command `export`: a model as source code.

use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::{ArgGroup, Args};
use serde::Serialize;
use taxel_data::output::write_bytes;
use taxel_learn::ModelBlob;
use taxel_learn::export::c::{self, Name};
use taxel_learn::export::rust::{self, Unheld};

use super::{Common, print};

/// Write a model as source code in C or Rust, for a program that never changes its model.
///
/// In C, it is a library in a folder: one source file in C99 with its header, and what CMake, Arduino, PlatformIO and Zephyr
/// need. It needs no heap and no other library, holds any model, and gives the bits that the blob gives (docs/c.md).
///
/// In Rust, it is a file with one `static` of `taxel_core::Fixed` a row-wire, and a function `decode` from the readings of a
/// frame to its outputs. Nothing in it can fail, and it gives the bits that the blob gives. A Fixed holds networks of single
/// rows in the number format f32, and nothing else (docs/formats.md).
#[derive(Args)]
#[command(group(ArgGroup::new("language").required(true)))]
#[command(after_help = "Examples:
  host-sim train press -o press.bin
  host-sim export press.bin --c lib/press --name press

  host-sim train press --each-row --format f32 -o press.bin
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
    let (written, weight_bytes, blob);
    if let Some(file) = &arguments.rust {
        print::check_output(file, &[&arguments.model])
            .map_err(|cause| Error::Usage(format!("{cause} (--rust)")))?;
        blob = ModelBlob::read(&arguments.model)?;
        write_rust(arguments, file, &blob)?;
        (written, weight_bytes) = (file, rust::weight_bytes(&blob.parse()));
    } else {
        let folder = arguments.c.as_ref().ok_or_else(|| Error::Usage("--c or --rust".into()))?;
        blob = ModelBlob::read(&arguments.model)?;
        c::write(&blob, &arguments.name, folder)?;
        (written, weight_bytes) = (folder, c::constant_bytes(&blob));
    }
    let model = blob.parse();
    let summary = Summary {
        subject: model.metadata().name.into(),
        model_crc: format!("{:08x}", model.crc()),
        rows: model.shape().rows,
        networks: model.network_count(),
        weight_bytes,
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

fn write_rust(arguments: &Arguments, file: &Path, blob: &ModelBlob) -> Result<()> {
    let source = rust::source(&blob.parse()).map_err(|part| Error::Unfit {
        path: arguments.model.clone(),
        message: format!(
            "a Fixed has no room for {part}: train it {} (docs/formats.md), or export it with --c",
            remedy(part)
        ),
    })?;
    Ok(write_bytes(file, source.as_bytes())?)
}

/// How to train a model without this part.
fn remedy(part: Unheld) -> &'static str {
    match part {
        Unheld::Projection => "with --each-row",
        Unheld::RelativeInputs => "without --relative-inputs",
        Unheld::Confidence => "without --confidence",
        Unheld::Fill => "without --fill",
        Unheld::Format(_) => "with --format f32",
    }
}

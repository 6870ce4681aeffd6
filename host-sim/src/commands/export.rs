//! Command `export`: a model as source code.

use std::path::PathBuf;

use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_data::output::write_bytes;
use taxel_learn::ModelBlob;
use taxel_learn::export::{self, Unheld};

use super::{Common, print};

/// Write a model as source code, for a program that never changes its model.
///
/// The file holds one `static` of `model_core::Fixed` a row-wire, and a function `decode` from the readings of a frame to
/// its outputs. Nothing in it can fail, and it gives the bits that the blob gives. A Fixed holds networks of single rows in
/// the number format f32-direct, and nothing else (docs/formats.md).
#[derive(Args)]
#[command(after_help = "Example:
  host-sim train press --format f32-direct -o press.bin
  host-sim export press.bin --rust src/press.rs")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// Rust source file to write.
    #[arg(long, value_name = "FILE")]
    rust: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    model_crc: String,
    rows: usize,
    /// Networks, one static each; rows may share them.
    networks: usize,
    /// Bytes that the networks take in flash.
    weight_bytes: usize,
    file: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    print::check_output(&arguments.rust, &[&arguments.model])
        .map_err(|cause| Error::Usage(format!("{cause} (--rust)")))?;
    let blob = ModelBlob::read(&arguments.model)?;
    let model = blob.parse();
    let source = export::rust(&model).map_err(|part| Error::Unfit {
        path: arguments.model.clone(),
        message: format!(
            "a Fixed has no room for {part}: train it {} (docs/formats.md)",
            remedy(part)
        ),
    })?;
    write_bytes(&arguments.rust, source.as_bytes())?;
    let summary = Summary {
        subject: model.metadata().name.into(),
        model_crc: format!("{:08x}", model.crc()),
        rows: model.shape().rows,
        networks: model.network_count(),
        weight_bytes: export::weight_bytes(&model),
        file: arguments.rust.clone(),
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

/// How to train a model without this part.
fn remedy(part: Unheld) -> &'static str {
    match part {
        Unheld::Projection => "without --whole-array",
        Unheld::RelativeInputs => "without --relative-inputs",
        Unheld::Confidence => "without --confidence",
        Unheld::Fill => "without --fill",
        Unheld::Format(_) => "with --format f32-direct",
    }
}

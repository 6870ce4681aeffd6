//! Command `recover`: a recording that was cut, mended.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::{Common, print};
use crate::{Error, Result};

/// Mend a recording that has no end, since whoever wrote it was killed or the disk was full, or that is damaged.
///
/// Frames are kept in parts of half a second; a part that is cut or damaged is left out. The mended file takes the place of the
/// other at once, or that stays as it was: also if no part of it is whole.
#[derive(Args)]
#[command(after_help = "Example: host-sim recover recording-1.mcap")]
pub struct Arguments {
    /// Recording (.mcap).
    recording: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    file: PathBuf,
    /// Whether it was cut or damaged.
    was_cut: bool,
    /// Frames that it holds now; `None` if it was whole.
    frames: Option<u64>,
    /// Bytes at its end that belong to no whole frame.
    bytes_left_out: u64,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let path = &arguments.recording;
    let recovered = taxel_recording::recover(path)
        .map_err(|cause| Error::Unfit { path: path.clone(), message: cause.to_string() })?;
    let summary = Summary {
        file: path.clone(),
        was_cut: recovered.is_some(),
        frames: recovered.as_ref().map(|it| it.frames),
        bytes_left_out: recovered.map_or(0, |it| it.bytes_left_out),
    };
    print::result(common, &summary, || match summary.frames {
        None => print::Page::of(format_args!("{} is whole: nothing was changed", path.display())),
        Some(frames) => print::Page::of(format_args!(
            "{}: {frames} frames recovered, {} bytes at its end left out",
            path.display(),
            summary.bytes_left_out
        )),
    })
}

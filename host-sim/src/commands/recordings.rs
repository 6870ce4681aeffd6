//! Recordings (.mcap) as files that commands read and write.

use std::fs::File;
use std::io;
use std::path::Path;
use std::time::SystemTime;

use taxel_data::DataFile;
use taxel_data::output::{Scratch, write_whole};
use taxel_recording::{Extras, Frame, Layout, Reader, Replace, Writer, recover};

use super::Common;
use crate::{Error, Result};

/// Name of the column with the time of each frame in s.
const TIME: &str = "time_s";

/// Whether `path` is that of a recording, by its extension.
pub fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|it| it.eq_ignore_ascii_case("mcap"))
}

/// Error for the recording at `path`.
fn unfit(path: &Path, cause: &taxel_recording::Error) -> Error {
    Error::Unfit { path: path.into(), message: cause.to_string() }
}

/// Opens a recording. One that was cut is mended first, or read as far as it is whole where it cannot be written.
pub fn open(path: &Path, common: &Common) -> Result<Reader> {
    let error = |cause| unfit(path, &cause);
    let reader = Reader::open(path).map_err(error)?;
    if !reader.was_cut() {
        return Ok(reader);
    }
    let name = path.display();
    match recover(path) {
        Ok(mended) => {
            let (frames, bytes) =
                mended.map_or((0, 0), |mended| (mended.frames, mended.bytes_left_out));
            common.remark(format_args!(
                "note: {name} had no end, because the program that wrote it was killed: repaired, with {frames} frames; \
                 {bytes} bytes of cut or damaged parts are left out"
            ));
            Reader::open(path).map_err(error)
        }
        Err(cause) => {
            common
                .remark(format_args!("note: {name} has no end, and is read up to there: {cause}"));
            Ok(reader)
        }
    }
}

/// Reads a recording as a table: the time of each frame, its readings, and its true outputs where these are known. Estimates are not
/// taken for the truth: they stay out. Parts that are damaged stay out too, each with a note.
pub fn read(path: &Path, common: &Common) -> Result<DataFile> {
    let reader = open(path, common)?;
    let layout = reader.layout().clone();
    let mut header = vec![TIME.to_owned()];
    header.extend(layout.readings.iter().map(|column| column.name.clone()));
    let (mut values, mut has_truth) = (Vec::new(), None);
    let mut first_us = None;
    for frame in reader {
        let frame = match frame {
            Ok(frame) => frame,
            Err(cause @ taxel_recording::Error::Read(_)) => return Err(unfit(path, &cause)),
            Err(cause) => {
                common.remark(format_args!("note: {}: left out: {cause}", path.display()));
                continue;
            }
        };
        // Either all lines of a table have it or none.
        let has_truth = *has_truth.get_or_insert(frame.truth.is_some());
        let truth = match (frame.truth, has_truth) {
            (Some(truth), true) => truth,
            (None, true) => vec![f32::NAN; layout.outputs.len()],
            (_, false) => vec![],
        };
        let since_us = frame.time_us.saturating_sub(*first_us.get_or_insert(frame.time_us));
        values.push(since_us as f64 * 1e-6);
        // Of an open wire, whose reading is infinite, a table holds none.
        let known = |value: f32| if value.is_finite() { f64::from(value) } else { f64::NAN };
        values.extend(frame.readings.into_iter().chain(truth).map(known));
    }
    if has_truth.is_none() {
        return Err(Error::Unfit { path: path.into(), message: "no frame in it is whole".into() });
    }
    if has_truth == Some(true) {
        header.extend(layout.outputs.iter().map(|column| column.name.clone()));
    } else if !layout.outputs.is_empty() {
        common.remark(format_args!(
            "note: {} has no true outputs; its estimates are not used as such",
            path.display()
        ));
    }
    Ok(DataFile::of_table(path, header, values)?)
}

/// Writes a recording of these frames to `path`, whole or not at all.
pub fn write(
    path: &Path,
    layout: &Layout,
    extras: &Extras,
    frames: impl Iterator<Item = Frame>,
) -> Result<()> {
    let failed = |cause: io::Error| taxel_data::Error::write(path, cause);
    let scratch = Scratch::new().map_err(failed)?;
    let whole = scratch.path().join("whole.mcap");
    let error = |cause: taxel_recording::Error| unfit(path, &cause);
    let writer = Writer::create(&whole, layout, extras, SystemTime::now(), Replace::AnyFile);
    let mut writer = writer.map_err(error)?;
    for frame in frames {
        writer.write(&frame).map_err(error)?;
    }
    writer.finish().map_err(error)?;
    let mut written = File::open(&whole).map_err(failed)?;
    write_whole(path, |to| io::copy(&mut written, to).map(drop).map_err(failed))?;
    Ok(())
}
